"""Tracks of boxes that move in simple ways."""

from __future__ import annotations

import pytest

from bicode_lab.boxes import Box
from bicode_lab.sequential.tracks import Tracks


def numbers(boxes_of_periods: list[list[Box]], max_age: int = 5) -> list[list[int]]:
    """Return the numbers of the tracks of the boxes of each period."""
    tracks: Tracks[None] = Tracks(max_age)
    found = []
    for boxes in boxes_of_periods:
        tracks.advance(1)
        found.append([track.number for track in tracks.update(boxes, lambda _: None)])
    return found


@pytest.mark.parametrize("step", [0, 3, -7, 10, 20])
def test_a_box_that_moves_evenly_keeps_its_track(step: int) -> None:
    """A step of twice its width is within the reach of a new track; then its velocity is known."""
    assert numbers([[Box(200 + k * step, 50, 10, 10)] for k in range(12)]) == [[1]] * 12


def test_a_box_out_of_reach_begins_a_track() -> None:
    assert numbers([[Box(0, 0, 10, 10)], [Box(21, 0, 10, 10)]]) == [[1], [2]]
    still = [[Box(0, 0, 10, 10)]] * 3
    assert numbers([*still, [Box(10, 0, 10, 10)]])[-1] == [1]
    assert numbers([*still, [Box(11, 0, 10, 10)]])[-1] == [2]
    assert numbers([*still, [Box(6, 0, 2, 2)]])[-1] == [1]
    small = [[Box(0, 0, 2, 2)]] * 3
    assert numbers([*small, [Box(6, 0, 2, 2)]])[-1] == [1]
    assert numbers([*small, [Box(7, 0, 2, 2)]])[-1] == [2]
    assert numbers([*small, [Box(4, -4, 10, 10)]])[-1] == [1]  # a large box reaches as far as it is large


def test_a_track_lives_as_long_as_it_should() -> None:
    box = [Box(5, 5, 10, 10)]
    assert numbers([box, [], [], box], max_age=3) == [[1], [], [], [1]]
    assert numbers([box, [], [], [], box], max_age=3) == [[1], [], [], [], [2]]


def test_the_velocity_goes_on_while_a_box_is_missing() -> None:
    moving = [[Box(10 * k, 0, 10, 10)] for k in range(6)]
    assert numbers([*moving, [], [], [Box(80, 0, 10, 10)]])[-1] == [1]
    assert numbers([*moving, [], [], [Box(50, 0, 10, 10)]])[-1] == [2]


def test_a_velocity_is_half_the_new_one() -> None:
    tracks: Tracks[None] = Tracks(5)
    for x in (0, 4, 12):
        tracks.advance(1)
        (track,) = tracks.update([Box(x, 0, 10, 10)], lambda _: None)
    assert track.velocity.tolist() == [6, 0]  # half of 4 and half of 8
    tracks.advance(2)
    assert track.predicted() == Box(24, 0, 10, 10)
    (track,) = tracks.update([Box(24, 0, 10, 10)], lambda _: None)
    assert track.velocity.tolist() == [6, 0]
    assert track.age == 0
    assert track.n_found == 4


def test_two_boxes_that_cross_keep_their_tracks() -> None:
    """One goes right and one goes left, 3 px below it."""
    periods = [[Box(8 * k, 0, 10, 10), Box(96 - 8 * k, 3, 10, 10)] for k in range(13)]
    assert numbers(periods) == [[1, 2]] * 13
    turned = [boxes if k % 2 else boxes[::-1] for k, boxes in enumerate(periods)]
    assert numbers(turned) == [[2, 1] if k % 2 else [1, 2] for k in range(13)]


def test_numbers_are_never_used_again() -> None:
    far = [[Box(100 * k, 0, 10, 10)] for k in range(5)]
    assert numbers(far, max_age=1) == [[1], [2], [3], [4], [5]]
