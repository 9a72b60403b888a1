"""The pixels that see the wall while the camera moves: nearly all of the sensor, nearly all the time.

They answer to light as all pixels do. What is done for speed, and changes nothing else:

- A pixel is left asleep through a span where no point of the texture that it passes can bring it to
  a threshold. Asleep, its level is its light; that is looked up when it wakes.
- The pixels of a row that are awake go through a stretch side by side: light, noise and low-pass
  are loops without a branch, which the compiler makes of wide instructions. The few that can reach
  their threshold in the stretch, or are in their dead time, are then followed one by one.
"""

from __future__ import annotations

import numba as nb
import numpy as np
import numpy.typing as npt

from bicode_lab.camera.motion import Floats
from bicode_lab.camera.pixel_steps import F4, F8, I8, MOST_LANES, U4, fast_exp, fire_stretch, most_events, noise_key
from bicode_lab.camera.sensor import NOISE_REACH

NEAREST_HORIZON = 1e-6  # 1 / depth [1/m] below which a line of sight is taken to miss the wall

Flags = npt.NDArray[np.bool_]


@nb.njit(cache=True, error_model="numpy")
def find_places(
    shape: tuple[int, int], h: Floats, y: int, columns: F8, many: int, at: I8, right: F8, down: F8, seen: F8
) -> None:
    """The first `many` pixels of a list of a row's columns in; the point of the wall that each looks at out.

    `at` is filled with its number in the repeated image, `right` and `down` with how far the place looked
    at is from it, 0 .. 1, `seen` with 1, or 0 where the wall is not on the line of sight.
    """
    n_rows, n_columns = float(shape[0] - 2), float(shape[1] - 2)
    per_row, per_column, stride = 1.0 / n_rows, 1.0 / n_columns, shape[1]
    w0, u0, v0 = h[2, 1] * y + h[2, 2], h[0, 1] * y + h[0, 2], h[1, 1] * y + h[1, 2]
    w1, u1, v1 = h[2, 0], h[0, 0], h[1, 0]
    for i in range(many):
        x = columns[i]
        w = w1 * x + w0
        seen[i] = 1.0 if w >= NEAREST_HORIZON else 0.0
        near = max(w, NEAREST_HORIZON)
        u, v = (u1 * x + u0) / near, (v1 * x + v0) / near
        column, row = np.floor(u), np.floor(v)
        right[i], down[i] = u - column, v - row
        column -= n_columns * np.floor(column * per_column)
        row -= n_rows * np.floor(row * per_row)
        at[i] = np.int64(row * stride + column)


@nb.njit(cache=True, error_model="numpy")
def read_places(image: F4, many: int, at: I8, right: F8, down: F8, seen: F8, base: float, light: F8) -> None:
    """What `find_places` found in; `light` is filled with `base` and the image between its four nearest points.

    The image is repeated without end: it comes with its first two rows and columns once more behind its last.
    """
    flat, stride = image.ravel(), image.shape[1]
    for i in range(many):
        k = np.uint64(at[i])
        upper = flat[k] * (1 - right[i]) + flat[k + np.uint64(1)] * right[i]
        k += np.uint64(stride)
        lower = flat[k] * (1 - right[i]) + flat[k + np.uint64(1)] * right[i]
        light[i] = base + seen[i] * (upper * (1 - down[i]) + lower * down[i])


@nb.njit(cache=True, error_model="numpy")
def sample_row(image: F4, h: Floats, y: int, columns: F8, many: int, base: float, light: F8, room: F8) -> None:
    """The first `many` pixels of a list of a row's columns in; `light` is filled with `base` and the wall there.

    `room`, shape (4, width or more), is for what lies between.
    """
    at = room[3].view(np.int64)
    find_places(image.shape, h, y, columns, many, at, room[0], room[1], room[2])
    read_places(image, many, at, room[0], room[1], room[2], base, light)


