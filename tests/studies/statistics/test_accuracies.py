"""Accuracies of the conditions of a table, and the range of one."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bicode_studies.statistics import accuracy_curves, interval_over_seeds, over_seeds, range_over_seeds
from tests.studies.statistics.coverage import WORLDS


def test_each_condition_has_its_own_row() -> None:
    table = pd.DataFrame(
        {
            "distance_m": [1.0, 1.0, 20.0, 20.0, 20.0],
            "receiver": ["ours"] * 5,
            "periods": [100, 100, 50, 150, 0],  # of the last, the marker never came into view
            "id_right": [100, 100, 50, 0, 0],
        }
    )
    near, far = over_seeds(table, ["distance_m", "receiver"]).to_dict("records")
    assert near["accuracy"] == 1
    assert (near["low"], near["high"]) == interval_over_seeds([100, 100], [100, 100])
    assert far["accuracy"] == 0.5  # the mean of the seeds, 1 and 0, not of their periods
    assert (far["seeds"], far["periods"]) == (2, 200)
    assert (far["low"], far["high"]) == interval_over_seeds([50, 0], [50, 150])


def test_conditions_keep_the_order_of_the_table_and_one_period_and_no_name_are_enough() -> None:
    """A distance that is not known (nan) is a condition like any other."""
    table = pd.DataFrame({"distance_m": [20.0, np.nan, 1.0], "periods": [1, 1, 1], "id_right": [0, 1, 1]})
    found = over_seeds(table, ["distance_m"])
    assert found["distance_m"].tolist() == pytest.approx([20.0, np.nan, 1.0], nan_ok=True)
    assert found["accuracy"].tolist() == [0, 1, 1]


def test_a_table_without_periods_has_no_rows() -> None:
    none = pd.DataFrame({"distance_m": [1.0], "periods": [0], "id_right": [0]})
    assert over_seeds(none, ["distance_m"]).to_dict("list") == {
        name: [] for name in ("distance_m", "seeds", "periods", "accuracy", "low", "high")
    }


def test_curves_have_a_part_for_the_blinker_and_one_for_the_2d_marker() -> None:
    table = pd.DataFrame(
        {"receiver": "ours", "frame_rule_2d": "any", "distance_m": [1.0, 2.0], "periods": 10, "id_right": [10, 5],
         "marker_2d_right": [8, 0]}
    )  # fmt: skip
    curves = accuracy_curves(table, ["distance_m"])
    assert curves.index.tolist() == [0, 1, 2, 3]
    assert curves.columns.tolist() == [
        "kind", "receiver", "frame_rule_2d", "distance_m", "seeds", "periods", "accuracy", "low", "high"
    ]  # fmt: skip
    assert curves["kind"].tolist() == ["blinker", "blinker", "2d", "2d"]
    assert curves["accuracy"].tolist() == [1.0, 0.5, 0.8, 0.0]
    assert curves["distance_m"].tolist() == [1.0, 2.0, 1.0, 2.0]


def test_the_range_of_a_table_is_that_of_its_accuracies_and_of_their_ends() -> None:
    """Ten seeds of one period each, so that the ends are those of the binomial distribution: 10, 6 and 1 of 10."""
    table = pd.DataFrame(
        [{"at": at, "periods": 1, "right": int(seed < n)} for at, n in ((4, 1), (1, 10), (2, 6)) for seed in range(10)]
    )
    found = range_over_seeds(table, "right", "at")
    ends = [interval_over_seeds([1] * n + [0] * (10 - n), [1] * 10) for n in (10, 6, 1)]
    lows, highs = zip(*ends, strict=True)
    assert found[0] == pytest.approx(2.4)
    assert found[1] == pytest.approx(1 + (lows[0] - 0.5) / (lows[0] - lows[1]))
    assert found[2] == pytest.approx(2 + 2 * (highs[1] - 0.5) / (highs[1] - highs[2]))
    wider = range_over_seeds(table, "right", "at", 0.999)
    assert wider[1] < found[1] < found[2] < wider[2]


def test_the_range_of_seeds_is_that_of_their_mean_share_and_not_of_their_periods() -> None:
    """Accuracies 1 at 1 m, and at 4 m 0.25, the mean of 0 of 30 and of 5 of 10: one half lies two thirds of the way."""
    table = pd.DataFrame({"distance_m": [1, 1, 4, 4], "periods": [10, 30, 30, 10], "right": [10, 30, 0, 5]})
    assert range_over_seeds(table, "right")[0] == pytest.approx(3)


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.9])
def test_the_interval_of_a_range_holds_it(rho: float) -> None:
    """Of 100 intervals of 95 %, fewer than 88 hold the true range with a chance of 1 in 200 (binomial)."""
    rng, inside = np.random.default_rng(1), 0
    at, truth, true_m = (10, 15, 20, 25), (0.95, 0.8, 0.6, 0.2), 21.25
    trials = [WORLDS["by degrees"](20, 20, accuracy, rho, 100, rng) for accuracy in truth]
    for repeat in range(100):
        rows = [
            pd.DataFrame({"at": d, "periods": 20, "right": each[repeat]}) for d, each in zip(at, trials, strict=True)
        ]
        _, low, high = range_over_seeds(pd.concat(rows), "right", "at")
        inside += low <= true_m <= high
    assert inside >= 88
