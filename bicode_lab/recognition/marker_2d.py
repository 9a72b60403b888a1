"""Find 2D markers and their poses in a frame of delta_t_2D (Fig. 2, box c).

OpenCV's ArUco detector with default parameters is given the frame as an image (II-B, III-B). The glowing cells of the
plate make the events. On a "black" plate these are the black cells of the pattern, so events are drawn dark on light;
on a "white" plate they are drawn light on dark.

Pixel centres are at whole numbers, as in OpenCV: x = 0 is the middle of the left column.
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

MARGIN_CELLS = 1  # width of the glowing margin around the pattern of a "white" plate, see `marker.board`
COUNT_QUANTILE = 0.9  # this quantile of the counts, over the pixels with events, is drawn at full contrast
BACK_TO_FRONT = np.diag([1.0, -1.0, -1.0])  # half a turn about x
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # about z
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Marker2d:
    """A 2D marker that was recognised in a frame.

    Parameters
    ----------
    id : int
        Number in the ArUco dictionary.
    corners : tuple of 4 pairs
        Corners x, y of the pattern, clockwise from its own top left corner [px].
    rvec : tuple of 3 floats
        Rotation vector from marker axes to camera axes [rad]; camera axes are x right, y down, z forward.
    tvec : tuple of 3 floats
        Centre of the pattern in camera axes [m].
    """

    id: int
    corners: tuple[tuple[float, float], ...]
    rvec: Vector
    tvec: Vector

    def box(self, glow: Glow = "black", n_cells: int = 6) -> Box:
        """Return the box of everything that glows on the plate.

        Parameters
        ----------
        glow : {"black", "white"}
            Which cells of the plate are engraved, see `marker.board`.
        n_cells : int
            Number of cells along a side of the pattern, frame included.

        Returns
        -------
        Box
            In the frame, or partly outside it [px].
        """
        corners = np.array(self.corners)
        if glow == "white":  # the margin outside the pattern glows as well
            corners = corners.mean(axis=0) + (corners - corners.mean(axis=0)) * (1 + 2 * MARGIN_CELLS / n_cells)
        x0, y0 = np.floor(corners.min(axis=0)).astype(int)
        x1, y1 = np.ceil(corners.max(axis=0)).astype(int)
        return Box(int(x0), int(y0), int(x1 - x0 + 1), int(y1 - y0 + 1))


def frame_2d(events: Events | CodedEvents, settings: ReceiverSettings) -> npt.NDArray[np.int8] | npt.NDArray[np.int32]:
    """Accumulate the events of delta_t_2D by the rule `frame_rule_2d` of the settings.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
        The events of delta_t_2D.
    settings : ReceiverSettings

    Returns
    -------
    ndarray, shape (height, width)
        int8 with values -1, 0, +1; for the rule "count" int32 with the number of events of each pixel.
    """
    if settings.frame_rule_2d == "count":
        return count_events(events, settings.width, settings.height)
    return accumulate(events, settings.width, settings.height, settings.frame_rule_2d)


def to_image(frame: npt.NDArray[np.int8] | npt.NDArray[np.int32], settings: ReceiverSettings) -> npt.NDArray[np.uint8]:
    """Turn a frame into the image that is given to ArUco.

    A 3-valued frame gives two tones, one for 0 and one for everything else. Counts are scaled so that their 90 %
    quantile over the pixels with events has full contrast.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        See `frame_2d`.
    settings : ReceiverSettings

    Returns
    -------
    ndarray of uint8, shape (height, width)
        Tones 0 (black) .. 255 (white).

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
    """Find the 2D markers in a frame, with their poses.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        See `frame_2d`.
    settings : ReceiverSettings

    Returns
    -------
    list of Marker2d
        Those whose pose can be computed.
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
    """Compute the pose of a pattern from its corners.

    Parameters
    ----------
    corners : array_like, shape (4, 2)
        Corners x, y, clockwise from the pattern's own top left corner [px].
    settings : ReceiverSettings
        Focal length, principal point and size of the pattern.

    Returns
    -------
    (rvec, tvec) or None
        Rotation vector [rad] and position [m] in camera axes, see `Marker2d`; None if there is no pose.

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
    # OpenCV's IPPE fails on rotations by half a turn, which is the rotation of a marker that faces the camera. So the
    # pattern is solved as seen from behind, beginning with the corner nearest to the top left of the image, and the
    # rotation is corrected afterwards.
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
    """Return a detector with default parameters; it is kept for the next call.

    Parameters
    ----------
    dictionary : str
        Name of one of OpenCV's predefined ArUco dictionaries.

    Returns
    -------
    cv2.aruco.ArucoDetector
    """
    return cv2.aruco.ArucoDetector(aruco_dictionary(dictionary), cv2.aruco.DetectorParameters())


def _without_lone_pixels(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Remove the light pixels that have no light neighbour."""
    neighbours = cv2.dilate(image, np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8))
    return np.where(neighbours > 0, image, 0).astype(np.uint8)
