"""Fig. 2 c: which 2D marker, and how does it stand?   frame of delta_t_2D -> id, corners, pose

ArUco with OpenCV's default parameters looks at the frame as at a picture (II-B, III-B). The
plate's glowing cells make the events. On a "black" plate those are the pattern's black cells,
so events are drawn dark on light; on a "white" plate light on dark.

Pixel centres are at whole numbers, here as in OpenCV: x = 0 is the middle of the left column.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.marker.board import Glow, aruco_dictionary, square_corners_m
from bicode_lab.recognition.accumulate import accumulate, count_events
from bicode_lab.recognition.event_codes import CodedEvents
from bicode_lab.recognition.settings import ReceiverSettings

MARGIN_CELLS = 1  # of glowing margin around the pattern of a "white" plate, see `marker.board`
COUNT_QUANTILE = 0.9  # of the pixels with events: their count is drawn at full contrast
BACK_TO_FRONT = np.diag([1.0, -1.0, -1.0])  # half a turn about x
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # about z
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Marker2d:
    """One recognised 2D marker.

    Parameters
    ----------
    id : int
        Number in the ArUco dictionary.
    corners : tuple of 4 pairs
        Corners x, y of the pattern, from its own top left clockwise [px].
    rvec : tuple of 3 floats
        Rotation vector, marker to camera [rad]; camera axes x right, y down, z forward.
    tvec : tuple of 3 floats
        The pattern's middle in camera axes [m].
    """

    id: int
    corners: tuple[tuple[float, float], ...]
    rvec: Vector
    tvec: Vector

    def box(self, glow: Glow = "black", n_cells: int = 6) -> Box:
        """The plate's engraving in; the box of all that glows out, x y w h [px]."""
        corners = np.array(self.corners)
        if glow == "white":  # the margin outside the pattern glows, too
            corners = corners.mean(axis=0) + (corners - corners.mean(axis=0)) * (1 + 2 * MARGIN_CELLS / n_cells)
        x0, y0 = np.floor(corners.min(axis=0)).astype(int)
        x1, y1 = np.ceil(corners.max(axis=0)).astype(int)
        return Box(int(x0), int(y0), int(x1 - x0 + 1), int(y1 - y0 + 1))


def frame_2d(events: Events | CodedEvents, settings: ReceiverSettings) -> npt.NDArray[np.int8] | npt.NDArray[np.int32]:
    """The events of delta_t_2D in, the frame by the setting's rule out, shape (height, width)."""
    if settings.frame_rule_2d == "count":
        return count_events(events, settings.width, settings.height)
    return accumulate(events, settings.width, settings.height, settings.frame_rule_2d)


def to_image(frame: npt.NDArray[np.int8] | npt.NDArray[np.int32], settings: ReceiverSettings) -> npt.NDArray[np.uint8]:
    """A frame in, the picture that ArUco is shown out, shape (height, width), 0 .. 255.

    A 3-valued frame has two tones: anything that is not 0, and the rest. A count is scaled so that
    its 90 % quantile over the pixels with events is full.

    Examples
    --------
    >>> to_image(np.array([[0, 1, -1]], np.int8), ReceiverSettings())
    array([[255,   0,   0]], dtype=uint8)
    """
    if frame.dtype == np.int8:
        image: npt.NDArray[np.uint8] = (frame != 0).view(np.uint8) * np.uint8(255)
    else:
        active = frame[frame > 0]
        full = max(float(np.quantile(active, COUNT_QUANTILE)), 1.0) if active.size else 1.0
        image = np.minimum(frame * (255 / full), 255).astype(np.uint8)
    if settings.denoise_2d:
        image = _without_lone_pixels(image)
    return np.invert(image, out=image) if settings.glow == "black" else image


def find_marker_2d(frame: npt.NDArray[np.int8] | npt.NDArray[np.int32], settings: ReceiverSettings) -> list[Marker2d]:
    """A frame in, shape (height, width), the 2D markers seen in it with their poses out.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        int8: 3-valued; int32: counts of events.
    settings : ReceiverSettings

    Returns
    -------
    list of Marker2d
    """
    corners, ids, _ = aruco_detector(settings.dictionary).detectMarkers(to_image(frame, settings))
    found = []
    for number, quad in zip(np.ravel(ids if len(corners) else []), corners, strict=True):
        pose = find_pose(quad.reshape(4, 2), settings)
        if pose is not None:
            pairs = tuple((float(x), float(y)) for x, y in quad.reshape(4, 2))
            found.append(Marker2d(int(number), pairs, *pose))
    return found


def find_pose(corners: npt.ArrayLike, settings: ReceiverSettings) -> tuple[Vector, Vector] | None:
    """Corners of a pattern in, shape (4, 2) [px]; rotation vector [rad] and translation [m] (or None) out.

    Examples
    --------
    >>> s = ReceiverSettings(width=1280, height=720, pattern_size_m=0.05)
    >>> half = 0.05 * s.focal_px / 1.0 / 2  # seen straight from 1 m
    >>> corners = [(639.5 + u * half, 359.5 + v * half) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    >>> rvec, tvec = find_pose(corners, s)
    >>> [round(abs(value), 3) for value in (*rvec, *tvec)]
    [3.142, 0.0, 0.0, 0.0, 0.0, 1.0]
    """
    cx, cy = settings.principal_point_px
    camera = np.array([[settings.focal_px, 0, cx], [0, settings.focal_px, cy], [0, 0, 1.0]])
    seen = np.asarray(corners, np.float64).reshape(4, 2)
    # OpenCV's IPPE loses rotations by half a turn, which is how a marker that looks at the camera is turned.
    # So the pattern is taken as its back, the corner nearest to the image's top left first, and turned back after.
    first = int(np.argmin(seen.sum(axis=1)))
    back = np.roll(seen, -first, axis=0)[::-1]
    found = np.ascontiguousarray(back).reshape(4, 1, 2)
    points = (square_corners_m(settings.pattern_size_m), found, camera, np.zeros(4))
    known, rvec, tvec = cv2.solvePnP(*points, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    if not np.isfinite([*rvec, *tvec]).all():  # IPPE divides by zero on a perfect square
        known, rvec, tvec = cv2.solvePnP(*points, flags=cv2.SOLVEPNP_ITERATIVE)
    if not known or not np.isfinite([*rvec, *tvec]).all():
        return None
    rotation = cv2.Rodrigues(rvec)[0] @ BACK_TO_FRONT @ np.linalg.matrix_power(QUARTER_TURN, first)
    r, t = np.ravel(cv2.Rodrigues(rotation)[0]).tolist(), np.ravel(tvec).tolist()
    return (r[0], r[1], r[2]), (t[0], t[1], t[2])


@lru_cache(maxsize=8)
def aruco_detector(dictionary: str) -> cv2.aruco.ArucoDetector:
    """The name of a dictionary in, a detector with default parameters out."""
    return cv2.aruco.ArucoDetector(aruco_dictionary(dictionary), cv2.aruco.DetectorParameters())


def _without_lone_pixels(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """A picture with events light in, the same without pixels that have no lit neighbour out."""
    neighbours = cv2.dilate(image, np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8))
    return np.where(neighbours > 0, image, 0).astype(np.uint8)
