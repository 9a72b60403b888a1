"""The pixels that see the wall while the camera moves: nearly all of the sensor, nearly all the time.

They respond to light as all pixels do. The following saves time and changes nothing else:

- A pixel is skipped in a span where no point of the texture along its path, with the largest noise that it gets there,
  can bring it to a threshold. Its level is computed later, when it is needed.
- The active pixels go through a stretch side by side: light, noise and low-pass are loops without a branch, which the
  compiler turns into wide instructions (see `pixel_steps`).
- Only the few pixels whose aim is beyond a threshold, or that are in reset, can do anything but follow their light.
  They are taken out and go through the stretch as the pixels of a marker do.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.camera.motion import Floats
from bicode_lab.camera.pixel_steps import (
    F4,
    F8,
    I8,
    MAX_LANES,
    MAX_TIME_CONSTANTS,
    U4,
    U8,
    fast_exp,
    fire_stretch,
    max_events,
    noise_from,
    noise_key,
)
from bicode_lab.camera.pixels import NOISE_REACH
from bicode_lab.kernels import njit

NEAREST_HORIZON = 1e-6  # 1 / depth [1/m]; below it, a line of sight counts as missing the wall
ROUNDING = 1e-5  # of 32-bit levels and extremes; a pixel this close to its threshold is active
SIDE_BY_SIDE = 512  # pixels; a whole number of wide instructions
# Columns of the active pixels in one array, at distances that the compiler knows (see `pixel_steps`).
DISTANCE = SIDE_BY_SIDE + 24
X, Y, LEVEL, REFERENCE, FREE, ON, OFF, RIGHT, DOWN, SEEN, LIGHT, RATE, AIM, BUSY = (k * DISTANCE for k in range(14))
COLUMNS = 14

Flags = npt.NDArray[np.bool_]


@njit(cache=True, error_model="numpy")
def find_places(shape: tuple[int, int], h: Floats, many: int, lanes: F8, at: I8) -> None:
    """Find the points of the wall that the first `many` pixels, given by their `X` and `Y`, look at.

    `at` is filled with the number of each point in the repeated image, `RIGHT` and `DOWN` with the distance of the
    place from that point, 0 .. 1, and `SEEN` with 1, or with 0 where the line of sight does not meet the wall.
    """
    n_rows, n_columns = float(shape[0] - 2), float(shape[1] - 2)
    per_row, per_column, stride = 1.0 / n_rows, 1.0 / n_columns, shape[1]
    u0, u1, u2, v0, v1, v2 = h[0, 0], h[0, 1], h[0, 2], h[1, 0], h[1, 1], h[1, 2]
    w0, w1, w2 = h[2, 0], h[2, 1], h[2, 2]
    for i in range(many):
        x, y = lanes[X + i], lanes[Y + i]
        w = w0 * x + (w1 * y + w2)
        lanes[SEEN + i] = 1.0 if w >= NEAREST_HORIZON else 0.0
        near = max(w, NEAREST_HORIZON)
        u, v = (u0 * x + (u1 * y + u2)) / near, (v0 * x + (v1 * y + v2)) / near
        column, row = np.floor(u), np.floor(v)
        lanes[RIGHT + i], lanes[DOWN + i] = u - column, v - row
        column -= n_columns * np.floor(column * per_column)
        row -= n_rows * np.floor(row * per_row)
        at[i] = np.int64(row * stride + column)


@njit(cache=True, error_model="numpy")
def read_places(image: F4, many: int, lanes: F8, at: I8, base: float) -> None:
    """Fill `LIGHT` with `base` plus the image, interpolated between the four points that `find_places` has found.

    The image is repeated without end: its first two rows and columns follow once more after its last.
    """
    flat, stride = image.ravel(), image.shape[1]
    for i in range(many):
        k = np.uint64(at[i])
        right, down = lanes[RIGHT + i], lanes[DOWN + i]
        upper = flat[k] * (1 - right) + flat[k + np.uint64(1)] * right
        k += np.uint64(stride)
        lower = flat[k] * (1 - right) + flat[k + np.uint64(1)] * right
        lanes[LIGHT + i] = base + lanes[SEEN + i] * (upper * (1 - down) + lower * down)


@njit(cache=True, error_model="numpy")
def look_up(image: F4, h: Floats, base: float, x: F8, y: F8) -> F4:
    """Return `base` plus the image at the places that pixels look at.

    Parameters
    ----------
    image : ndarray of float32, shape (rows + 2, columns + 2)
        See `Wall.repeated`.
    h : ndarray, shape (3, 3)
        Homography from pixels to points of the image.
    base : float
    x, y : ndarray of float64, shape (n,)
        Pixels [px].

    Returns
    -------
    ndarray of float32, shape (n,)
    """
    light = np.empty(x.size, np.float32)
    lanes, at = np.empty(COLUMNS * DISTANCE), np.empty(SIDE_BY_SIDE, np.int64)
    for lead in range(0, x.size, SIDE_BY_SIDE):
        many = min(SIDE_BY_SIDE, x.size - lead)
        for i in range(many):
            lanes[X + i], lanes[Y + i] = x[lead + i], y[lead + i]
        find_places(image.shape, h, many, lanes, at)
        read_places(image, many, lanes, at, base)
        for i in range(many):
            light[lead + i] = lanes[LIGHT + i]
    return light


@njit(cache=True, error_model="numpy")
def _select(
    lead: int, many: int, width: int, taken: Flags, skipped: Flags, lowest: F4, highest: F4, log_ambient: float,
    middle: Floats, start_us: float, moments: I8, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, active: I8, waiting: int, lanes: F8, at: I8, keys: U8,
) -> tuple[int, int]:  # fmt: skip
    """Decide whether `many` pixels from `lead` on are skipped; add the active ones to a list of `waiting` ones.

    Returns the length of the list, and how many of the new ones were skipped before; `at` lists those.
    """
    for i in range(many):
        y = np.floor((lead + i + 0.5) / width)
        lanes[X + i], lanes[Y + i] = lead + i - width * y, y
    find_places(lowest.shape, middle, many, lanes, at)
    of, least, most, n, resumed = slice(lead, lead + many), lowest.ravel(), highest.ravel(), 0, 0
    on, off, ref, lit, rests = threshold_on[of], threshold_off[of], reference[of], taken[of], skipped[of]
    for i in range(many):
        k = np.uint64(at[i])
        lanes[LEVEL + i], lanes[LIGHT + i], lanes[REFERENCE + i] = least[k], most[k], ref[i] - log_ambient
    for i in range(many):  # largest noise without an event, up and down; none where the wall is not in view
        lanes[ON + i] = on[i] - (lanes[LIGHT + i] - lanes[REFERENCE + i]) - ROUNDING if lanes[SEEN + i] > 0.0 else -1.0
        lanes[OFF + i] = off[i] - (lanes[REFERENCE + i] - lanes[LEVEL + i]) - ROUNDING
    for i in range(many):
        is_calm = rests[i] & (min(lanes[ON + i], lanes[OFF + i]) > NOISE_REACH * noise)
        lanes[BUSY + i] = 0.0 if lit[i] | is_calm else 1.0
    for i in range(many):
        rests[i] = rests[i] & (not lit[i])
    for i in range(many):
        at[n] = i
        n += lanes[BUSY + i] > 0.0
    for j in range(n):
        i, lanes[AIM + j], lanes[RATE + j] = at[j], 0.0, 0.0
        keys[j], lanes[DOWN + j] = noise_key(seed, lead + i), lanes[OFF + i]
        lanes[RIGHT + j] = -1.0 if free_us[lead + i] > start_us else lanes[ON + i]  # active while in reset
    for moment in moments:
        for j in range(n):
            z = noise_from(keys[j], moment)
            lanes[AIM + j], lanes[RATE + j] = max(lanes[AIM + j], z), min(lanes[RATE + j], z)
    for j in range(n):
        p = lead + at[j]
        is_up = (noise * lanes[AIM + j] > lanes[RIGHT + j]) | (-noise * lanes[RATE + j] > lanes[DOWN + j])
        active[waiting], at[resumed] = p, p
        waiting += is_up
        resumed += is_up & skipped[p]
        skipped[p] = not is_up
    return waiting, resumed


@njit(cache=True, error_model="numpy")
def _follow(many: int, start: float, end: float, keys: U8, moment: int, noise: float, tau_us: float,
            lanes: F8, turn: I8) -> int:  # fmt: skip
    """Run the first `many` pixels, which see `LIGHT`, through one stretch as if none could fire.

    Pixels that may fire, or are in reset, are left as they were. `turn` is filled with them; their number is returned.
    """
    took, n = end - start, 0
    for i in range(many):
        lanes[RATE + i] = fast_exp(lanes[LIGHT + i]) / tau_us
        lanes[AIM + i] = lanes[LIGHT + i] + noise * noise_from(keys[i], moment)
    for i in range(many):
        aim, rest = lanes[AIM + i], fast_exp(min(took * lanes[RATE + i], MAX_TIME_CONSTANTS))
        way = aim - lanes[REFERENCE + i]
        is_free = (lanes[FREE + i] <= start) & (way <= lanes[ON + i]) & (-way <= lanes[OFF + i])
        lanes[BUSY + i] = 0.0 if is_free else 1.0
        lanes[LEVEL + i] = aim + (lanes[LEVEL + i] - aim) / rest if is_free else lanes[LEVEL + i]
    for i in range(many):
        turn[n] = i
        n += lanes[BUSY + i] != 0.0
    return n


@njit(cache=True, error_model="numpy")
def _catch_up(
    resumed: int, width: int, image: F4, log_ambient: float, from_pixels: Floats, edges: F8, moments: I8,
    seed: np.uint64, noise: float, tau_us: float, lanes: F8, at: I8, keys: U8, turn: I8, level: F4,
) -> None:  # fmt: skip
    """Bring the skipped pixels in `at` up to date: compute their level from the last stretches before this span."""
    for j in range(resumed):
        keys[j], lanes[X + j], lanes[Y + j] = noise_key(seed, at[j]), at[j] % width, at[j] // width
        lanes[REFERENCE + j], lanes[FREE + j], lanes[ON + j], lanes[OFF + j] = at[j], -np.inf, np.inf, np.inf
    for k in range(moments.size):
        find_places(image.shape, from_pixels[k], resumed, lanes, at)
        read_places(image, resumed, lanes, at, log_ambient)
        if k == 0:
            lanes[LEVEL : LEVEL + resumed] = lanes[LIGHT : LIGHT + resumed]
        _follow(resumed, edges[k], edges[k + 1], keys, moments[k], noise, tau_us, lanes, turn)
    for j in range(resumed):
        level[int(lanes[REFERENCE + j])] = lanes[LEVEL + j]


@njit(cache=True, error_model="numpy")
def _fire(
    n: int, turn: I8, start: float, end: float, keys: U8, moment: int, noise: float, refractory_us: float,
    delay_on: float, delay_off: float, active: I8, lanes: F8, room: F8, pixels: U4, times: F8, count: int,
) -> int:  # fmt: skip
    """Run the `n` pixels that `_follow` has listed through their stretch, as the pixels of a marker are run."""
    columns = room[: 14 * SIDE_BY_SIDE].reshape(14, SIDE_BY_SIDE)
    light, rate, v, ref, free, on, off = columns[5:12]
    few_keys, places = columns[12].view(np.uint64), columns[13].view(np.int64)
    for j in range(n):
        i = turn[j]
        few_keys[j], places[j], light[j], rate[j] = keys[i], active[i], lanes[LIGHT + i], lanes[RATE + i]
        v[j], ref[j], free[j] = lanes[LEVEL + i], lanes[REFERENCE + i], lanes[FREE + i]
        on[j], off[j] = lanes[ON + i], lanes[OFF + i]
    count = fire_stretch(
        n, start, end, few_keys, moment, noise, light, rate, v, ref, free, on, off, refractory_us, delay_on, delay_off,
        places, columns, room[14 * SIDE_BY_SIDE :], pixels, times, count,
    )  # fmt: skip
    for j in range(n):
        i = turn[j]
        lanes[LEVEL + i], lanes[REFERENCE + i], lanes[FREE + i] = v[j], ref[j], free[j]
    return count


@njit(cache=True, error_model="numpy")
def fire_wall_pixels(
    first: int, width: int, taken: Flags, skipped: Flags, image: F4, lowest: F4, highest: F4, log_ambient: float,
    before: tuple[Floats, F8, I8], from_pixels: Floats, edges: F8, moments: I8,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, tau_us: float, refractory_us: float, delay_on: float, delay_off: float,
    pixels: U4, times: F8, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Run every pixel that no marker lights through a span of time in which the camera moves.

    Parameters and results are those of `pixels.fire_lit_pixels`, and

    Parameters
    ----------
    taken : ndarray of bool, shape (height * width,)
        Pixels that a marker lights; they are left out.
    skipped : ndarray of bool, shape (height * width,)
        Pixels whose level is not up to date; it is changed.
    image : ndarray, shape (rows + 2, columns + 2)
        Log reflectance of the wall, see `Wall.repeated`.
    lowest, highest : ndarray, shape (rows + 2, columns + 2)
        See `Wall.extremes`.
    log_ambient : float
        Log signal of reflectance 1.
    before : tuple of `from_pixels`, `edges` and `moments`
        The last stretches before this span, long enough for a pixel to forget what was before them.
    from_pixels : ndarray, shape (stretches, 3, 3)
        Homography to the points of the wall in each stretch.
    """
    most, stretches = max_events(edges, refractory_us), from_pixels.shape[0]
    lanes, at, turn = np.empty(COLUMNS * DISTANCE), np.empty(SIDE_BY_SIDE, np.int64), np.empty(SIDE_BY_SIDE, np.int64)
    keys, fire_room = np.empty(SIDE_BY_SIDE, np.uint64), np.empty(14 * SIDE_BY_SIDE + 7 * MAX_LANES)
    active, waiting, lead = np.empty(2 * SIDE_BY_SIDE, np.int64), 0, first
    while lead < taken.size or waiting:
        has_room = count + (waiting + SIDE_BY_SIDE) * most <= pixels.size
        if not (has_room or waiting):
            break
        if has_room and lead < taken.size and waiting < SIDE_BY_SIDE:
            many = min(SIDE_BY_SIDE, taken.size - lead)
            waiting, resumed = _select(
                lead, many, width, taken, skipped, lowest, highest, log_ambient, from_pixels[stretches // 2], edges[0],
                moments, reference, free_us, threshold_on, threshold_off, seed, noise, active, waiting, lanes, at, keys,
            )  # fmt: skip
            if resumed:
                _catch_up(
                    resumed, width, image, log_ambient, *before, seed, noise, tau_us, lanes, at, keys, turn, level,
                )  # fmt: skip
            lead += many
            continue
        many = min(waiting, SIDE_BY_SIDE)
        for i in range(many):
            p = active[i]
            keys[i], lanes[X + i], lanes[Y + i], lanes[FREE + i] = noise_key(seed, p), p % width, p // width, free_us[p]
            lanes[LEVEL + i], lanes[REFERENCE + i] = level[p], reference[p]
            lanes[ON + i], lanes[OFF + i] = threshold_on[p], threshold_off[p]
        for k in range(stretches):
            find_places(image.shape, from_pixels[k], many, lanes, at)
            read_places(image, many, lanes, at, log_ambient)
            n = _follow(many, edges[k], edges[k + 1], keys, moments[k], noise, tau_us, lanes, turn)
            if n:
                count = _fire(
                    n, turn, edges[k], edges[k + 1], keys, moments[k], noise, refractory_us, delay_on, delay_off,
                    active, lanes, fire_room, pixels, times, count,
                )  # fmt: skip
        for i in range(many):
            p = active[i]
            level[p], reference[p], free_us[p] = lanes[LEVEL + i], lanes[REFERENCE + i], lanes[FREE + i]
        waiting -= many
        active[:waiting] = active[many : many + waiting]
    return lead, count
