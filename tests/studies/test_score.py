"""Scores of sightings that are made up around a known truth: what is right, and at which bound it turns wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from bicode_lab import paper
from bicode_lab.camera import MarkerTruth, Pose
from bicode_lab.camera.motion import turn_about
from bicode_lab.recognition import Sighting
from bicode_studies.score import Periods, score

CORNERS_PX = np.array([[100.0, 100], [130, 100], [130, 130], [100, 130]])
TRUTH = MarkerTruth(
    payload=37,
    aruco_id=17,
    corners_px=CORNERS_PX,
    box_px=(95.0, 95.0, 40.0, 40.0),
    pose=Pose.facing(2.5, yaw_deg=20, roll_deg=35),
    in_view=True,
)
TWO = Periods(start_us=0, count=2)
MIDDLE_PX = 115


def turned(angle_deg: float) -> tuple[float, ...]:
    """Return the rotation vector of the true pose, turned about the marker's normal."""
    rotation = TRUTH.pose.rotation @ turn_about("z", angle_deg)
    return tuple(float(each) for each in cv2.Rodrigues(rotation)[0].ravel())


def at_marker(**changes: Any) -> Sighting:
    """Return a sighting of the marker in the first period that is right in all respects."""
    values: dict[str, Any] = {
        "t_us": 0, "track": 0, "x": MIDDLE_PX - 10, "y": MIDDLE_PX - 10, "w": 21, "h": 21, "id": 37, "marker_2d_id": 17,
        "corners": CORNERS_PX, "rvec": turned(0), "tvec": TRUTH.pose.position_m,
    }  # fmt: skip
    return Sighting(**{**values, **changes})


def first_row(*sightings: Sighting, truth: MarkerTruth = TRUTH) -> dict[str, Any]:
    """Return the row of the first period."""
    return dict(score(sightings, lambda _: [truth], TWO).iloc[0])


def test_a_right_sighting_is_right_in_its_period_only() -> None:
    table = score([at_marker(), at_marker(t_us=5 * TWO.length_us)], lambda _: [TRUTH], TWO)
    assert table[["period", "marker", "payload"]].to_numpy().tolist() == [[0, 0, 37], [1, 0, 37]]
    assert table["id_right"].tolist() == [True, False]
    assert table["marker_2d_right"].tolist() == [True, False]
    assert table["ids"].tolist() == [(37,), ()]
    assert table["corner_px"].tolist() == pytest.approx([0, np.nan], nan_ok=True)
    # OpenCV's rotation vector keeps 16 digits, and near 0 the arc cosine keeps half of them
    assert table["axis_deg"].tolist() == pytest.approx([0, np.nan], abs=3e-6, nan_ok=True)


def test_a_sighting_belongs_to_the_period_that_it_starts_with() -> None:
    many = Periods(start_us=1000, count=12)
    for k in (0, 10, 11):
        table = score([at_marker(t_us=1000 + k * 33_000)], lambda _: [TRUTH], many)
        assert table.index[table["id_right"]].tolist() == [k]


def test_the_default_period_is_the_paper_s() -> None:
    assert (TWO.length_us, TWO.frame_2d_us) == (paper.DELTA_T_WHOLE_US, paper.DELTA_T_2D_US)


def test_the_id_is_held_to_the_middle_of_the_period_and_the_2d_marker_to_that_of_its_frame() -> None:
    asked: list[float] = []

    def truth(t_us: float) -> list[MarkerTruth]:
        asked.append(t_us)
        return [TRUTH]

    score([], truth, Periods(start_us=100, count=2, length_us=1000, frame_2d_us=400))
    assert asked == [600, 300, 1600, 1300]


@pytest.mark.parametrize(
    ("sightings", "ids"),
    [
        ([at_marker(id=38)], (38,)),
        ([at_marker(), at_marker(id=38)], (37, 38)),
        ([at_marker(id=None)], ()),
        ([at_marker(), at_marker(id=None, reason="conflict")], (37,)),
        ([], ()),
    ],
)
def test_another_id_a_conflict_or_none_is_wrong(sightings: list[Sighting], ids: tuple[int, ...]) -> None:
    row = first_row(*sightings)
    assert not row["id_right"]
    assert row["ids"] == ids


