"""A textured wall behind the markers, which makes events when the camera moves (see `wall_pixels`).

The image of the wall moves in steps of a quarter pixel, however long a step takes, so a slow pan costs no more than a
fast one over the same distance. A pixel is only followed through a span of time where the texture along its path
differs enough from the level at which the pixel was last reset.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt
import skimage.data
import skimage.util
from scipy import ndimage

from bicode_lab.boxes import Box
from bicode_lab.camera.motion import Floats, Pose
from bicode_lab.camera.optics import Optics, plate_homography
from bicode_lab.camera.pixel_steps import F4
from bicode_lab.camera.wall_pixels import NEAREST_HORIZON, look_up

MIN_POINTS = 8  # smallest side of a wall's image
SMOOTHING_POINTS = 1.0  # standard deviation of the smoothing of a bundled picture
MAX_SHIFT_POINTS = 16  # with longer paths, in points of the wall, no pixel is skipped


@dataclass(frozen=True, eq=False, kw_only=True)
class Wall:
    """A textured plane across the world's z axis, repeated without end.

    Parameters
    ----------
    log_image : ndarray of float32, shape (rows, columns)
        Logarithm of the reflectance relative to the office's mean, at least 8 x 8.
    distance_m : float
        Distance from the origin of the world [m].
    texel_m : float
        Side of one point of the image on the wall [m].

    Attributes
    ----------
    repeated : ndarray of float32, shape (rows + 2, columns + 2)
        The image, followed by its first two rows and columns, for interpolation across the seams.

    Raises
    ------
    ValueError
        If the image or a size is impossible.
    """

    log_image: F4
    distance_m: float = 5.0
    texel_m: float = 0.003
    repeated: F4 = field(init=False, repr=False)
    _extremes: dict[tuple[int, int], tuple[F4, F4]] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.log_image.ndim != 2 or not np.isfinite(self.log_image).all():
            raise ValueError("log_image is not a two-dimensional array of finite numbers")
        if self.distance_m <= 0 or self.texel_m <= 0:
            raise ValueError(f"distance_m={self.distance_m}, texel_m={self.texel_m}: choose more than 0 m each")
        if min(self.log_image.shape) < MIN_POINTS:
            raise ValueError(f"log_image is {self.log_image.shape}; choose at least {MIN_POINTS} x {MIN_POINTS}")
        image = np.ascontiguousarray(self.log_image, np.float32)
        object.__setattr__(self, "log_image", image)
        object.__setattr__(self, "repeated", _repeated(image))

    def extremes(self, views: Floats, optics: Optics) -> tuple[F4, F4]:
        """Return the extremes of the image around each point, as far as the paths of pixels lead in a span.

        Parameters
        ----------
        views : ndarray, shape (steps, 3, 3)
            Homographies from pixels to points of the wall during the span.
        optics : Optics

        Returns
        -------
        lowest, highest : ndarray of float32, shape (rows + 2, columns + 2)
            Paths count from the middle of the span. Infinite where the paths are longer than `MAX_SHIFT_POINTS` or the
            horizon is in view.
        """
        corners = np.array([[x, y, 1.0] for x in (0, optics.width - 1) for y in (0, optics.height - 1)])
        points = np.einsum("kij,cj->kci", views, corners)
        way = np.full(2, np.inf)
        if (points[..., 2] >= NEAREST_HORIZON).all():
            places = points[..., :2] / points[..., 2:]
            way = np.abs(places - places[len(views) // 2]).max((0, 1))
        if way.max() > MAX_SHIFT_POINTS:  # or the horizon is in view
            return np.full_like(self.repeated, -np.inf), np.full_like(self.repeated, np.inf)
        # A point is interpolated with the next one, and a path inside the image may be longer than at its corners.
        columns, rows = (2 * int(np.ceil(1.1 * w + 1)) + 1 for w in way)
        if (rows, columns) not in self._extremes:
            around, wide = np.ones((rows, columns), np.uint8), [(rows // 2, rows // 2), (columns // 2, columns // 2)]
            image, inner = np.pad(self.log_image, wide, mode="wrap"), tuple(slice(n, -n) for n, _ in wide)
            found = cv2.erode(image, around), cv2.dilate(image, around)
            self._extremes[rows, columns] = _repeated(found[0][inner]), _repeated(found[1][inner])
        return self._extremes[rows, columns]

    def from_pixels(self, camera: Pose, optics: Optics) -> Floats:
        """Return the homography from pixels to points of the wall.

        Parameters
        ----------
        camera : Pose
            In world axes.
        optics : Optics

        Returns
        -------
        ndarray, shape (3, 3)
        """
        wall = Pose(position_m=np.array([0.0, 0.0, self.distance_m])).after(camera.inverse())
        to_pixels = plate_homography(wall, optics) @ np.diag([self.texel_m, self.texel_m, 1.0])
        # The world's z axis meets the image neither in its middle nor on a seam where it repeats.
        middle = np.array([[1, 0, self.log_image.shape[1] / 3], [0, 1, self.log_image.shape[0] / 3], [0, 0, 1.0]])
        return np.asarray(middle @ np.linalg.inv(to_pixels))

    def log_reflectance(self, from_pixels: Floats, box: Box) -> F4:
        """Return the log reflectance that the pixels of a box see.

        Parameters
        ----------
        from_pixels : ndarray, shape (3, 3)
            Homography from pixels to points of the wall, see `from_pixels`.
        box : Box

        Returns
        -------
        ndarray of float32, shape (box.h, box.w)
            Relative to the mean of the office; 0 where a pixel does not see the wall.
        """
        y, x = np.mgrid[box.y : box.bottom, box.x : box.right].astype(np.float64).reshape(2, -1)
        return look_up(self.repeated, from_pixels, 0.0, x, y).reshape(box.h, box.w)


def _repeated(image: npt.NDArray[np.generic]) -> F4:
    """Return an image followed by its first two rows and columns."""
    return np.pad(image.astype(np.float32, copy=False), [(0, 2), (0, 2)], mode="wrap")


def textured_wall(
    name: str = "camera",
    *,
    contrast: float = 0.3,
    distance_m: float = 5.0,
    texel_m: float = 0.003,
) -> Wall:
    """Make a wall from one of scikit-image's bundled pictures.

    Parameters
    ----------
    name : str
        For example "camera" (few edges, much sky), "coins", "brick", "gravel" (edges everywhere).
    contrast : float
        Standard deviation of the log reflectance, 0 or more.
    distance_m, texel_m : float
        See `Wall`; at 3 mm and 5 m a point of the picture covers about one pixel of the paper's camera.

    Returns
    -------
    Wall

    Raises
    ------
    ValueError
        If the picture is not bundled or the contrast is negative.
    """
    bundled = ("gravel", "brick", "grass", "camera", "coins", "moon", "page", "text")
    if name not in bundled:
        raise ValueError(f"name={name!r} is not a bundled picture; choose one of {', '.join(bundled)}")
    if contrast < 0:
        raise ValueError(f"contrast={contrast} is negative; choose 0 or more")
    grey = skimage.util.img_as_float64(getattr(skimage.data, name)())
    # A picture and its mirror images side by side repeat without a seam.
    grey = np.pad(grey, [(0, n) for n in grey.shape], mode="symmetric")
    log = ndimage.gaussian_filter(np.log(grey + 0.1), SMOOTHING_POINTS, mode="wrap")
    log = (log - log.mean()) / max(float(log.std()), 1e-9) * contrast
    return Wall(log_image=log.astype(np.float32), distance_m=distance_m, texel_m=texel_m)
