"""The pixels: signal over time -> events, solved in continuous time.

A pixel follows the logarithm of its light through a first-order low-pass whose time
constant falls as one over the light. When it has moved by more than its threshold
since it was last reset, it fires and is held in reset for the refractory period; what
it holds when released is its new reference. Between two changes of the light the
response is an exponential, so the moment of each crossing has a closed form and no
event is bunched on the frames of a simulator (see docs/design.md).

Noise is a random target of its own for each stretch of constant light, passed through
the same low-pass: continuous, of the pixel's own bandwidth, and fresh at each edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import numpy.typing as npt

F4 = npt.NDArray[np.float32]
F8 = npt.NDArray[np.float64]
I4 = npt.NDArray[np.int32]
I8 = npt.NDArray[np.int64]
U4 = npt.NDArray[np.uint32]

SMALLEST_THRESHOLD = 0.05
NOISE_REACH = 3.47  # the noise drawn here never exceeds this many standard deviations
MOST_EVENTS_A_STRETCH = 512  # log light moves by less than 512 smallest thresholds (11 decades)


@dataclass(frozen=True, kw_only=True)
class PixelModel:
    """How a pixel answers to light. Sources: products' nominal values, measurements, or assumption as marked.

    Parameters
    ----------
    threshold_on, threshold_off : float
        Mean contrast threshold in log light (nominal 25 %).
    threshold_spread : float
        Its standard deviation from pixel to pixel, drawn for ON and OFF apart (0.03, assumption).
    time_constant_us : float
        Of the low-pass at signal 1, the office wall; it goes as 1 / signal (150, from a trial).
    noise : float
        Standard deviation of the log level's noise (0.05, from a trial), fresh at each change of the light.
    latency_on_us, latency_off_us : float
        Pure delay behind a crossing (20 and 30, fit to measured latencies of an IMX636).
    refractory_us : float
        Dead time after an event (50; measured to be below 100-150 at default biases).
    background_hz : float
        Mean rate of background events a pixel (0.003, median of a quiet EVK4 recording).
    background_off_share : float
        Share of OFF among them (0.64, the same recording).
    hot_pixels : int
        Pixels that fire by themselves; their rates are spread evenly in the logarithm up to `hot_pixel_hz`.
    hot_pixel_hz : float
        The fastest one (134, the same recording).
    """

    threshold_on: float = 0.25
    threshold_off: float = 0.25
    threshold_spread: float = 0.03
    time_constant_us: float = 150.0
    noise: float = 0.05
    latency_on_us: float = 20.0
    latency_off_us: float = 30.0
    refractory_us: float = 50.0
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
        for name in ("threshold_spread", "noise", "latency_on_us", "latency_off_us", "refractory_us"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")
        for name in ("background_hz", "hot_pixels", "hot_pixel_hz"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")
        if not 0 <= self.background_off_share <= 1:
            raise ValueError(f"background_off_share={self.background_off_share} is not in 0 .. 1")


@dataclass(frozen=True, eq=False)
class PixelState:
    """What every pixel of the sensor remembers between two stretches of time, each shape (height * width,).

    Parameters
    ----------
    level : ndarray, float32
        Log light behind the low-pass.
    reference : ndarray, float32
        The level it was last reset at.
    free_us : ndarray, float64
        When its reset ends.
    threshold_on, threshold_off : ndarray, float32
    """

    level: F4
    reference: F4
    free_us: F8
    threshold_on: F4
    threshold_off: F4


def start_pixels(signal: F4, model: PixelModel, rng: np.random.Generator) -> PixelState:
    """The signal at rest of every pixel, shape (n,), in; pixels that have settled on it out."""
    level = np.log(signal.astype(np.float64)).astype(np.float32)
    spread = rng.standard_normal((2, signal.size), dtype=np.float32) * np.float32(model.threshold_spread)
    on = np.maximum(spread[0] + np.float32(model.threshold_on), np.float32(SMALLEST_THRESHOLD))
    off = np.maximum(spread[1] + np.float32(model.threshold_off), np.float32(SMALLEST_THRESHOLD))
    return PixelState(level, level.copy(), np.full(signal.size, -1e18), on, off)


@nb.njit(inline="always")
def noise_key(seed: np.uint64, pixel: int) -> np.uint64:
    """A seed and a pixel in, what `noise_from` wants of them out."""
    return seed ^ (np.uint64(pixel) * np.uint64(0x9E3779B97F4A7C15))


@nb.njit(inline="always")
def noise_from(key: np.uint64, moment: int) -> float:
    """A pixel's key and a moment in, a standard normal number (sum of four uniform ones) that is theirs out."""
    z = key ^ (np.uint64(moment) * np.uint64(0xD1B54A32D192ED03))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    low = np.uint64(0xFFFF)
    total = (z & low) + ((z >> np.uint64(16)) & low) + ((z >> np.uint64(32)) & low) + (z >> np.uint64(48))
    return (float(total) - 131070.0) * 2.6429e-5  # variance 4 * 65536^2 / 12


