"""Tracks of regions (Fig. 2, box f)."""

import numpy as np
import pytest

from bicode_lab.boxes import iou
from bicode_lab.recognition import Tracker
from bicode_lab.recognition.track import PAD_PX


def test_overlap_of_equal_and_of_distant_boxes() -> None:
    boxes = np.array([[0.0, 0, 4, 4], [100, 100, 20, 10]])
    np.testing.assert_allclose(iou(boxes, boxes, PAD_PX), np.eye(2))
    np.testing.assert_allclose(iou(boxes, boxes), np.eye(2))


def test_a_track_is_reported_from_its_first_period() -> None:
    assert [track.number for track in Tracker().update([(5, 5, 4, 4)])] == [1]


@pytest.mark.parametrize("side", [3, 4, 8, 165])
def test_a_jittering_box_keeps_its_track(side: int) -> None:
    rng = np.random.default_rng(side)
    tracker = Tracker()
    numbers = set()
    for _ in range(200):
        x, y, w, h = (int(v) for v in np.array([50, 50, side, side]) + rng.integers(-1, 2, 4))
        numbers.add(tracker.update([(x, y, max(w, 2), max(h, 2))])[0].number)
    assert numbers == {1}


def test_a_fast_marker_is_followed() -> None:
    """A marker at 0.314 m/s and 0.5 m moves by 34 px per period; its box is 165 px wide."""
    tracker = Tracker()
    assert {tracker.update([(34 * k, 100, 165, 165)])[0].number for k in range(30)} == {1}


def test_two_that_pass_each_other_are_not_swapped() -> None:
    tracker = Tracker()
    for k in range(40):
        tracks = tracker.update([(10 + 4 * k, 50, 12, 12), (166 - 4 * k, 66, 12, 12)])
        assert [track.number for track in tracks] == [1, 2]


def test_the_order_of_regions_does_not_matter() -> None:
    tracker = Tracker()
    tracker.update([(10, 10, 5, 5), (60, 10, 5, 5), (10, 60, 5, 5)])
    assert [track.number for track in tracker.update([(10, 60, 5, 5), (10, 10, 5, 5), (60, 10, 5, 5)])] == [3, 1, 2]


@pytest.mark.parametrize(("hidden", "number"), [(0, 1), (5, 1), (6, 2)])
def test_a_track_outlives_max_age_periods_and_no_more(hidden: int, number: int) -> None:
    tracker = Tracker(max_age=5)
    for _ in range(5):
        tracker.update([(20, 20, 8, 8)])
    tracker.skip(hidden)
    assert tracker.update([(20, 20, 8, 8)])[0].number == number


def test_a_long_quiet_time_is_no_work() -> None:
    tracker = Tracker()
    tracker.update([(20, 20, 8, 8)])
    tracker.skip(10**9)
    assert tracker.tracks == []


def test_the_filtered_box_stays_near_what_is_measured() -> None:
    tracker = Tracker()
    for k in range(20):
        track = tracker.update([(20 + 2 * k, 30, 16, 8)])[0]
    np.testing.assert_allclose(track.box(), (58, 30, 16, 8), atol=0.5)
    np.testing.assert_allclose(track.state[4:6], (2, 0), atol=0.1)
