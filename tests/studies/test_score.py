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
    many = Periods(start_us=20_000, count=12)
    for k in (0, 10, 11):
        table = score([at_marker(t_us=20_000 + k * 33_000)], lambda _: [TRUTH], many)
        assert table.index[table["id_right"]].tolist() == [k]


def test_an_axis_at_the_limit_is_right(monkeypatch: pytest.MonkeyPatch) -> None:
    row = first_row(at_marker(rvec=turned(12)))
    monkeypatch.setattr("bicode_studies.score.AXIS_DEG", row["axis_deg"])
    assert first_row(at_marker(rvec=turned(12)))["marker_2d_right"]
    monkeypatch.setattr("bicode_studies.score.AXIS_DEG", np.nextafter(row["axis_deg"], 0))
    assert not first_row(at_marker(rvec=turned(12)))["marker_2d_right"]


def test_an_axis_that_points_the_other_way_is_off_by_180_degrees_whatever_the_rounding() -> None:
    """Of a rotation by half a turn, the cosines of two axes are -1, and some round to a little less."""
    least = 0.0
    for yaw_deg in np.linspace(-60, 60, 61):
        truth = replace(TRUTH, pose=Pose.facing(2.5, yaw_deg=float(yaw_deg), roll_deg=35))
        upside_down = truth.pose.rotation @ turn_about("z", 180)
        seen = tuple(float(each) for each in cv2.Rodrigues(upside_down)[0].ravel())
        least = min(least, float(np.diag(cv2.Rodrigues(np.array(seen))[0].T @ truth.pose.rotation).min()))
        assert first_row(at_marker(rvec=seen), truth=truth)["axis_deg"] == pytest.approx(180, abs=1e-4)
    assert least < -1


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


def test_the_box_of_a_marker_or_of_a_sighting_need_not_be_square() -> None:
    """A box of 9 x 61 px has its middle 4 px right of its left side and 30 px below its upper one."""
    flat = replace(TRUTH, box_px=(95.0, 110.0, 40.0, 10.0))  # with 4 px around it 91 .. 139 and 106 .. 124
    for x, y, inside in ((91, 106, True), (139, 124, True), (90, 115, False), (140, 115, False), (115, 105, False),
                         (115, 125, False)):  # fmt: skip
        assert first_row(at_marker(x=x - 4, y=y - 30, w=9, h=61), truth=flat)["id_right"] == inside


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


# What follows is worked by hand. A judge that is too kind in one respect makes every accuracy of the package too high.


def yawed(angle_deg: float) -> MarkerTruth:
    """Return the truth of the marker, turned away by an angle to one side."""
    return replace(TRUTH, pose=Pose.facing(2.5, yaw_deg=angle_deg))


def pose_of(truth: MarkerTruth) -> dict[str, object]:
    """Return the pose of a marker as a sighting states it."""
    rvec = cv2.Rodrigues(truth.pose.rotation)[0].ravel()
    return {"rvec": tuple(float(each) for each in rvec), "tvec": truth.pose.position_m}


@pytest.mark.parametrize(("yaw_deg", "is_right"), [(40, False), (16, False), (14, True), (0, True)])
def test_a_mirrored_pose_with_the_corners_in_place_is_wrong(yaw_deg: float, is_right: bool) -> None:
    """Corners far away fit a marker turned to the left as well as to the right; the two are twice the yaw apart."""
    row = first_row(at_marker(**pose_of(yawed(-yaw_deg))), truth=yawed(yaw_deg))
    assert row["corner_px"] == 0
    assert row["axis_deg"] == pytest.approx(2 * yaw_deg, abs=1e-5)
    assert row["marker_2d_right"] == is_right
    assert row["id_right"]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize(("angle_deg", "is_right"), [(29, True), (31, False), (-31, False), (90, False)])
def test_a_turn_about_any_axis_is_wrong_beyond_thirty_degrees(axis: str, angle_deg: float, is_right: bool) -> None:
    rotation = TRUTH.pose.rotation @ turn_about(axis, angle_deg)  # type: ignore[arg-type]
    rvec = tuple(float(each) for each in cv2.Rodrigues(rotation)[0].ravel())
    assert first_row(at_marker(rvec=rvec))["marker_2d_right"] == is_right


@pytest.mark.parametrize(
    ("side_px", "off_px", "is_right"),
    [(30, 1.9, True), (30, 2.1, False), (39, 2.05, False), (60, 2.9, True), (60, 3.1, False), (160, 8.1, False)],
)
def test_corners_are_wrong_just_beyond_their_bound(side_px: float, off_px: float, is_right: bool) -> None:
    """The bound is 2 px up to a side of 40 px, then 5 % of the side: 3 px of 60 px, 8 px of 160 px."""
    truth = replace(TRUTH, corners_px=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]) * side_px)
    for way in ([1, 0], [0, -1], [0.6, 0.8]):
        row = first_row(at_marker(corners=truth.corners_px + off_px * np.array(way)), truth=truth)
        assert row["marker_2d_right"] == is_right


