"""Recordings beside the budget: near all is read, far nothing, and a trial repeats."""

from bicode_studies.link_budget.budget_trial import budget_beside_recordings, recorded_accuracy


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
