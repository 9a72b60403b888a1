"""Events that no change of the light causes: background activity, hot pixels and the leak of the references.

The reference of a pixel leaks, so that the distance between its level and its reference grows all the time, and ON
events come without any change of the light (Nozaki and Delbruck 2017). A followed pixel, one that a marker or a moving
wall lights, makes these events like any others, since its reference has moved. The others do nothing but leak.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from bicode_lab.camera.motion import Floats
from bicode_lab.camera.pixel_steps import F4, I8, U4
from bicode_lab.camera.pixels import Flags, PixelModel, PixelState
from bicode_lab.kernels import njit

LEAK_US = 1e6  # references move once in so long a time ...
LEAK_STEP = 0.01  # ... or by this share of a threshold, if that comes first
PARTS = 6, 4  # rows and columns of parts of the image from which references are copied
REST = 4.0  # standard deviations of noise between the level of a pixel at rest and its thresholds


def spread_references(state: PixelState, model: PixelModel, rng: np.random.Generator) -> None:
    """Spread the references of a sensor that has been on for minutes over the cycle of their leak.

    Without noise, the level of a pixel is evenly anywhere between its reference and its ON threshold. Noise makes a
    pixel fire before its level is at a threshold, so the level stays `REST` standard deviations away from both.

    Parameters
    ----------
    state : PixelState
        Its references are changed.
    model : PixelModel
        With a `leak_hz` of 0, references stay as they are.
    rng : numpy.random.Generator
    """
    if model.leak_hz == 0:
        return
    away = np.float32(REST * model.noise)
    low = np.maximum(away - state.threshold_off, -away)
    high = np.maximum(state.threshold_on - away, low)
    state.reference[:] = state.level - low - rng.random(state.level.size, np.float32) * (high - low)


def copy_references(
    sample: PixelState, sample_shape: tuple[int, int], state: PixelState, shape: tuple[int, int], log_mean: float,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Give the pixels of a sensor the references of a sparse sensor that sees the same and has been on for long.

    How often a pixel fires depends on what it sees and on how far its two thresholds are from the mean light. So it
    gets the place of the mean light between its thresholds from a pixel of the same part of the image (see `PARTS`)
    whose thresholds are as far apart.

    Parameters
    ----------
    sample : PixelState
        The sparse sensor.
    sample_shape : tuple of 2 ints
        Its height and width.
    state : PixelState
        Its references are changed.
    shape : tuple of 2 ints
        Its height and width.
    log_mean : float
        Mean log light of both.
    rng : numpy.random.Generator
    """
    reference, on, off = (
        a.reshape(sample_shape) for a in (sample.reference, sample.threshold_on, sample.threshold_off)
    )
    out, out_on, out_off = (a.reshape(shape) for a in (state.reference, state.threshold_on, state.threshold_off))
    for part in np.ndindex(PARTS):
        few, many = (
            tuple(slice(k * n // m, (k + 1) * n // m) for k, n, m in zip(part, size, PARTS, strict=True))
            for size in (sample_shape, shape)
        )
        width = (on[few] + off[few]).ravel()
        place = (log_mean - reference[few].ravel() + off[few].ravel()) / width
        order = np.argsort(width)
        wanted = out_on[many] + out_off[many]
        near = width.size // 100 + 1
        at = np.searchsorted(width[order], wanted) + rng.integers(-near, near + 1, wanted.shape, np.int16)
        found = place[order][np.clip(at, 0, width.size - 1)].astype(np.float32)
        out[many] = np.float32(log_mean) + out_off[many] - found * wanted


class Strays:
    """The events of a sensor that no change of the light causes.

    Parameters
    ----------
    model : PixelModel
    state : PixelState
        The pixels of the sensor; their references leak.
    rng : numpy.random.Generator

    Attributes
    ----------
    leaked_us : float
        The references have leaked up to this time [us].
    """

    def __init__(self, model: PixelModel, state: PixelState, rng: np.random.Generator) -> None:
        self._model, self._state, self._rng = model, state, rng
        self._hot_places = rng.integers(state.level.size, size=model.hot_pixels)
        self._hot_hz = max(model.hot_pixel_hz, 1e-9) * 10 ** (-2 * rng.random(model.hot_pixels))
        self.leaked_us = 0.0

    def chunk(self, start_us: float, end_us: float, followed: Callable[[], Flags]) -> tuple[U4, Floats]:
        """Return the events of a chunk, and later ones of leaking pixels.

        Of the background activity, `background_hz`, the leak is a part: where pixels leak, so many ON events fewer are
        drawn.

        Parameters
        ----------
        start_us, end_us : float
            [us]
        followed : callable
            Returns the pixels whose light changes, ndarray of bool, shape (height * width,).

        Returns
        -------
        pixels, times : ndarray
            See `pixels.fire_lit_pixels`.
        """
        model, rng, size = self._model, self._rng, self._state.level.size
        seconds, off_share = (end_us - start_us) * 1e-6, model.background_off_share
        off_hz, on_hz = off_share * model.background_hz, (1 - off_share) * model.background_hz
        total_hz = off_hz + max(on_hz - model.leak_hz, 0.0)
        everywhere = rng.integers(size, size=rng.poisson(total_hz * size * seconds))
        hot = np.repeat(self._hot_places, rng.poisson(self._hot_hz * seconds))
        is_on = np.concatenate(
            [
                rng.random(everywhere.size) >= (off_hz / total_hz if total_hz else 0.0),
                rng.random(hot.size) >= off_share,
            ]
        )
        times = start_us + rng.random(is_on.size) * (end_us - start_us)
        places, late = self._leaked(end_us, followed)
        codes = np.concatenate([2 * np.concatenate([everywhere, hot]) + is_on, 2 * places + 1])
        return codes.astype(np.uint32), np.concatenate([times, late])

    def _leaked(self, end_us: float, followed: Callable[[], Flags]) -> tuple[I8, Floats]:
        """Let the references leak where it is time to; return places and times of the ON events that this causes."""
        leak_hz, since_us = self._model.leak_hz, self.leaked_us
        if leak_hz == 0 or since_us >= end_us:
            return np.empty(0, np.int64), np.empty(0)
        ahead_us = max(end_us - since_us, min(LEAK_US, LEAK_STEP / leak_hz * 1e6))
        state = self._state
        places = leak(state.level, state.reference, state.threshold_on, ahead_us * 1e-6 * leak_hz, followed())
        self.leaked_us = since_us + ahead_us
        return places, since_us + self._rng.random(places.size) * ahead_us


@njit(cache=True)
def leak(level: F4, reference: F4, threshold_on: F4, share: float, followed: npt.NDArray[np.bool_]) -> I8:
    """Move the references of all pixels away from their levels, and find the pixels that fire by this alone.

    Parameters
    ----------
    level, reference, threshold_on : ndarray
        See `PixelState`; the references are changed.
    share : float
        By how much, in ON thresholds.
    followed : ndarray of bool
        Pixels that do not fire here.

    Returns
    -------
    ndarray of int64, shape (events,)
        Places of the pixels that fire; a pixel may do so several times.
    """
    places, n = np.empty(int(level.size * (share + 2)), np.int64), 0
    for i in range(level.size):
        on = threshold_on[i]
        reference[i] -= np.float32(share * on)
        if not followed[i] and level[i] - reference[i] > on:
            while level[i] - reference[i] > on and n < places.size:
                reference[i] += on
                places[n] = i
                n += 1
    return places[:n].copy()