def test_the_bounds_of_the_corners_themselves_are_right() -> None:
    assert first_row(at_marker(corners=CORNERS_PX + [2.0, 0]))["marker_2d_right"]
    truth = replace(TRUTH, corners_px=2 * CORNERS_PX)
    assert first_row(at_marker(corners=truth.corners_px + [0, 3.0]), truth=truth)["marker_2d_right"]


def test_corners_in_another_order_are_wrong() -> None:
    """A pattern that is read a quarter turn off has its corners in place, each under the name of another."""
    assert not first_row(at_marker(corners=np.roll(CORNERS_PX, 1, axis=0)))["marker_2d_right"]


@pytest.mark.parametrize("order", [1, -1])
def test_a_wrong_id_beside_the_right_one_is_wrong_in_its_period_only(order: int) -> None:
    wrong = at_marker(id=36, track=1, x=MIDDLE_PX - 4)
    right = [at_marker(t_us=k * TWO.length_us) for k in range(2)]
    table = score([*right, wrong][::order], lambda _: [TRUTH], TWO)
    assert table["id_right"].tolist() == [False, True]
    assert table["ids"].tolist() == [(36, 37), (37,)]


def test_a_wrong_id_elsewhere_is_no_matter_of_this_marker() -> None:
    """`trial.Reading.wrong_ids` counts those."""
    assert first_row(at_marker(), at_marker(id=36, x=600))["id_right"]


@pytest.mark.parametrize(("t_us", "right"), [(-1, []), (0, [0]), (32_999, [0]), (33_000, [1]), (66_000, [])])
def test_a_sighting_of_the_period_before_or_after_counts_for_none_but_its_own(t_us: int, right: list[int]) -> None:
    table = score([at_marker(t_us=t_us)], lambda _: [TRUTH], TWO)
    assert table.index[table["id_right"]].tolist() == right
    assert table.index[table["marker_2d_right"]].tolist() == right


SPEED_PX_PER_US = 0.004  # between the two moments, 9.9 ms apart, the marker moves by 39.6 px: past all tolerances


def moving(t_us: float) -> list[MarkerTruth]:
    """Return the truth of a marker that moves to the right; at time 0 it is where `TRUTH` is."""
    by_px = SPEED_PX_PER_US * t_us
    left, *rest = TRUTH.box_px
    return [replace(TRUTH, corners_px=CORNERS_PX + [by_px, 0], box_px=(left + by_px, *rest))]  # type: ignore[arg-type]


def moving_marker(period: int, place_us: float, corners_us: float) -> Sighting:
    """Return a sighting that has the box of one moment and the corners of another [us from the period's start]."""
    start_us = period * TWO.length_us
    x = MIDDLE_PX - 10 + SPEED_PX_PER_US * (start_us + place_us)
    return at_marker(t_us=start_us, x=round(x), corners=moving(start_us + corners_us)[0].corners_px)


@pytest.mark.parametrize("period", [0, 1])
@pytest.mark.parametrize(
    ("place_us", "corners_us", "id_right", "marker_2d_right"),
    [
        (16_500, 6_600, True, True),
        (16_500, 16_500, True, False),  # corners as in the middle of the period
        (16_500, 0, True, False),  # as at its start
        (16_500, 13_200, True, False),  # as at the end of the 2D frame
        (16_500, 5_900, True, False),  # 0.7 ms too early: 2.8 px
        (6_600, 6_600, False, False),  # the place as in the middle of the 2D frame
        (0, 6_600, False, False),
        (33_000, 6_600, False, False),
    ],
)
def test_a_moving_marker_is_held_to_its_place_at_the_right_moment(
    period: int, place_us: float, corners_us: float, id_right: bool, marker_2d_right: bool
) -> None:
    table = score([moving_marker(period, place_us, corners_us)], moving, TWO)
    assert table["id_right"].tolist() == [id_right and period == k for k in range(2)]
    assert table["marker_2d_right"].tolist() == [marker_2d_right and period == k for k in range(2)]


def test_a_marker_is_in_view_if_it_is_so_in_the_middle_of_the_period() -> None:
    def leaving(t_us: float) -> list[MarkerTruth]:
        return [replace(TRUTH, in_view=t_us <= 16_500)]

    def entering(t_us: float) -> list[MarkerTruth]:
        return [replace(TRUTH, in_view=t_us >= 16_500)]

    assert score([], leaving, TWO)["period"].tolist() == [0]
    assert score([], entering, TWO)["period"].tolist() == [0, 1]
