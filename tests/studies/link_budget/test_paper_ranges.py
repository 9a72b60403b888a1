"""Tests of the budget beside recordings: a near marker is read, a distant one is not, and a trial repeats."""

import pytest

from bicode_studies.link_budget.paper_ranges import budget_beside_recordings, crossing_distance_m, recorded_accuracy


def test_near_is_read_and_far_is_not() -> None:
    assert recorded_accuracy(5.0, seed=0) == 1.0
    assert recorded_accuracy(90.0, seed=0) == 0.0


def test_a_row_for_each_distance_with_its_interval() -> None:
    table = budget_beside_recordings([5.0, 90.0], seeds=2)
    assert table["distance_m"].tolist() == [5.0, 90.0]
    assert table["recorded"].tolist() == [1.0, 0.0]
    assert (table["low"] <= table["recorded"]).all()
    assert (table["recorded"] <= table["high"]).all()
    assert table["budget"].between(0, 1).all()
    assert table.equals(budget_beside_recordings([5.0, 90.0], seeds=2))


def test_a_level_that_is_not_crossed_raises_an_error() -> None:
    with pytest.raises(ValueError, match="another guess_m"):
        crossing_distance_m(lambda distance_m: 1.0, guess_m=10.0)
