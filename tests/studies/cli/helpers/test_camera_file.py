"""Calibrations as OpenCV, ROS and Kalibr write them are read, and distortion is taken out of the pose."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bicode_lab.marker.board import square_corners_m
from bicode_lab.recognition import ReceiverSettings, Sighting
from bicode_studies.cli.helpers.camera_file import Camera, read_camera

MATRIX = np.array([[1700.0, 0, 630.5], [0, 1690.0, 371.25], [0, 0, 1]])
BENT = [-0.3, 0.12, 0.001, -0.002, 0.05]
ROS = """image_width: 1280
image_height: 720
camera_name: events
camera_matrix:
  rows: 3
  cols: 3
  data: [1700.0, 0, 630.5, 0, 1690.0, 371.25, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.3, 0.12, 0.001, -0.002, 0.05]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [9, 0, 9, 0, 0, 9, 9, 0, 0, 0, 1, 0]
"""
MESSAGE = """header:
  frame_id: events
height: 720
width: 1280
distortion_model: plumb_bob
D: [-0.3, 0.12, 0.001, -0.002, 0.05]
K: [1700.0, 0.0, 630.5, 0.0, 1690.0, 371.25, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [9.0, 0.0, 9.0, 0.0, 0.0, 9.0, 9.0, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""
KALIBR = """cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.3, 0.12, 0.001, -0.002, 0.05]
  distortion_model: radtan
  intrinsics: [1700.0, 1690.0, 630.5, 371.25]
  resolution: [1280, 720]
cam1:
  intrinsics: [1.0, 2.0, 3.0, 4.0]
  resolution: [346, 260]
"""
WHOLE = Camera(focal_px=(1700, 1690), centre_px=(630.5, 371.25), distortion=tuple(BENT), size_px=(1280, 720))


def written_by_opencv(file: Path, names: tuple[str, str]) -> None:
    """Have OpenCV write a calibration."""
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 1280)
    storage.write("image_height", 720)
    storage.write(names[0], MATRIX)
    storage.write(names[1], np.array(BENT))
    storage.release()


@pytest.mark.parametrize(
    "names",
    [("camera_matrix", "distortion_coefficients"), ("cameraMatrix", "distCoeffs"), ("K", "D")],
)
@pytest.mark.parametrize("ending", ["yml", "yaml"])
def test_what_opencv_writes_is_read(tmp_path: Path, names: tuple[str, str], ending: str) -> None:
    file = tmp_path / f"camera.{ending}"
    written_by_opencv(file, names)
    assert read_camera(file) == WHOLE


@pytest.mark.parametrize("text", [ROS, MESSAGE, MESSAGE.replace("K:", "k:").replace("D:", "d:"), KALIBR])
def test_ros_and_kalibr_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "c.yaml").write_text("\ufeff" + text, encoding="utf-8")
    assert read_camera(tmp_path / "c.yaml") == WHOLE


def test_a_fisheye_is_one(tmp_path: Path) -> None:
    text = KALIBR.replace("radtan", "equidistant").replace(", 0.05]", "]")
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    camera = read_camera(tmp_path / "c.yaml")
    assert camera.fisheye
    assert len(camera.distortion) == 4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [1, 2", "is no YAML"),
        ("just words", "names no camera matrix"),
        ("", "names no camera matrix"),
        ("K: [1, 2, 3]", "the camera matrix has 3 numbers; it is to have 9"),
        ("K: [0, 0, 1, 0, 1, 1, 0, 0, 1]", "are not a camera's"),
        ("K: [.nan, 0, 1, 0, 1, 1, 0, 0, 1]", "are not a camera's"),
        ("K: [a, 0, 1, 0, 1, 1, 0, 0, 1]", "could not convert"),
        ("K: [1, 0, 1, 0, 1, 1, 0, 0, 1]\nD: [1, 2, 3]", "the distortion has 3 numbers"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=said):
        read_camera(tmp_path / "c.yaml")


def test_a_file_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="No such file"):
        read_camera(tmp_path / "none.yaml")
    (tmp_path / "c.yaml").write_bytes(b"\x80\x81\xff")
    with pytest.raises(ValueError, match="is no text"):
        read_camera(tmp_path / "c.yaml")


@pytest.mark.parametrize("fisheye", [False, True])
def test_the_pose_behind_a_lens_that_bends_is_right(fisheye: bool) -> None:
    """Corners that OpenCV projects with distortion give back the place that they were projected from."""
    settings = ReceiverSettings(focal_px=1695, cx=630.5, cy=371.25)
    coefficients = np.array([0.05, -0.02, 0.01, 0.0] if fisheye else BENT)
    camera = Camera(
        focal_px=(1700, 1690), centre_px=(630.5, 371.25), distortion=tuple(coefficients.tolist()), fisheye=fisheye
    )
    rvec, tvec = np.array([3.0, 0.3, 0.2]), np.array([0.2, 0.1, 0.7])
    points: Any = square_corners_m(settings.pattern_size_m)
    if fisheye:
        seen, _ = cv2.fisheye.projectPoints(points[:, None], rvec, tvec, MATRIX, coefficients)
    else:
        seen, _ = cv2.projectPoints(points, rvec, tvec, MATRIX, coefficients)
    corners = tuple((float(x), float(y)) for x, y in seen.reshape(4, 2))
    raw = Sighting(t_us=0, track=1, x=0, y=0, w=1, h=1, corners=corners, rvec=(1, 2, 3), tvec=(9, 9, 9))
    got = camera.corrected(raw, settings)
    assert got.tvec == pytest.approx(tvec.tolist(), abs=2e-4)
    assert cv2.Rodrigues(np.array(got.rvec))[0] == pytest.approx(cv2.Rodrigues(rvec)[0], abs=2e-3)


def test_a_plain_camera_changes_nothing() -> None:
    raw = Sighting(t_us=0, track=1, x=0, y=0, w=1, h=1, corners=((0, 0),) * 4, rvec=(1, 2, 3), tvec=(9, 9, 9))
    plain = Camera(focal_px=(1700, 1700), centre_px=(1, 2), distortion=(0.0,) * 5)
    assert plain.corrected(raw, ReceiverSettings()) is raw
    none = Sighting(t_us=0, track=1, x=0, y=0, w=1, h=1)
    assert WHOLE.corrected(none, ReceiverSettings()) is none
