"""The columns of the pose are those of the scene, and a quaternion never flips its sign."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bicode_lab.camera import Pose
from bicode_lab.recognition import Sighting
from bicode_studies.cli.helpers.pose_columns import COLUMNS, PoseColumns


def sighting(rotation: np.ndarray, track: int = 1, flip: bool = False) -> Sighting:
    """Return a sighting with a rotation, given as the other of its two rotation vectors if `flip`."""
    rvec = Rotation.from_matrix(rotation).as_rotvec()
    if flip:
        rvec = rvec * (1 - 2 * np.pi / np.linalg.norm(rvec))
    r = tuple(rvec.tolist())
    return Sighting(t_us=0, track=track, x=0, y=0, w=1, h=1, rvec=r, tvec=(0.25, -0.5, 3.0))  # type: ignore[arg-type]


@given(st.floats(-85, 85), st.floats(-179, 179))
def test_yaw_and_roll_are_those_of_the_pose_that_was_made(yaw_deg: float, roll_deg: float) -> None:
    got = PoseColumns()(sighting(Pose.facing(3.0, yaw_deg=yaw_deg, roll_deg=roll_deg).rotation))
    assert tuple(got) == COLUMNS
    assert got["yaw_deg"] == pytest.approx(yaw_deg, abs=1e-6)
    assert got["roll_deg"] == pytest.approx(roll_deg, abs=1e-6)
    assert got["pitch_deg"] == pytest.approx(0, abs=1e-6)
    assert (got["x_m"], got["y_m"], got["z_m"]) == (0.25, -0.5, 3.0)


def test_pitch_tilts_about_the_horizontal_axis() -> None:
    tilt = np.diag([1.0, -1.0, -1.0]) @ Rotation.from_euler("x", 20, degrees=True).as_matrix()
    got = PoseColumns()(sighting(tilt))
    assert [round(got[name] or 0, 6) for name in ("roll_deg", "pitch_deg", "yaw_deg")] == [0, 20, 0]


def test_the_quaternion_is_that_rotation_and_keeps_its_sign() -> None:
    columns, before = PoseColumns(), None
    for k in range(80):
        rotation = Pose.facing(3.0, yaw_deg=25.0, roll_deg=9.0 * k).rotation
        got = columns(sighting(rotation, flip=bool(k % 2)))
        q = np.array([got[name] for name in ("qx", "qy", "qz", "qw")])
        assert Rotation.from_quat(q).as_matrix() == pytest.approx(rotation, abs=1e-9)
        if before is not None:
            assert q @ before > 0.9
        before = q


def test_each_track_has_its_own_sign() -> None:
    columns = PoseColumns()
    first = columns(sighting(Pose.facing(3.0).rotation, track=1))
    for roll in range(0, 361, 30):
        columns(sighting(Pose.facing(3.0, roll_deg=roll).rotation, track=2))
    assert columns(sighting(Pose.facing(3.0).rotation, track=1)) == first


def test_without_a_pose_the_columns_are_empty() -> None:
    assert PoseColumns()(Sighting(t_us=0, track=1, x=0, y=0, w=1, h=1)) == dict.fromkeys(COLUMNS)
