"""What stands behind the markers: a textured wall, and the events it makes when the camera moves.

The wall's image moves in steps of a quarter pixel, however long that takes, so a slow
pan costs no more than a fast one over the same way. A pixel is only followed through a
span of time where the texture around its path differs enough from what it was reset at.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba as nb
import numpy as np
import numpy.typing as npt
import skimage.data
import skimage.util
from scipy import ndimage

from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.camera.optics import Optics, plate_homography
from bicode_lab.camera.sensor import F4, F8, I8, MOST_EVENTS_A_STRETCH, NOISE_REACH, U4, _follow, _noise_of

NEAREST_HORIZON = 1e-6  # 1 / depth [1/m] below which a line of sight is taken to miss the wall
TILE = 8  # texels a side; extremes of the texture are kept a tile, its neighbours included


@dataclass(frozen=True, eq=False, kw_only=True)
class Wall:
    """A textured plane across the world's z axis, repeated without end.

    Parameters
    ----------
    log_image : ndarray, shape (rows, columns), float32
        Log of the reflectance relative to the office's mean.
    distance_m : float
        Where it stands.
    texel_m : float
        Side of one of its points on the wall [m].
    """

    log_image: F4
    distance_m: float = 5.0
    texel_m: float = 0.003
    lowest: F4 = field(init=False, repr=False)
    highest: F4 = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.log_image.ndim != 2 or not np.isfinite(self.log_image).all():
            raise ValueError("log_image is not a two-dimensional array of finite numbers")
        if self.distance_m <= 0 or self.texel_m <= 0:
            raise ValueError(f"distance_m={self.distance_m}, texel_m={self.texel_m}: choose more than 0 m each")
        rows, columns = (n - n % TILE for n in self.log_image.shape)
        if not rows or not columns:
            raise ValueError(f"log_image is {self.log_image.shape}; choose at least {TILE} x {TILE}")
        image = np.ascontiguousarray(self.log_image[:rows, :columns], np.float32)
        tiles = image.reshape(rows // TILE, TILE, columns // TILE, TILE)
        object.__setattr__(self, "log_image", image)  # whole tiles
        object.__setattr__(self, "lowest", ndimage.minimum_filter(tiles.min((1, 3)), 3, mode="wrap"))
        object.__setattr__(self, "highest", ndimage.maximum_filter(tiles.max((1, 3)), 3, mode="wrap"))

    def from_pixels(self, camera: Pose, optics: Optics) -> Floats:
        """A camera pose in; the homography from its pixels to texels out, shape (3, 3)."""
        wall = Pose(position_m=np.array([0.0, 0.0, self.distance_m])).after(camera.inverse())
        to_pixels = plate_homography(wall, optics) @ np.diag([self.texel_m, self.texel_m, 1.0])
        # The world's z axis meets the picture off its middle and off the seams where it repeats.
        middle = np.array([[1, 0, self.log_image.shape[1] / 3], [0, 1, self.log_image.shape[0] / 3], [0, 0, 1.0]])
        return np.asarray(middle @ np.linalg.inv(to_pixels))

    def log_reflectance(self, from_pixels: Floats, x0: int, y0: int, x1: int, y1: int) -> F4:
        """A homography and a rectangle of pixels in; log reflectance there out, shape (rows, columns)."""
        seen = np.empty((y1 - y0, x1 - x0), np.float32)
        _sample(self.log_image, from_pixels, x0, y0, seen)
        return seen


def textured_wall(
    name: str = "camera",
    *,
    contrast: float = 0.3,
    distance_m: float = 5.0,
    texel_m: float = 0.003,
    softness: float = 1.0,
) -> Wall:
    """The name of one of scikit-image's bundled pictures in, a wall out.

    Parameters
    ----------
    name : str
        For example "camera" (few edges, much sky), "coins", "brick", "gravel" (edges everywhere).
    contrast : float
        Standard deviation of the log reflectance.
    distance_m, texel_m : float
        See `Wall`; at 3 mm and 5 m a point of the picture covers about a pixel of the paper's camera.
    softness : float
        Standard deviation of a smoothing of the picture, points.

    Raises
    ------
    ValueError
        For a picture that is not bundled.
    """
    bundled = ("gravel", "brick", "grass", "camera", "coins", "moon", "page", "text")
    if name not in bundled:
        raise ValueError(f"name={name!r} is not a bundled picture; choose one of {', '.join(bundled)}")
    if contrast < 0:
        raise ValueError(f"contrast={contrast} is negative; choose 0 or more")
    grey = skimage.util.img_as_float64(getattr(skimage.data, name)())
    # A picture and its mirror images side by side repeat without a seam.
    grey = np.pad(grey, [(0, n) for n in grey.shape], mode="symmetric")
    log = ndimage.gaussian_filter(np.log(grey + 0.1), softness, mode="wrap")
    log = (log - log.mean()) / max(float(log.std()), 1e-9) * contrast
    return Wall(log_image=log.astype(np.float32), distance_m=distance_m, texel_m=texel_m)


@nb.njit(inline="always")
def _at(image: F4, h: Floats, x: float, y: float) -> float:
    """The repeated image at the point that a pixel maps to, between its four nearest points."""
    w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
    if w < NEAREST_HORIZON:  # the wall is not on this line of sight
        return 0.0
    u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w
    v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w
    column, row = np.floor(u), np.floor(v)
    a, b = u - column, v - row
    rows, columns = image.shape
    c0, r0 = int(column) % columns, int(row) % rows
    c1, r1 = (c0 + 1) % columns, (r0 + 1) % rows
    upper = image[r0, c0] * (1 - a) + image[r0, c1] * a
    lower = image[r1, c0] * (1 - a) + image[r1, c1] * a
    return float(upper * (1 - b) + lower * b)


@nb.njit(cache=True)
def _sample(image: F4, h: Floats, x0: int, y0: int, seen: F4) -> None:
    """Fill `seen` with the image as a rectangle of pixels sees it."""
    for row in range(seen.shape[0]):
        for column in range(seen.shape[1]):
            seen[row, column] = _at(image, h, x0 + column, y0 + row)


@nb.njit(cache=True)
def fire_background(
    first: int, width: int, taken: npt.NDArray[np.bool_], image: F4, lowest: F4, highest: F4, log_ambient: float,
    from_pixels: Floats, edges: F8, moments: I8,
    level: F4, reference: F4, free_us: F8, threshold_on: F4, threshold_off: F4,
    seed: np.uint64, noise: float, tau_us: float, dead: float, delay_on: float, delay_off: float,
    pixels: U4, times: F8, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Every pixel that no marker lights, through a span of time in which the camera moves.

    Parameters as for `sensor.fire_lit_pixels`, and

    taken : ndarray of bool, shape (height * width,)
        Pixels that a marker lights; they are left out.
    image, lowest, highest : ndarrays
        Log reflectance of the wall, and its extremes a tile (of `TILE` points and its neighbours).
    log_ambient : float
        Log signal of reflectance 1.
    from_pixels : ndarray, shape (stretches, 3, 3)
        The homography to the wall's points in each stretch.
    """
    stretches = edges.size - 1
    rows, columns = image.shape
    for at in range(first, taken.size):
        if taken[at]:
            continue
        if count + stretches * MOST_EVENTS_A_STRETCH > pixels.size:
            return at, count
        x, y = at % width, at // width
        on, off = float(threshold_on[at]), float(threshold_off[at])
        v, ref, free = float(level[at]), float(reference[at]), free_us[at]
        h0, h1 = from_pixels[0], from_pixels[stretches - 1]
        w0 = h0[2, 0] * x + h0[2, 1] * y + h0[2, 2]
        w1 = h1[2, 0] * x + h1[2, 1] * y + h1[2, 2]
        u0, v0 = (h0[0, 0] * x + h0[0, 1] * y + h0[0, 2]) / w0, (h0[1, 0] * x + h0[1, 1] * y + h0[1, 2]) / w0
        u1, v1 = (h1[0, 0] * x + h1[0, 1] * y + h1[0, 2]) / w1, (h1[1, 0] * x + h1[1, 1] * y + h1[1, 2]) / w1
        met = w0 >= NEAREST_HORIZON and w1 >= NEAREST_HORIZON
        if met and abs(u1 - u0) < TILE - 2 and abs(v1 - v0) < TILE - 2:
            r, c = (int(np.floor(v0)) % rows) // TILE, (int(np.floor(u0)) % columns) // TILE
            rise = log_ambient + highest[r, c] - ref
            fall = ref - log_ambient - lowest[r, c]
            if rise < on - NOISE_REACH * noise and fall < off - NOISE_REACH * noise and free <= edges[0]:
                level[at] = log_ambient + _at(image, h1, x, y)
                continue
        for k in range(stretches):
            light = log_ambient + _at(image, from_pixels[k], x, y)
            target = light + noise * _noise_of(seed, at, moments[k])
            v, ref, free, count = _follow(
                edges[k], edges[k + 1], target, tau_us * np.exp(-light), v, ref, free,
                on, off, dead, delay_on, delay_off, at, pixels, times, count,
            )  # fmt: skip
        level[at], reference[at], free_us[at] = v, ref, free
    return taken.size, count