def test_the_same_id_from_two_tracks_is_right() -> None:
    assert first_row(at_marker(), at_marker(track=1), at_marker(track=2, id=None, reason="no_start"))["id_right"]


@pytest.mark.parametrize(("dx", "dy"), [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_sighting_counts_where_its_middle_lies_in_the_widened_box(dx: int, dy: int) -> None:
    inside, outside = 24, 25  # half of the box, 20 px, and 4 px around it
    assert first_row(at_marker(x=MIDDLE_PX - 10 + dx * inside, y=MIDDLE_PX - 10 + dy * inside))["id_right"]
    assert not first_row(at_marker(x=MIDDLE_PX - 10 + dx * outside, y=MIDDLE_PX - 10 + dy * outside))["id_right"]


def shifted(by_px: float) -> npt.NDArray[np.float64]:
    """Return the true corners, all moved by so many pixels."""
    return CORNERS_PX + by_px * np.array([0.6, 0.8])


@pytest.mark.parametrize(("side_px", "bound_px"), [(30.0, 2.0), (100.0, 5.0)])
def test_corners_may_be_off_by_two_pixels_or_a_twentieth_of_the_side(side_px: float, bound_px: float) -> None:
    scale = side_px / 30
    truth = replace(TRUTH, corners_px=CORNERS_PX[0] + scale * (CORNERS_PX - CORNERS_PX[0]))
    for off_px, is_right in ((bound_px - 0.01, True), (bound_px + 0.01, False)):
        row = first_row(at_marker(corners=truth.corners_px + off_px * np.array([0.6, 0.8])), truth=truth)
        assert row["corner_px"] == pytest.approx(off_px)
        assert row["marker_2d_right"] == is_right
        assert row["id_right"]


def test_the_corner_error_is_the_root_mean_square_over_the_four() -> None:
    one_off = CORNERS_PX + np.array([[3.0, 0], [0, 0], [0, 0], [0, 0]])
    assert first_row(at_marker(corners=one_off))["corner_px"] == pytest.approx(1.5)


def test_axes_may_be_off_by_thirty_degrees() -> None:
    for angle_deg, is_right in ((29.9, True), (30.1, False), (180.0, False)):
        row = first_row(at_marker(rvec=turned(angle_deg)))
        assert row["axis_deg"] == pytest.approx(angle_deg, abs=1e-5)
        assert row["marker_2d_right"] == is_right


def test_the_rotation_is_opencv_s() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        rvec = rng.normal(size=3)
        between = cv2.Rodrigues(rvec)[0].T @ TRUTH.pose.rotation
        expected = np.rad2deg(np.arccos(np.clip(np.diag(between), -1, 1))).max()
        assert first_row(at_marker(rvec=tuple(rvec)))["axis_deg"] == pytest.approx(expected, abs=1e-9)


def test_the_position_error_is_a_distance() -> None:
    row = first_row(at_marker(tvec=TRUTH.pose.position_m + [0.03, 0, 0.04]))
    assert row["tvec_m"] == pytest.approx(0.05)


def test_of_several_2d_markers_the_nearest_with_the_right_number_counts() -> None:
    other = at_marker(marker_2d_id=18)
    assert not first_row(other)["marker_2d_right"]
    assert np.isnan(first_row(other)["corner_px"])
    row = first_row(at_marker(corners=shifted(9)), other, at_marker(corners=shifted(1)))
    assert row["corner_px"] == pytest.approx(1)


def test_a_marker_out_of_view_has_no_row_and_each_marker_in_view_has_its_own() -> None:
    gone = replace(TRUTH, in_view=False)
    beside = replace(TRUTH, payload=99, box_px=(495.0, 95.0, 40.0, 40.0))
    table = score([at_marker()], lambda _: [gone, TRUTH, beside], replace(TWO, count=1))
    assert table[["marker", "payload", "id_right"]].to_numpy().tolist() == [[1, 37, True], [2, 99, False]]
    assert len(score([at_marker()], lambda _: [gone], TWO)) == 0
