"""The ruler of poses, the cases, and the saved tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from bicode_lab.camera import Scene, truth_at
from bicode_lab.pose import PlatePose, PoseSettings
from bicode_studies.pose_accuracy.__main__ import write_tables
from bicode_studies.pose_accuracy.cases import CASES, scene_of
from bicode_studies.pose_accuracy.ruler import STRICT_DEG, STRICT_PX, pose_errors
from bicode_studies.pose_accuracy.table import accuracy_rows, summary
from bicode_studies.repository import results_folder

CORNERS_M = Scene().markers[0].marker.board.pattern_corners_m()
CAMERA = PoseSettings().camera


def off_by(turn_deg: tuple[float, float, float], shift_m: tuple[float, float, float]) -> PlatePose:
    """Return the pose of the default scene, turned about its own axes and shifted."""
    true = truth_at(Scene(), 0)[0].pose
    turn = Rotation.from_rotvec(np.radians(turn_deg)).as_matrix()
    return PlatePose(
        rotation=true.rotation @ turn, position_m=true.position_m + shift_m, covariance=np.eye(6) * 0.01**2,
        probability=1.0, aruco_id=7,
    )  # fmt: skip


def test_the_ruler_measures_what_was_changed() -> None:
    truth = truth_at(Scene(), 0)[0]
    none = pose_errors(off_by((0, 0, 0), (0, 0, 0)), truth, CORNERS_M, CAMERA)
    assert max(none.rotation_deg, none.lateral_mm, none.corner_px, none.distance, abs(none.depth_percent)) < 0.01
    roll = pose_errors(off_by((0, 0, 3), (0, 0, 0)), truth, CORNERS_M, CAMERA)
    assert (roll.rotation_deg, roll.roll_deg) == pytest.approx((3, -3))
    assert roll.distance == pytest.approx((np.radians(3) / 0.01) ** 2)
    tilt = pose_errors(off_by((4, 0, 0), (0, 0, 0)), truth, CORNERS_M, CAMERA)
    assert (tilt.rotation_deg, tilt.roll_deg) == pytest.approx((4, 0), abs=1e-6)
    far = pose_errors(off_by((0, 0, 0), (0, 0, 0.025)), truth, CORNERS_M, CAMERA)
    assert (far.depth_percent, far.lateral_mm) == pytest.approx((1, 0))
    aside = pose_errors(off_by((0, 0, 0), (0.003, -0.004, 0)), truth, CORNERS_M, CAMERA)
    assert aside.lateral_mm == pytest.approx(5)
    assert aside.corner_px == pytest.approx(0.005 * CAMERA[0] / 2.5, rel=1e-3)


def test_right_needs_rotation_and_corners() -> None:
    truth = truth_at(Scene(), 0)[0]
    assert pose_errors(off_by((STRICT_DEG - 0.1, 0, 0), (0, 0, 0)), truth, CORNERS_M, CAMERA).is_right
    assert not pose_errors(off_by((STRICT_DEG + 0.1, 0, 0), (0, 0, 0)), truth, CORNERS_M, CAMERA).is_right
    px_m = 2.5 / CAMERA[0]
    assert pose_errors(off_by((0, 0, 0), ((STRICT_PX - 0.05) * px_m, 0, 0)), truth, CORNERS_M, CAMERA).is_right
    assert not pose_errors(off_by((0, 0, 0), ((STRICT_PX + 0.05) * px_m, 0, 0)), truth, CORNERS_M, CAMERA).is_right


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_scenes_are_those_of_their_case(case) -> None:  # type: ignore[no-untyped-def]
    tilts, rolls = [], []
    for seed in range(12):
        truth = truth_at(scene_of(case, seed), 0)[0]
        assert truth.in_view
        sight = truth.pose.position_m / np.linalg.norm(truth.pose.position_m)
        tilts.append(np.degrees(np.arccos(np.clip(-truth.pose.rotation[:, 2] @ sight, -1, 1))))
        rolls.append(np.degrees(np.arctan2(truth.pose.rotation[1, 0], truth.pose.rotation[0, 0])))
        assert truth.pose.position_m[2] == pytest.approx(case.distance_m, rel=0.031)
    assert case.tilt_deg[0] - 0.01 <= min(tilts)
    assert max(tilts) <= case.tilt_deg[1] + 0.01
    assert np.ptp(rolls) > 90


def test_the_saved_tables_are_what_the_code_writes(tmp_path: Path) -> None:
    saved = pd.read_csv(results_folder() / "pose_accuracy.csv")
    assert set(saved["case"]) == {case.name for case in CASES}
    assert saved.groupby("case").size().min() >= 40
    again = accuracy_rows(CASES[:4], [0])
    again.to_csv(tmp_path / "again.csv", index=False)
    expected = saved[(saved["seed"] == 0) & saved["case"].isin([case.name for case in CASES[:4]])].reset_index(
        drop=True
    )
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "again.csv"), expected, rtol=0.02, atol=0.02)
    lines = summary(saved)
    pd.testing.assert_frame_equal(lines, pd.read_csv(results_folder() / "pose_accuracy_summary.csv"), atol=1e-4)


def test_what_the_saved_tables_show() -> None:
    lines = summary(pd.read_csv(results_folder() / "pose_accuracy.csv")).set_index("case")
    tilted, facing = lines.loc["2.5 m, tilted"], lines.loc["2.5 m, facing"]
    assert tilted["rotation_deg_median"] <= 1
    assert tilted["depth_percent_median"] <= 0.5
    assert tilted["first"] == 1  # none is mirrored
    assert facing["rotation_deg_median"] <= 4
    assert lines.loc["5 m, tilted", "roll_deg_median"] <= 1
    assert lines.loc["5 m, tilted", "depth_percent_median"] <= 1
    assert lines["quarter"].min() >= 0.98
    assert (lines["sure_wrong"] / lines["looks"]).max() <= 0.05


def test_a_look_without_a_pose_is_counted() -> None:
    rows = pd.read_csv(results_folder() / "pose_accuracy.csv").iloc[:4].copy()
    rows = rows.astype({"reason": object, "right": object, "sure": object, "nearest_first": object})
    rows.loc[0, rows.columns[4:]] = np.nan
    rows.loc[0, "reason"] = "no_id"
    line = summary(rows).iloc[0]
    assert (line["looks"], line["found"]) == (4, 3)
    assert line["right"] == 0.75


def test_tables_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bicode_studies.pose_accuracy.__main__.CASES", CASES[:1])
    write_tables(1, tmp_path)
    assert len(pd.read_csv(tmp_path / "pose_accuracy.csv")) == 1
    assert pd.read_csv(tmp_path / "pose_accuracy_summary.csv")["case"].tolist() == ["2.5 m, tilted"]
