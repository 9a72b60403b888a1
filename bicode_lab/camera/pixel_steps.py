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
U8 = npt.NDArray[np.uint64]

LOG2_E = 1.4426950408889634
LN_2_HIGH, LN_2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
MAX_EVENTS_PER_STRETCH = 512  # log light moves by less than 512 smallest thresholds (11 decades)
MAX_TIME_CONSTANTS = 600.0  # in a longer stretch the level reaches its aim long before the end
# Pixels side by side have seven columns in one array, at distances that the compiler knows; otherwise it would have to
# check that they do not overlap. The distance is no multiple of 4 kB, which would make columns share cache lines.
MAX_LANES = 1320
OFF_AIM, REF_OFF, REST, KEPT, ON, OFF, SHARE = (k * MAX_LANES for k in range(7))
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
def noise_key(seed: np.uint64, pixel: int) -> np.uint64:
    """Return the key of a pixel for `noise_from`."""
    return seed ^ (np.uint64(pixel) * np.uint64(0x9E3779B97F4A7C15))


@njit(inline="always")
def noise_from(key: np.uint64, moment: int) -> float:
    """Return a pixel's standard normal number for a moment, the sum of four uniform ones.

    Parameters
    ----------
    key : int
        See `noise_key`.
    moment : int
        A number that names the moment.

    Returns
    -------
    float
        The same for the same key and moment; at most `pixels.NOISE_REACH` in magnitude.
    """
    z = key ^ (np.uint64(moment) * np.uint64(0xD1B54A32D192ED03))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    low = np.uint64(0xFFFF)
    total = (z & low) + ((z >> np.uint64(16)) & low) + ((z >> np.uint64(32)) & low) + (z >> np.uint64(48))
    return (float(total) - 131070.0) * 2.6429e-5  # variance 4 * 65536^2 / 12


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
                lanes[REF_OFF + i] = lanes[OFF_AIM + i] = lanes[OFF_AIM + i] * fast_exp((start - free[i]) * rate[i])
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
    many: int, start: float, end: float, keys: U8, moment: int, noise: float, light: F8, rate: F8,
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
    keys, moment, noise : ndarray, int, float
        Of the noise in this stretch, see `noise_from`; its standard deviation.
    light, rate : ndarray
        Log signal, and the inverse of the time constant [1/us].
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
        aim[i] = light[i] + noise * noise_from(keys[i], moment)
    for i in range(many):
        lanes[OFF_AIM + i], lanes[REF_OFF + i] = level[i] - aim[i], reference[i] - aim[i]
        lanes[ON + i], lanes[OFF + i] = on[i], off[i]
    for i in range(many):
        lanes[REST + i] = fast_exp(min((end - start) * rate[i], MAX_TIME_CONSTANTS))
        lanes[KEPT + i] = fast_exp(-refractory_us * rate[i])
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
