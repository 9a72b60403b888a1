"""The kernel that runs many pixels through one stretch of constant light, side by side.

`fire_stretch` states what a pixel does, and `pixels` explains it in words. For speed, everything that all pixels do
alike is a loop without a branch and without a call, which the compiler turns into wide instructions; so the
exponential and the logarithm are written out. Only the crossings are left for a loop that handles pixels one by one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit

F4 = npt.NDArray[np.float32]
F8 = npt.NDArray[np.float64]
I4 = npt.NDArray[np.int32]
I8 = npt.NDArray[np.int64]
U4 = npt.NDArray[np.uint32]

LOG2_E = 1.4426950408889634
LN_2_HIGH, LN_2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
MAX_EVENTS_PER_STRETCH = 512  # log light moves by less than 512 smallest thresholds (11 decades)
MAX_TIME_CONSTANTS = 600.0  # in a longer stretch the level reaches its aim long before the end
# The same for refractory periods. It is less than that of stretches, so that a period of more time constants still ends
# within a stretch of more time constants; where it does not, the level is at its aim when it ends, here and there.
MAX_KEPT = 300.0
# Pixels side by side have seven columns in one array, at distances that the compiler knows; otherwise it would have to
# check that they do not overlap. The distance is no multiple of 4 kB, which would make columns share cache lines.
MAX_LANES = 1320
OFF_AIM, REF_OFF, REST, KEPT, ON, OFF, SHARE = (k * MAX_LANES for k in range(7))
NOISE_CELL = 4  # mean length of a noise cell in time constants at signal 1, see `noise_cells`
NOISE_REACH = 3.46  # largest magnitude of `noise_from`, in standard deviations
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD  # of the square root of one half


@njit(inline="always", error_model="numpy")
def fast_exp(x: float) -> float:
    """Return the exponential of x, for -700 < x < 700, with a relative error of 1e-11."""
    n = np.floor(x * LOG2_E + 0.5)
    r = (x - n * LN_2_HIGH) - n * LN_2_LOW
    p = 1 + r * (1 / 6) * (1 + r * (1 / 7) * (1 + r * (1 / 8) * (1 + r * (1 / 9))))
    p = 1 + r * (1 + r * (1 / 2) * (1 + r * (1 / 3) * (1 + r * (1 / 4) * (1 + r * (1 / 5) * p))))
    power = np.int64((np.int64(n) + 1023) << 52)
    return float(p * power.view(np.float64))


@njit(inline="always", error_model="numpy")
def fast_log(x: float) -> float:
    """Return the natural logarithm of x > 0, with an error of 1e-11."""
    bits = np.float64(x).view(np.int64)
    n = (bits - ROOT_HALF_BITS) >> 52
    m = np.int64(bits - (n << 52)).view(np.float64)  # 0.7 .. 1.4
    s = (m - 1) / (m + 1)
    z = s * s
    series = 1 + z * (1 / 3 + z * (1 / 5 + z * (1 / 7 + z * (1 / 9 + z * (1 / 11 + z * (1 / 13 + z * (1 / 15)))))))
    return float(n * LN_2_HIGH + (n * LN_2_LOW + 2 * s * series))


@njit(inline="always")
def noise_key(seed: np.uint64, pixel: int) -> np.uint32:
    """Return the key of a pixel for `noise_from`; it is another one for each pixel."""
    return np.uint32(np.uint32(seed ^ (seed >> np.uint64(32))) ^ np.uint32(np.uint32(pixel) * np.uint32(0x9E3779B1)))


@njit(inline="always")
def noise_from(key: np.uint32, moment: int) -> float:
    """Return a pixel's standard normal number for a moment, the sum of four uniform ones.

    Parameters
    ----------
    key : int
        See `noise_key`.
    moment : int
        A number that names the moment, for example that of a noise cell (`noise_cells`).

    Returns
    -------
    float
        The same for the same key and moment; at most `NOISE_REACH` in magnitude.
    """
    name = np.uint64(moment) * np.uint64(0xD1B54A32D192ED03)
    z = np.uint32(key ^ np.uint32(name >> np.uint64(32)))
    z = np.uint32((z ^ (z >> np.uint32(16))) * np.uint32(0x85EBCA6B))
    z = np.uint32((z ^ (z >> np.uint32(13))) * np.uint32(0xC2B2AE35))
    z = np.uint32(z ^ (z >> np.uint32(16)))
    low = np.uint32(0xFF)
    total = (z & low) + ((z >> np.uint32(8)) & low) + ((z >> np.uint32(16)) & low) + (z >> np.uint32(24))
    return (float(np.int32(total)) - 510.0) * 6.76582e-3  # variance 4 * (256^2 - 1) / 12


@njit(inline="always", error_model="numpy")
def noise_scale(signal: float) -> float:
    """Return by how much the noise of a pixel's target exceeds that of its level, see `noise_cells`."""
    x = NOISE_CELL * max(signal, 0.01)  # mean length of a cell, in time constants
    passed = 1 - fast_exp(-min(x, MAX_TIME_CONSTANTS))
    return float(1 / np.sqrt(1 - 1 / x + passed * passed / (x * x * x)))


