"""The pixels: from the signal over time to events, solved in continuous time.

A pixel follows the logarithm of its light through a first-order low-pass whose time constant is inversely proportional
to the light. When it has moved by more than its threshold since its last reset, it fires and is held in reset for the
refractory period; its level at the end of that is its new reference. Between two changes of the light the response is
an exponential, so the time of each crossing has a closed form, and events are not bunched at the frames of a simulator
(see docs/design.md).

The noise of a pixel is a random target for each stretch of constant light, which passes through the same low-pass. So
it is continuous, has the bandwidth of the pixel and is drawn anew at each edge of the light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bicode_lab.camera.pixel_steps import F4, F8, I4, I8, MAX_LANES, U4, fast_log, fire_stretch, max_events, noise_key
from bicode_lab.constants import constant
from bicode_lab.kernels import njit

SMALLEST_THRESHOLD = 0.05
NOISE_REACH = 3.47  # largest magnitude of `noise_from`, in standard deviations
SIDE_BY_SIDE = 256  # pixels; their state fits into the first level cache


@dataclass(frozen=True, kw_only=True)
class PixelModel:
    """Settings of the pixels; each value comes from products, from measurements or from an assumption, as marked.

    Parameters
    ----------
    threshold_on, threshold_off : float
        Mean contrast threshold in log light (nominal 25 %), 0.05 or more.
    threshold_spread : float
        Standard deviation of the threshold from pixel to pixel, drawn for ON and OFF separately (0.03, assumption).
    time_constant_us : float
        Time constant of the low-pass at signal 1, the office wall [us]; it is proportional to 1 / signal (fitted).
    noise : float
        Standard deviation of the noise of the log level (0.05, from a trial), drawn anew at each change of the light.
    latency_on_us, latency_off_us : float
        Delay after a crossing [us] (20 and 30, fitted to measured latencies of an IMX636).
    refractory_us : float
        Refractory period after an event [us] (50; measured to be below 100 .. 150 at default biases).
    background_hz : float
        Mean rate of background activity per pixel [Hz] (0.003, median of a quiet EVK4 recording).
    background_off_share : float
        Share of OFF events in it, 0 .. 1 (0.64, the same recording).
    hot_pixels : int
        Number of pixels that fire without a cause. Their rates are spread evenly in the logarithm up to `hot_pixel_hz`.
    hot_pixel_hz : float
        Rate of the fastest one [Hz] (134, the same recording).

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    threshold_on: float = constant("threshold")
    threshold_off: float = constant("threshold")
    threshold_spread: float = constant("threshold_spread")
    time_constant_us: float = constant("time_constant_us")
    noise: float = constant("noise")
    latency_on_us: float = 20.0
    latency_off_us: float = 30.0
    refractory_us: float = constant("refractory_us")
    background_hz: float = 0.003
    background_off_share: float = 0.64
    hot_pixels: int = 8
    hot_pixel_hz: float = 134.0

    def __post_init__(self) -> None:
        for name in ("threshold_on", "threshold_off"):
            if not getattr(self, name) >= SMALLEST_THRESHOLD:
                raise ValueError(f"{name}={getattr(self, name)} is below {SMALLEST_THRESHOLD}; real ones are above 0.1")
        if not self.time_constant_us > 0:
            raise ValueError(f"time_constant_us={self.time_constant_us} is not possible; choose more than 0")
        for name in ("threshold_spread", "noise", "latency_on_us", "latency_off_us", "refractory_us", "background_hz",
                     "hot_pixels", "hot_pixel_hz"):  # fmt: skip
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")
        if not 0 <= self.background_off_share <= 1:
            raise ValueError(f"background_off_share={self.background_off_share} is not in 0 .. 1")


@dataclass(frozen=True, eq=False)
class PixelState:
    """What every pixel of the sensor remembers between two stretches of time.

    Parameters
    ----------
    level : ndarray of float32, shape (height * width,)
        Log light behind the low-pass.
    reference : ndarray of float32, shape (height * width,)
        Level at the end of the last reset.
    free_us : ndarray of float64, shape (height * width,)
        End of the last reset [us].
    threshold_on, threshold_off : ndarray of float32, shape (height * width,)
        In log light.
    """

    level: F4
    reference: F4
    free_us: F8
    threshold_on: F4
    threshold_off: F4


def start_pixels(signal: F4, model: PixelModel, rng: np.random.Generator) -> PixelState:
    """Return pixels that have settled on a signal, with thresholds drawn at random.

    Parameters
    ----------
    signal : ndarray of float32, shape (n,)
        Above 0.
    model : PixelModel
    rng : numpy.random.Generator

    Returns
    -------
    PixelState
    """
    level = np.log(signal.astype(np.float64)).astype(np.float32)
    spread = rng.standard_normal((2, signal.size), dtype=np.float32) * np.float32(model.threshold_spread)
    on = np.maximum(spread[0] + np.float32(model.threshold_on), np.float32(SMALLEST_THRESHOLD))
    off = np.maximum(spread[1] + np.float32(model.threshold_off), np.float32(SMALLEST_THRESHOLD))
    return PixelState(level, level.copy(), np.full(signal.size, -1e18), on, off)


