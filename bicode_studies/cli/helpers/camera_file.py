"""Read a camera's calibration: the YAML of OpenCV, camera_info of ROS, and camchain of Kalibr."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import yaml  # type: ignore[import-untyped]

from bicode_lab.recognition import ReceiverSettings, Sighting
from bicode_lab.recognition.marker_2d import find_pose

MATRIX = ("cameramatrix", "k", "cammatrix", "intrinsicmatrix", "intrinsics", "m1", "mtx")
DISTORTION = ("distortioncoefficients", "distcoeffs", "distortioncoeffs", "distortion", "d", "d1", "dist")
WIDTH, HEIGHT = ("imagewidth", "width"), ("imageheight", "height")
FISHEYE = ("equidistant", "fisheye", "kannalabrandt4")
LENGTHS = (4, 5, 8, 12, 14)  # of OpenCV's distortion; a fisheye has 4


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A calibrated camera.

    Parameters
    ----------
    focal_px, centre_px : (float, float)
        Focal length and principal point in x and y [px].
    distortion : tuple of float
        OpenCV's coefficients k1, k2, p1, p2, k3, ...; empty for none.
    fisheye : bool
        Whether they are those of OpenCV's fisheye model.
    size_px : (int, int) or None
        Sensor size that the calibration is for [px].
    """

    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...] = ()
    fisheye: bool = False
    size_px: tuple[int, int] | None = None

    @property
    def is_plain(self) -> bool:
        """Whether one focal length without distortion says all of it."""
        fx, fy = self.focal_px
        return not any(self.distortion) and abs(fx - fy) <= 1e-4 * fx

    def undistorted(self, corners: npt.ArrayLike, settings: ReceiverSettings) -> npt.NDArray[np.float64]:
        """Return where corners would be without distortion, with the focal length of the settings.

        Parameters
        ----------
        corners : array_like, shape (n, 2)
            Corners x, y [px].
        settings : ReceiverSettings

        Returns
        -------
        ndarray of float64, shape (n, 2)
            [px]
        """
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        seen = np.asarray(corners, np.float64).reshape(-1, 1, 2)
        given: Any = np.array(self.distortion or (0.0,) * 4)
        undistort: Any = cv2.fisheye.undistortPoints if self.fisheye else cv2.undistortPoints
        rays = undistort(seen, matrix, given).reshape(-1, 2)
        return np.asarray(rays * settings.focal_px + settings.principal_point_px, np.float64)

    def corrected(self, sighting: Sighting, settings: ReceiverSettings) -> Sighting:
        """Return a sighting whose pose allows for distortion and for two focal lengths.

        Parameters
        ----------
        sighting : Sighting
        settings : ReceiverSettings
            Those of the receiver.

        Returns
        -------
        Sighting
        """
        if self.is_plain or sighting.corners is None or sighting.rvec is None:
            return sighting
        pose = find_pose(self.undistorted(sighting.corners, settings), settings)
        return replace(sighting, rvec=pose[0], tvec=pose[1]) if pose else sighting


def read_camera(file: Path) -> Camera:
    """Read a camera's calibration.

    Parameters
    ----------
    file : Path
        YAML of OpenCV, camera_info of ROS (file or message), or camchain of Kalibr.

    Returns
    -------
    Camera

    Raises
    ------
    ValueError
        If the file cannot be read, or says nothing of a camera.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError(f"{file} is no text; give a camera's calibration in YAML") from None
    plain = re.sub(r"(?m)^%YAML.*$", "", text)
    plain = re.sub(r"!!opencv-[\w-]+|!<[^>]*>", "", plain)
    try:
        read = next(yaml.safe_load_all(plain), None)
    except yaml.YAMLError as error:
        raise ValueError(f"{file} is no YAML ({error}); give a camera's calibration in YAML") from None
    values: dict[str, Any] = {}
    for name, value in _flat(read):
        values.setdefault(name, value)  # of several cameras, the first
    matrix = _first(values, MATRIX)
    if matrix is None:
        raise ValueError(
            f"{file} names no camera matrix; give OpenCV's YAML (camera_matrix), ROS's camera_info, or focal length "
            "with --focal-px"
        )
    model = str(values.get("distortionmodel", "")).lower()
    try:
        focal, centre = _focal_and_centre(_numbers(matrix))
        return Camera(
            focal_px=focal,
            centre_px=centre,
            distortion=_distortion(_numbers(_first(values, DISTORTION)), model),
            fisheye=model in FISHEYE,
            size_px=_size(values),
        )
    except (TypeError, ValueError) as error:
        raise ValueError(f"{file}: {error}") from None


def _flat(tree: Any) -> Iterator[tuple[str, Any]]:
    """Yield every name, without case and underscores, and its value; of a table with data, the data."""
    if not isinstance(tree, dict):
        return
    for name, value in tree.items():
        inner = value.get("data") if isinstance(value, dict) else None
        yield re.sub(r"[^a-z0-9]", "", str(name).lower()), value if inner is None else inner
        if inner is None:
            yield from _flat(value)


def _first(values: dict[str, Any], names: tuple[str, ...]) -> Any:
    """Return the value of the first name that is there."""
    return next((values[name] for name in names if values.get(name) is not None), None)


def _numbers(value: Any) -> list[float]:
    """Return all numbers of a list, or of a list of lists."""
    if value is None:
        return []
    return [float(each) for each in np.ravel(np.array(value, dtype=float))]


def _focal_and_centre(numbers: list[float]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return focal lengths and principal point of a 3 x 3 matrix, or of the four numbers of Kalibr."""
    if len(numbers) == 4:
        fx, fy, cx, cy = numbers
    elif len(numbers) == 9:
        fx, fy, cx, cy = (numbers[place] for place in (0, 4, 2, 5))
    else:
        raise ValueError(f"the camera matrix has {len(numbers)} numbers; it is to have 9, row by row")
    if not (fx > 0 and fy > 0 and np.isfinite([fx, fy, cx, cy]).all()):
        raise ValueError(f"the focal lengths {fx:g} and {fy:g} px are not a camera's; they are to be above 0")
    return (fx, fy), (cx, cy)


def _distortion(numbers: list[float], model: str) -> tuple[float, ...]:
    """Return the coefficients of the distortion, after checking that OpenCV knows so many."""
    fits = (4,) if model in FISHEYE else LENGTHS
    if numbers and len(numbers) not in fits:
        raise ValueError(f"the distortion has {len(numbers)} numbers; OpenCV knows {', '.join(map(str, fits))}")
    return tuple(numbers)


def _size(values: dict[str, Any]) -> tuple[int, int] | None:
    """Return the sensor size, if the file states it."""
    if isinstance(values.get("resolution"), list) and len(values["resolution"]) == 2:
        width, height = values["resolution"]
    else:
        width, height = _first(values, WIDTH), _first(values, HEIGHT)
    return (int(width), int(height)) if width and height else None