def noise_cells(start_us: float, end_us: float, time_constant_us: float) -> tuple[F8, I8]:
    """Return the cells of time that a span meets; within a cell, the noise of each pixel has one target.

    In units of the mean length of a cell, cell k begins at k + u, where u is a fixed random number in 0 .. 1. So time
    has no rhythm that a receiver could find. Two moments that are s apart are in one cell with a probability of
    R(s) = 1 - s + s^3 / 6 for s < 1, (2 - s)^3 / 6 for s < 2, and 0 beyond. This is the autocorrelation of the target,
    and its integral from 0 on is 7 / 12. With a mean length of 12 / 7 time constants, the correlation time of the
    target is one time constant. The level of a pixel that has x time constants in a cell follows the target with the
    variance x times the integral of exp(-x s) R(s), which is 1 - 1 / x + (1 - exp(-x))^2 / x^3 of the target's.
    `noise_scale` is one over its root.

    Parameters
    ----------
    start_us, end_us : float
        The span [us].
    time_constant_us : float
        Time constant of a pixel in the light of the office wall [us].

    Returns
    -------
    starts_us : ndarray of float64, shape (cells,)
        Rising; the first is at or before `start_us`, all others are before `end_us` [us].
    numbers : ndarray of int64, shape (cells,)
        Numbers of the cells, for `noise_from`.
    """
    mean_us = NOISE_CELL * time_constant_us
    numbers = np.arange(int(np.floor(start_us / mean_us)) - 1, int(np.ceil(end_us / mean_us)) + 1)
    z = numbers.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    starts = (numbers + (z >> np.uint64(40)) / 2.0**24) * mean_us
    met = slice(int(np.searchsorted(starts, start_us, side="right")) - 1, int(np.searchsorted(starts, end_us)))
    return starts[met], numbers[met]


@njit(cache=True, error_model="numpy")
def max_events(edges: F8, refractory_us: float) -> int:
    """Return the largest number of events that a pixel can make in some stretches.

    Parameters
    ----------
    edges : ndarray of float64, shape (stretches + 1,)
        Borders of the stretches [us].
    refractory_us : float
        [us]

    Returns
    -------
    int
    """
    most = 0
    for k in range(edges.size - 1):
        most += int(min(float(MAX_EVENTS_PER_STRETCH), (edges[k + 1] - edges[k]) / max(refractory_us, 1e-3) + 2))
    return most


@njit(cache=True, error_model="numpy")
def _begin(many: int, start: float, end: float, rate: F8, free: F8, lanes: F8) -> int:
    """End the resets that end in the stretch, and return how many pixels can reach a threshold in it."""
    held, ready = 0, 0
    for i in range(many):
        held += free[i] > start
    if held:
        for i in range(many):
            if free[i] > start and free[i] < end:
                lanes[REF_OFF + i] = lanes[OFF_AIM + i] = lanes[OFF_AIM + i] * fast_exp(
                    -min((free[i] - start) * rate[i], MAX_KEPT)
                )
                lanes[REST + i] = fast_exp(min((end - free[i]) * rate[i], MAX_TIME_CONSTANTS))
    for i in range(many):
        reaches = (lanes[REF_OFF + i] < -lanes[ON + i]) | (lanes[REF_OFF + i] > lanes[OFF + i])
        ready += reaches & (free[i] < end)
        lanes[KEPT + i] = lanes[KEPT + i] if free[i] < end else 0.0
    for i in range(many):
        free[i] = max(free[i], start)
    return ready