@nb.njit(inline="always")
def _follow(
    t: float, end: float, target: float, tau: float, level: float, reference: float, free: float,
    on: float, off: float, dead: float, delay_on: float, delay_off: float,
    pixel: int, pixels: U4, times: F8, count: int,
) -> tuple[float, float, float, int]:  # fmt: skip
    """One pixel through one stretch of constant light [us]; its events are written, its new state comes back."""
    if free > t:
        if free >= end:
            return target + (level - target) * np.exp((t - end) / tau), reference, free, count
        level = target + (level - target) * np.exp((t - free) / tau)
        reference = level
        t = free
    while True:
        if target - reference > on:
            wanted, polarity, delay = reference + on, 1, delay_on
        elif reference - target > off:
            wanted, polarity, delay = reference - off, 0, delay_off
        else:
            break
        ratio = (level - target) / (wanted - target)
        crossing = t + tau * np.log(ratio) if ratio > 1.0 else t
        if crossing >= end:
            break
        pixels[count] = np.uint32(pixel) * np.uint32(2) + np.uint32(polarity)
        times[count] = crossing + delay
        count += 1
        free = crossing + dead
        if ratio > 1.0:
            level = wanted
        if free >= end:
            t = crossing
            break
        level = target + (level - target) * np.exp(-dead / tau)
        reference = level
        t = free
    return target + (level - target) * np.exp((t - end) / tau), reference, free, count


@nb.njit(cache=True)
def fire_lit_pixels(
    first: int, index: I4, ambient: F4, glow: F4, edges: F8, moments: I8, levels: F4, maps: I4,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, tau_us: float, dead: float, delay_on: float, delay_off: float,
    pixels: U4, times: F8, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Lit pixels through a span of time, pixel by pixel.

    Parameters
    ----------
    first : int
        The pixel to go on with (a call ends early when the room for events runs out).
    index : ndarray, shape (n,)
        Where each lit pixel stands on the sensor, ``y * width + x``.
    ambient : ndarray, shape (maps, n)
        Signal without the LEDs.
    glow : ndarray, shape (maps, markers, n)
        Signal of each LED at full level.
    edges : ndarray, shape (stretches + 1,)
        When the light changes [us], the span's start and end included.
    moments : ndarray, shape (stretches,)
        A number that names the moment a stretch began, for its noise; a stretch cut by a
        span's border keeps it.
    levels : ndarray, shape (stretches, markers)
        LED level, 0 .. 1.
    maps : ndarray, shape (stretches,)
        Which row of `ambient` and `glow` holds in a stretch.
    pixels, times : ndarrays
        Room for the events: ``2 * index + polarity``, and time [us].
    count : int
        Events there already.

    Returns
    -------
    next_pixel, count : int
        ``next_pixel == n`` once all are done.
    """
    stretches = edges.size - 1
    for i in range(first, index.size):
        if count + stretches * MOST_EVENTS_A_STRETCH > pixels.size:
            return i, count
        at = index[i]
        v, ref, free = float(level[at]), float(reference[at]), free_us[at]
        on, off = float(threshold_on[at]), float(threshold_off[at])
        key = noise_key(seed, at)
        # An LED that jumps between two levels gives two logarithms; they are kept.
        signal_a = signal_b = -1.0
        log_a = log_b = 0.0
        for k in range(stretches):
            row = maps[k]
            signal = float(ambient[row, i])
            for m in range(levels.shape[1]):
                signal += float(glow[row, m, i]) * float(levels[k, m])
            if signal != signal_a:
                signal_a, signal_b, log_a, log_b = signal_b, signal_a, log_b, log_a
                if signal != signal_a:
                    signal_a, log_a = signal, np.log(signal)
            target = log_a + noise * noise_from(key, moments[k])
            v, ref, free, count = _follow(
                edges[k], edges[k + 1], target, tau_us / signal, v, ref, free,
                on, off, dead, delay_on, delay_off, at, pixels, times, count,
            )  # fmt: skip
        level[at], reference[at], free_us[at] = v, ref, free
    return index.size, count


@nb.njit(cache=True)
def sort_by_time(
    pixels: U4, times: F8, count: int, start_us: int, bins: int, width: int, events: npt.NDArray[np.void]
) -> None:
    """Events in any order in, `events` filled in the order of time (whole us), by counting; ties keep their order."""
    at = np.zeros(bins + 1, np.int64)
    for i in range(count):
        at[int(times[i]) - start_us + 1] += 1
    for b in range(bins):
        at[b + 1] += at[b]
    for i in range(count):
        t = int(times[i])
        place = at[t - start_us]
        at[t - start_us] += 1
        where = pixels[i] >> np.uint32(1)
        events[place].x = where % np.uint32(width)
        events[place].y = where // np.uint32(width)
        events[place].p = pixels[i] & np.uint32(1)
        events[place].t = t
