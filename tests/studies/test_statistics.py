"""Intervals of accuracies, accuracies over seeds, and ranges."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, norm

from bicode_studies.statistics import (
    DRAWS,
    Z_95,
    accuracy_curves,
    bootstrap,
    last_reached,
    over_seeds,
    ranges_m,
    wilson,
)

counts = st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))
# The interval's ends move by less than 0.7 for each unit of z (at n = 1), and scipy takes z = 1.959964 for our 1.96.
TOLERANCE = 0.7 * (Z_95 - norm.ppf(0.975))


@given(counts)
def test_wilson_is_scipy_s_interval(counted: tuple[int, int]) -> None:
    right, n = counted
    expected = binomtest(right, n).proportion_ci(0.95, method="wilson")
    low, high = wilson(right, n)
    assert low == pytest.approx(expected.low, abs=TOLERANCE)
    assert high == pytest.approx(expected.high, abs=TOLERANCE)


@given(counts)
def test_wilson_holds_the_share_and_is_the_same_seen_from_the_other_side(counted: tuple[int, int]) -> None:
    right, n = counted
    low, high = wilson(right, n)
    assert 0 <= low <= right / n <= high <= 1
    assert wilson(n - right, n) == (pytest.approx(1 - high), pytest.approx(1 - low))


def test_without_a_right_or_a_wrong_result_an_end_is_exact() -> None:
    n = np.arange(1, 500)
    assert (wilson(0 * n, n)[0] == 0).all()
    assert (wilson(n, n)[1] == 1).all()


def test_wilson_of_arrays_is_that_of_each_element() -> None:
    right, n = np.array([[0, 3], [10, 20]]), np.array([[20, 20], [10, 200]])
    low, high = wilson(right, n)
    for at in np.ndindex(right.shape):
        assert (low[at], high[at]) == wilson(right[at], n[at])


@pytest.mark.parametrize("n", [0, [5, 0]])
def test_no_results_have_no_interval(n: int | list[int]) -> None:
    with pytest.raises(ValueError, match="n=0 results have no share and no interval"):
        wilson(0, n)


def test_the_interval_over_seeds_covers_the_mean() -> None:
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(200):
        low, high = bootstrap(rng.binomial(15, 0.6, 12) / 15, 180, rng)
        inside += low <= 0.6 <= high
    assert inside >= 174  # 95 % asked, a little less with twelve seeds; 87 % would be found so often by chance
    assert bootstrap(np.ones(10), 150, rng) == (pytest.approx(0.975, abs=1e-3), 1.0)


def test_the_interval_over_seeds_is_drawn_anew_with_each_generator_and_the_same_with_the_same() -> None:
    shares = np.array([0.2, 0.4, 0.9])
    first, again, other = (bootstrap(shares, 30, np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert first == again
    assert first == pytest.approx(other, abs=0.05)
    means = np.random.default_rng(0).choice(shares, (DRAWS, 3)).mean(axis=1)
    assert first == tuple(np.quantile(means, [0.025, 0.975]))


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
    assert near["high"] == 1
    assert 0.97 < near["low"] < 1  # 200 of 200
    assert far["accuracy"] == 0.5  # the mean of the seeds, 1 and 0, not of their periods
    assert (far["seeds"], far["periods"], far["low"], far["high"]) == (2, 200, 0, 1)


def test_the_interval_of_a_condition_is_the_same_every_time() -> None:
    table = pd.DataFrame({"distance_m": 1.0, "periods": 10, "id_right": [1, 2, 5, 7, 10, 10, 3]})
    first, again = over_seeds(table, ["distance_m"]), over_seeds(table, ["distance_m"])
    assert first.equals(again)
    assert (first["low"] < first["accuracy"]).all()


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
    assert curves["kind"].tolist() == ["blinker", "blinker", "2d", "2d"]
    assert curves["accuracy"].tolist() == [1.0, 0.5, 0.8, 0.0]
    assert curves["distance_m"].tolist() == [1.0, 2.0, 1.0, 2.0]


def test_seeds_that_are_all_the_same_have_wilsons_interval() -> None:
    for right, of in ((0, 20), (3, 20), (10, 20), (20, 20), (199, 200)):
        expected = binomtest(right, of).proportion_ci(0.95, method="wilson")
        for shares in (np.array([right / of]), np.full(5, right / of)):
            found = bootstrap(shares, of, np.random.default_rng(0))
            assert found == pytest.approx((expected.low, expected.high), abs=1e-4)


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
