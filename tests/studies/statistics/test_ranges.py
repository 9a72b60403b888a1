"""Ranges of curves, with their intervals."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_studies.statistics import last_reached, range_with_ends, ranges_m


def test_a_range_goes_to_the_last_distance_with_one_half_or_more() -> None:
    curves = np.array([[1, 1, 1], [1, 0.5, 0.4], [0.1, 0.2, 0.3], [1, 0.4, 0.6], [0.4, 0.5, 0.0]])
    assert last_reached(curves).tolist() == [3, 2, 0, 3, 2]


@given(at=st.floats(11, 39), steep=st.floats(0.05, 0.3))
def test_the_range_of_a_straight_fall_is_where_it_crosses_one_half(at: float, steep: float) -> None:
    distances = np.arange(10.0, 41.0, 2.5)
    accuracy = 0.5 - steep * (distances - at)
    assert ranges_m(distances, accuracy[None])[0] == pytest.approx(at)


def test_the_last_fall_counts_and_none_ends_at_the_last_distance() -> None:
    """A curve that falls, rises and falls again has the range of its last fall."""
    distances = np.array([10.0, 20.0, 30.0, 40.0])
    curves = np.array([[1, 0.4, 0.6, 0.2], [1, 1, 1, 0.5], [0.4, 0.3, 0.2, 0.1], [0.5, 0.4, 0.0, 0.0]])
    assert ranges_m(distances, curves).tolist() == pytest.approx([32.5, 40.0, 0.0, 10.0])


def test_level_curves_need_no_division() -> None:
    """A curve that reaches one half nowhere, or everywhere, and does not fall between distances."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ranges_m(np.array([10.0, 20.0]), np.array([[0.4, 0.4], [0.6, 0.6]])).tolist() == [0, 20]


def test_the_ends_of_a_range_are_where_the_ends_of_the_accuracies_cross_one_half() -> None:
    """Accuracies 1, 0.7, 0.2 at 10, 20, 30 m: the lower ends cross at 17.5 m, the upper ones never."""
    ends = [[0.8, 1.0], [0.4, 0.9], [0.1, 0.6]]
    assert range_with_ends(np.array([10.0, 20.0, 30.0]), [1, 0.7, 0.2], ends) == pytest.approx((24, 17.5, 30))
