"""The pixel of `bicode_lab.camera.pixels`, simulated frame by frame in NumPy, to compare with.

Most simulators work like this: the light is sampled in frames (here every 100 us), the low-pass and the noise take one
step per frame, and a pixel that has moved by k thresholds since its last reset fires k times, spread evenly over the
frame. All pixels are computed at once; no Python loop runs over pixels or events.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.camera import PixelModel
from bicode_lab.events import Events, make_events
from bicode_lab.marker import LedWaveform

FRAME_US = 100.0

Floats = npt.NDArray[np.float64]
Columns = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.bool_], Floats]
"""x, y, polarity and time [us] of events."""
NO_EVENTS: Columns = (np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool), np.zeros(0))


def simulate(
    dark: Floats, glow: Floats, waveform: LedWaveform, model: PixelModel, duration_us: int, rng: np.random.Generator
) -> Events:
    """Simulate a patch of pixels under a blinking light.

    Parameters
    ----------
    dark : ndarray, shape (rows, columns)
        Signal without the LED, above 0.
    glow : ndarray, shape (rows, columns)
        What the LED adds to the signal when it is on.
    waveform : LedWaveform
        The LED over time.
    model : PixelModel
    duration_us : int
        Length of the recording [us].
    rng : numpy.random.Generator
        Source of all chance.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        Events sorted by time.
    """
    shape = dark.shape
    level = np.log(dark)
    reference = level.copy()
    on = np.maximum(rng.normal(model.threshold_on, model.threshold_spread, shape), 0.05)
    off = np.maximum(rng.normal(model.threshold_off, model.threshold_spread, shape), 0.05)
    noise = rng.standard_normal(shape) * model.noise
    free_us = np.full(shape, -np.inf)
    frames = []
    starts_us = np.arange(0, duration_us, FRAME_US)
    times_us, levels = waveform.steps(0, duration_us)
    lit = levels[np.searchsorted(times_us, starts_us + FRAME_US / 2, side="right") - 1]
    for start_us, share in zip(starts_us, lit, strict=True):
        signal = dark + glow * share
        kept = np.exp(-FRAME_US * signal / model.time_constant_us)
        noise = noise * kept + rng.standard_normal(shape) * (model.noise * np.sqrt(1 - kept * kept))
        level = np.log(signal) + (level - np.log(signal)) * kept
        moved = level + noise - reference
        count = np.where(moved > 0, np.floor(moved / on), -np.floor(-moved / off)).astype(np.int64)
        frames.append(_fire(start_us, count, free_us, model))
        reference += np.where(count > 0, count * on, count * off)
        frames.append(_background(start_us, shape, model, rng))
    x, y, p, t_us = (np.concatenate(column) for column in zip(*frames, strict=True))
    return make_events(x, y, p, t_us)


def _fire(start_us: float, count: npt.NDArray[np.int64], free_us: Floats, model: PixelModel) -> Columns:
    """Return the events of one frame that fall after the refractory period of their pixel.

    `count` says how often each pixel fires, negative for OFF; `free_us`, when each pixel may fire again, is updated.
    """
    y, x = np.nonzero(count)
    number = count[y, x]
    found = []
    for k in range(int(np.abs(number).max()) if number.size else 0):
        still = np.abs(number) > k
        t_us = start_us + (k + 1) * FRAME_US / (np.abs(number[still]) + 1)
        rows, columns = y[still], x[still]
        ready = t_us >= free_us[rows, columns]
        t_us, rows, columns, is_on = t_us[ready], rows[ready], columns[ready], number[still][ready] > 0
        free_us[rows, columns] = t_us + model.refractory_us
        t_us = t_us + np.where(is_on, model.latency_on_us, model.latency_off_us)
        found.append((columns, rows, is_on, t_us))
    if not found:
        return NO_EVENTS
    x, y, is_on, t_us = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(t_us, kind="stable")
    return x[order], y[order], is_on[order], t_us[order]


def _background(start_us: float, shape: tuple[int, ...], model: PixelModel, rng: np.random.Generator) -> Columns:
    """Return the background activity of one frame."""
    n = rng.poisson(model.background_hz * shape[0] * shape[1] * FRAME_US * 1e-6)
    if not n:
        return NO_EVENTS
    x, y = rng.integers(shape[1], size=n), rng.integers(shape[0], size=n)
    return x, y, rng.random(n) >= model.background_off_share, start_us + rng.random(n) * FRAME_US