@njit(cache=True, error_model="numpy")
def fire_lit_pixels(
    first: int, index: I4, ambient: F4, glow: F4, edges: F8, moments: I8, levels: F4, maps: I4,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, tau_us: float, refractory_us: float, delay_on: float, delay_off: float,
    pixels: U4, times: F8, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Run lit pixels through a span of time, a group of pixels after the other.

    Parameters
    ----------
    first : int
        The pixel to go on with (a call ends early when the room for events runs out).
    index : ndarray, shape (n,)
        Place of each pixel on the sensor, ``y * width + x``.
    ambient : ndarray, shape (maps, n)
        Signal without the LEDs.
    glow : ndarray, shape (maps, markers, n)
        Signal of each LED at full level.
    edges : ndarray, shape (stretches + 1,)
        Times at which the light changes, start and end of the span included [us].
    moments : ndarray, shape (stretches,)
        A number that names the time at which a stretch began, for its noise. A stretch that is cut by the border of a
        span keeps its number.
    levels : ndarray, shape (stretches, markers)
        LED level, 0 .. 1.
    maps : ndarray, shape (stretches,)
        Row of `ambient` and `glow` that is valid in a stretch.
    level, reference, free_us, threshold_on, threshold_off : ndarray
        See `PixelState`; the first three are changed.
    seed : int
        Of the noise.
    noise, tau_us, refractory_us, delay_on, delay_off : float
        See `PixelModel`.
    pixels, times : ndarray
        Room for the events: ``2 * index + polarity``, and time [us].
    count : int
        Number of events that are there already.

    Returns
    -------
    next_pixel, count : int
        ``next_pixel == n`` once all are done.
    """
    stretches, markers = levels.shape
    most = max_events(edges, refractory_us)
    room, lanes = np.empty((9, SIDE_BY_SIDE)), np.empty(7 * MAX_LANES)
    signal, light, rate, v, ref, free, on, off = (  # one by one: loops over rows of `a, b = room` do not become wide
        room[1], room[2], room[3], room[4], room[5], room[6], room[7], room[8]
    )  # fmt: skip
    shone = np.empty((4, SIDE_BY_SIDE))  # light and rate of the last two stretches, since an LED alternates
    is_new = np.abs(maps[2:] - maps[:-2]) + np.abs(levels[2:] - levels[:-2]).sum(1) > 0
    keys, places = np.empty(SIDE_BY_SIDE, np.uint64), np.empty(SIDE_BY_SIDE, np.int64)
    for lead in range(first, index.size, SIDE_BY_SIDE):
        many = min(SIDE_BY_SIDE, index.size - lead)
        if count + many * most > pixels.size:
            return lead, count
        for i in range(many):
            at = index[lead + i]
            places[i], keys[i] = at, noise_key(seed, at)
            v[i], ref[i], free[i], on[i], off[i] = (
                level[at],
                reference[at],
                free_us[at],
                threshold_on[at],
                threshold_off[at],
            )
        for k in range(stretches):
            held = 2 * (k % 2)
            if k < 2 or is_new[k - 2]:
                for i in range(many):
                    signal[i] = ambient[maps[k], lead + i]
                for m in range(markers):
                    for i in range(many):
                        signal[i] += float(glow[maps[k], m, lead + i]) * float(levels[k, m])
                for i in range(many):
                    shone[held, i], shone[held + 1, i] = fast_log(signal[i]), signal[i] / tau_us
            for i in range(many):
                light[i], rate[i] = shone[held, i], shone[held + 1, i]
            count = fire_stretch(
                many, edges[k], edges[k + 1], keys, moments[k], noise, light, rate, v, ref, free, on, off,
                refractory_us, delay_on, delay_off, places, room, lanes, pixels, times, count,
            )  # fmt: skip
        for i in range(many):
            at = index[lead + i]
            level[at], reference[at], free_us[at] = v[i], ref[i], free[i]
    return index.size, count


@njit(cache=True)
def sort_by_time(pixels: U4, times: F8, count: int, start_us: int, end_us: int, width: int, words: I8) -> int:
    """Sort the events before `end_us` by time, and keep the later ones for the next call.

    Events are sorted by counting, in the order of whole microseconds; events of the same microsecond keep their order.

    Parameters
    ----------
    pixels, times : ndarray
        The events, see `fire_lit_pixels`; none is before `start_us`. The later ones are moved to the front.
    count : int
        Number of events.
    start_us, end_us : int
        [us]
    width : int
        Of the sensor [px].
    words : ndarray of int64, shape (count or more, 2)
        Filled with the sorted events, see `events.words`.

    Returns
    -------
    int
        Number of sorted events.
    """
    span, late = end_us - start_us, 0
    at, order = np.zeros(span + 2, np.int32), np.empty(count, np.int64)
    for i in range(count):
        at[min(int(times[i]) - start_us, span) + 1] += 1
    for b in range(span):
        at[b + 1] += at[b]
    for i in range(count):
        t = int(times[i]) - start_us
        if t < span:  # an event takes half as many bytes here, so more of them are in the cache
            order[at[t]] = np.int64(pixels[i]) | (t << 32)
            at[t] += 1
        else:
            pixels[late], times[late] = pixels[i], times[i]
            late += 1
    flat, per_row = words.reshape(-1), 1.0 / width
    for j in range(at[span]):
        where = (order[j] & 0xFFFFFFFF) >> 1
        y = int((where + 0.5) * per_row)  # an integer division takes ten times as long
        flat[2 * j] = (where - y * width) | (y << 16) | ((order[j] & 1) << 32)
        flat[2 * j + 1] = start_us + (order[j] >> 32)
    return int(at[span])