@nb.njit(cache=True, error_model="numpy")
def _wake_row(
    y: int, width: int, taken: Flags, asleep: Flags, image: F4, lowest: F4, highest: F4, log_ambient: float,
    before: Floats, middle: Floats, start_us: float, margin: float,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4, columns: F8, light: F8, room: F8,
) -> int:  # fmt: skip
    """Put a row's pixels to sleep or wake them; `columns` is filled with those awake, their number comes back."""
    for x in range(width):
        columns[x] = x
    at = room[3].view(np.int64)
    find_places(lowest.shape, middle, y, columns, width, at, room[0], room[1], room[2])
    least, most = lowest.ravel(), highest.ravel()
    many, woken = 0, 0
    for x in range(width):
        pixel, place = y * width + x, np.uint64(at[x])
        ref = reference[pixel] - log_ambient
        up, down = threshold_on[pixel] - margin, threshold_off[pixel] - margin
        is_calm = most[place] - ref < up and ref - least[place] < down
        if is_calm and room[2, x] > 0 and (asleep[pixel] or free_us[pixel] <= start_us):
            asleep[pixel] = not taken[pixel]
            continue
        if taken[pixel]:
            asleep[pixel] = False
            continue
        columns[many] = x
        many += 1
        if asleep[pixel]:
            columns[width + woken] = x
            woken += 1
            asleep[pixel] = False
    if woken:
        sample_row(image, before, y, columns[width:], woken, log_ambient, light, room)
        for i in range(woken):
            level[y * width + int(columns[width + i])] = light[i]
    return many


@nb.njit(cache=True, error_model="numpy")
def settle(index: npt.NDArray[np.int32], width: int, asleep: Flags, image: F4, before: Floats, log_ambient: float,
           level: F4) -> None:  # fmt: skip
    """Places on the sensor in; those asleep get the level that they have."""
    column, light, room = np.empty(1), np.empty(1), np.empty((4, 1))
    for at in index:
        if asleep[at]:
            column[0] = at % width
            sample_row(image, before, at // width, column, 1, log_ambient, light, room)
            level[at] = light[0]


@nb.njit(cache=True, error_model="numpy")
def fire_wall_pixels(
    first: int, width: int, taken: Flags, asleep: Flags, image: F4, lowest: F4, highest: F4, log_ambient: float,
    before: Floats, from_pixels: Floats, edges: F8, moments: I8,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, tau_us: float, dead: float, delay_on: float, delay_off: float,
    pixels: U4, times: F8, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Every pixel that no marker lights, row by row, through a span of time in which the camera moves.

    Parameters as for `sensor.fire_lit_pixels`, but `first` and what comes back count rows, and

    taken : ndarray of bool, shape (height * width,)
        Pixels that a marker lights; they are left out.
    asleep : ndarray of bool, shape (height * width,)
        Pixels whose level is the light they had last.
    image : ndarray, shape (rows + 2, columns + 2)
        Log reflectance of the wall, see `sample_row`.
    lowest, highest : ndarray, shape (rows, columns)
        Extremes of it around each point, as far as a pixel's path through the span leads from its middle.
    log_ambient : float
        Log signal of reflectance 1.
    before : ndarray, shape (3, 3)
        The homography of the last stretch before this span.
    from_pixels : ndarray, shape (stretches, 3, 3)
        The homography to the wall's points in each stretch.
    """
    stretches = edges.size - 1
    most = most_events(edges, dead)
    room, lanes = np.empty((13, width)), np.empty(7 * MOST_LANES)
    light, rate, v, ref, free, on, off = room[6:]
    columns, keys, places = np.empty(2 * width), np.empty(width, np.uint64), np.empty(width, np.int64)
    for y in range(first, taken.size // width):
        many = _wake_row(
            y, width, taken, asleep, image, lowest, highest, log_ambient, before, from_pixels[stretches // 2],
            edges[0], NOISE_REACH * noise, level, reference, free_us, threshold_on, threshold_off, columns, light, room,
        )  # fmt: skip
        if count + many * most > pixels.size:
            return y, count
        for i in range(many):
            at = y * width + int(columns[i])
            places[i], keys[i] = at, noise_key(seed, at)
            v[i], ref[i], free[i], on[i], off[i] = (
                level[at],
                reference[at],
                free_us[at],
                threshold_on[at],
                threshold_off[at],
            )
        for k in range(stretches):
            sample_row(image, from_pixels[k], y, columns, many, log_ambient, light, room)
            for i in range(many):
                rate[i] = fast_exp(light[i]) / tau_us
            count = fire_stretch(
                many, edges[k], edges[k + 1], keys, moments[k], noise, light, rate, v, ref, free, on, off,
                dead, delay_on, delay_off, places, room, lanes, pixels, times, count,
            )  # fmt: skip
        for i in range(many):
            at = places[i]
            level[at], reference[at], free_us[at] = v[i], ref[i], free[i]
    return taken.size // width, count
