"""Box algebra: laws over random boxes, against sets of pixels."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.boxes import Box, iou, keep_larger, merge_boxes

SIDE = 12
boxes = st.builds(Box, st.integers(-3, SIDE), st.integers(-3, SIDE), st.integers(1, 6), st.integers(1, 6))


def pixels(box: Box) -> set[tuple[int, int]]:
    """List the pixels of a box."""
    return {(x, y) for x in range(box.x, box.right) for y in range(box.y, box.bottom)}


@given(a=boxes, b=boxes)
def test_areas_and_overlaps_are_those_of_the_pixels(a: Box, b: Box) -> None:
    assert a.area == len(pixels(a))
    assert a.shared_area(b) == b.shared_area(a) == len(pixels(a) & pixels(b))
    assert a.overlaps(b) == bool(pixels(a) & pixels(b))
    assert pixels(a) | pixels(b) <= pixels(a.union(b))
    assert pixels(a.clipped(SIDE, SIDE)) == {(x, y) for x, y in pixels(a) if 0 <= x < SIDE and 0 <= y < SIDE}


def test_boxes_of_2d_markers_are_merged_with_their_regions() -> None:
    two_in_one = merge_boxes([Box(0, 0, 50, 20)], [Box(0, 0, 20, 20), Box(28, 0, 20, 20)], 100, 100)
    assert two_in_one == [((0, 0, 20, 20), 0), ((28, 0, 20, 20), 1)]
    assert merge_boxes([Box(0, 0, 90, 90)], [Box(40, 40, 10, 10)], 100, 100) == [((40, 40, 10, 10), 0)]
    assert merge_boxes([], [Box(-5, 90, 20, 20)], 100, 100) == [((0, 90, 15, 10), 0)]
    moved = merge_boxes([Box(10, 10, 30, 20), Box(80, 80, 3, 3)], [Box(12, 11, 20, 18)], 100, 100)
    assert moved == [((10, 10, 30, 20), 0), ((80, 80, 3, 3), None)]


def test_a_region_is_merged_up_to_three_times_the_area() -> None:
    marker = Box(10, 10, 4, 4)
    largest = Box(10, 10, 4, 12)
    assert merge_boxes([largest], [marker], 100, 100) == [(largest, 0)]
    assert merge_boxes([largest._replace(h=largest.h + 1)], [marker], 100, 100) == [(marker, 0)]


def test_of_two_boxes_that_overlap_the_larger_is_kept() -> None:
    regions, faint = [Box(10, 10, 3, 3), Box(50, 50, 90, 90)], [Box(9, 9, 6, 6), Box(60, 60, 5, 5), Box(200, 9, 5, 5)]
    assert keep_larger(regions, faint) == [(50, 50, 90, 90), (9, 9, 6, 6), (200, 9, 5, 5)]
    assert keep_larger([Box(0, 0, 2, 3)], [Box(1, 1, 3, 2)]) == [(1, 1, 3, 2)]
    assert keep_larger([Box(0, 0, 2, 2)], [Box(2, 0, 2, 2)]) == [(0, 0, 2, 2), (2, 0, 2, 2)]  # they only touch


@given(first=st.lists(boxes, max_size=4), second=st.lists(boxes, max_size=4))
def test_no_kept_box_overlaps_one_of_the_other_list(first: list[Box], second: list[Box]) -> None:
    for a, b in itertools.combinations(keep_larger(first, second), 2):
        assert not a.overlaps(b) or {a, b} <= set(first) or {a, b} <= set(second)


@pytest.mark.parametrize("box", [Box(0, 0, 0, 3), Box(0, 0, 3, 0), Box(4, 4, -2, 5), Box(4, 4, -2, -5)])
def test_a_box_without_pixels_is_empty(box: Box) -> None:
    assert box.is_empty
    assert box.area == 0
    assert not Box(0, 0, 1, 1).is_empty


@given(a=boxes, b=boxes, pad=st.integers(0, 3))
def test_intersection_over_union_is_that_of_the_padded_pixels(a: Box, b: Box, pad: int) -> None:
    first, second = (pixels(Box.between(c.x - pad, c.y - pad, c.right + pad, c.bottom + pad)) for c in (a, b))
    expected = len(first & second) / len(first | second)
    assert iou(np.array([a], float), np.array([b], float), pad)[0, 0] == pytest.approx(expected)