@njit(cache=True, error_model="numpy")
def _cross_once(n: int, lanes: F8, pixels: U4, times: F8, count: int) -> tuple[int, int]:
    """Find the next crossing of each of the first `n` lanes; return how many may have more, and the number of events.

    `pixels` and `times` get, for each crossing, twice the number of its lane and the polarity, and the share of the
    distance to the aim that is left, below 0 for OFF. A lane that has no more crossings is marked by a `KEPT` of 0.
    """
    more = 0
    for j in range(n):
        ref_off, off_aim, rest, kept, on, off = (
            lanes[REF_OFF + j], lanes[OFF_AIM + j], lanes[REST + j], lanes[KEPT + j], lanes[ON + j], lanes[OFF + j]
        )  # fmt: skip
        rises = ref_off < 0.0
        short = ref_off + on if rises else ref_off - off
        share = short / off_aim
        is_ahead = (share > 0.0) & (share < 1.0)  # else the level has passed the threshold already
        share = share if is_ahead else 1.0
        after = rest * share  # what is left of the stretch then
        fires = ((short if rises else -short) < 0.0) & (after > 1.0) & (kept > 0.0)
        again = fires & (after * kept > 1.0)  # its reset ends before the stretch does
        reached = (short if is_ahead else off_aim) if fires else off_aim
        released = kept if again else 1.0
        lanes[SHARE + j] = (share if rises else -share) if fires else 0.0
        lanes[OFF_AIM + j], lanes[REST + j] = reached * released, (after if fires else rest) * released
        ref_off = reached * released if again else ref_off
        again &= (ref_off < -on) | (ref_off > off)
        lanes[REF_OFF + j], lanes[KEPT + j] = ref_off, kept if again else 0.0
        more += again
    for j in range(n):
        share = lanes[SHARE + j]
        pixels[count], times[count] = np.uint32(2 * j + (share > 0.0)), share
        count += share != 0.0
    return more, count


@njit(cache=True, error_model="numpy")
def fire_stretch(
    many: int, start: float, end: float, keys: U4, moment: int, noise: F8, light: F8, rate: F8, kept: F8,
    level: F8, reference: F8, free: F8, on: F8, off: F8, refractory_us: float, delay_on: float, delay_off: float,
    places: I8, room: F8, lanes: F8, pixels: U4, times: F8, count: int,
) -> int:  # fmt: skip
    """Run the first `many` pixels through one stretch of constant light.

    While a pixel is not in reset, the distance of its level to its aim shrinks by e in one time constant. So a distance
    of `off_aim` that is `short` at the crossing takes log(off_aim / short) time constants. All of this is computed in
    ratios: `rest` is e to the number of time constants until the stretch ends.

    Parameters
    ----------
    many : int
        Number of pixels.
    start, end : float
        The stretch [us].
    keys, moment, noise : ndarray, int, ndarray
        Of the noise in this stretch, see `noise_from`; the standard deviation of its target.
    light, rate, kept : ndarray
        Log signal, inverse of the time constant [1/us], and what is left of a distance after a refractory period.
    level, reference, free : ndarray
        Level, level at the end of the last reset, and the end of that reset [us]; all three are changed.
    on, off : ndarray
        Thresholds.
    refractory_us, delay_on, delay_off : float
        Refractory period, and latencies, which are added to the times of events [us].
    places : ndarray
        Places of the pixels on the sensor.
    room, lanes : ndarray, shape (1 or more, many or more) and (7 * MAX_LANES,)
        Room for intermediate values.
    pixels, times : ndarray
        Room for events, see `pixels.fire_lit_pixels`.
    count : int
        Number of events that are there already.

    Returns
    -------
    int
        Number of events.
    """
    aim, before = room[0], count
    for i in range(many):
        aim[i] = light[i] + noise[i] * noise_from(keys[i], moment)
    for i in range(many):
        lanes[OFF_AIM + i], lanes[REF_OFF + i] = level[i] - aim[i], reference[i] - aim[i]
        lanes[ON + i], lanes[OFF + i] = on[i], off[i]
    for i in range(many):
        lanes[REST + i] = fast_exp(min((end - start) * rate[i], MAX_TIME_CONSTANTS))
        lanes[KEPT + i] = kept[i]
    more = _begin(many, start, end, rate, free, lanes)
    while more:
        more, count = _cross_once(many, lanes, pixels, times, count)
    who, when = pixels[before:count], times[before:count]  # indices from 0 allow wide instructions
    for j in range(when.size):
        when[j] = fast_log(abs(when[j]))
    for j in range(when.size):
        i, rises = who[j] >> 1, who[j] & 1
        crossing = free[i] - when[j] / rate[i]
        when[j] = crossing + (delay_on if rises else delay_off)
        free[i] = crossing + refractory_us
        who[j] = np.uint32(2 * places[i] + rises)
    for i in range(many):
        level[i] = aim[i] + lanes[OFF_AIM + i] / lanes[REST + i]
    for i in range(many):
        reference[i] = aim[i] + lanes[REF_OFF + i]
    return count
