"""Wilson's interval, Student's, and intervals of sums and differences."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, ttest_1samp

from bicode_studies.statistics import interval_of_mean, interval_of_sum, interval_over_seeds, wilson
from tests.studies.statistics.coverage import WORLDS

counts = st.integers(1, 2000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(counts)
def test_wilson_is_scipy_s_interval(counted: tuple[int, int]) -> None:
    right, n = counted
    expected = binomtest(right, n).proportion_ci(0.95, method="wilson")
    low, high = wilson(right, n)
    assert low == pytest.approx(expected.low, abs=1e-9)
    assert high == pytest.approx(expected.high, abs=1e-9)


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
    for level in np.arange(500, 1000) / 1000:  # some of these levels round otherwise
        assert (wilson(0 * n[:60], n[:60], level)[0] == 0).all()
        assert (wilson(n[:60], n[:60], level)[1] == 1).all()


@pytest.mark.parametrize("level", [0.95, 0.99])
def test_ends_stay_within_0_and_1_where_rounding_would_carry_them_beyond(level: float) -> None:
    """Counts that need not be whole, a hair from none and from all of few results."""
    rng = np.random.default_rng(0)
    n = rng.uniform(0.1, 2, 100_000)
    hair = n * 10 ** rng.uniform(-16, -6, n.size)
    assert wilson(hair, n, level)[0].min() >= 0
    assert wilson(n - hair, n, level)[1].max() <= 1


def test_wilson_of_arrays_is_that_of_each_element() -> None:
    right, n = np.array([[0, 3], [10, 20]]), np.array([[20, 20], [10, 200]])
    low, high = wilson(right, n)
    for at in np.ndindex(right.shape):
        assert (low[at], high[at]) == wilson(right[at], n[at])


@pytest.mark.parametrize("n", [0, [5, 0]])
def test_no_results_have_no_interval(n: int | list[int]) -> None:
    with pytest.raises(ValueError, match="n=0 results have no share and no interval"):
        wilson(0, n)


@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.9987])
def test_intervals_have_the_level_that_is_asked_for(level: float) -> None:
    expected = binomtest(7, 25).proportion_ci(level, method="wilson")
    assert wilson(7, 25, level) == pytest.approx((expected.low, expected.high), abs=1e-9)
    values = [3.0, 5.0, 4.0, 8.0]
    mean = ttest_1samp(values, 0).confidence_interval(level)
    assert interval_of_mean(values, level) == pytest.approx((mean.low, mean.high))


def test_one_value_tells_nothing_of_scatter_and_two_do() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing is divided by 0
        assert np.isnan(interval_of_mean([3.0])).all()
    wide = np.tan(0.475 * np.pi)  # of two values, Student's distribution is Cauchy's: 12.7 half distances for 95 %
    assert interval_of_mean([1.0, 3.0]) == pytest.approx((2 - wide, 2 + wide))


def test_a_difference_of_shares_has_newcombe_s_interval() -> None:
    """Newcombe 1998, Stat. Med. 17, 873, table II, method 10: 56/70 - 48/80 has 0.0524 .. 0.3339."""
    ends = np.transpose([wilson(56, 70), wilson(48, 80)]).T
    assert interval_of_sum([1, -1], [56 / 70, 48 / 80], ends) == pytest.approx((0.0524, 0.3339), abs=5e-5)
    low, high = interval_of_sum([-1, 1], [56 / 70, 48 / 80], ends)  # seen from the other side
    assert (low, high) == pytest.approx((-0.3339, -0.0524), abs=5e-5)


def test_a_sum_of_one_is_that_one_and_a_mean_of_n_alike_is_narrower_by_the_root_of_n() -> None:
    assert interval_of_sum([2], [0.5], [[0.3, 0.6]]) == pytest.approx((0.6, 1.2))
    assert interval_of_sum([0.25] * 4, [0.5] * 4, [[0.3, 0.6]] * 4) == pytest.approx((0.4, 0.55))


@pytest.mark.parametrize(
    ("world", "accuracies", "rho"),
    [("by degrees", (0.5, 0.5), 0.3), ("all or nothing", (0.8, 0.6), 0.6), ("by degrees", (0.9, 0.5), 0.9)],
)
def test_the_interval_of_a_difference_holds_it(world: str, accuracies: tuple[float, float], rho: float) -> None:
    """Of 200 intervals of 95 %, fewer than 182 hold the true difference with a chance of 1 in 1,000 (binomial)."""
    rng, m, n, inside = np.random.default_rng(0), 20, 20, 0
    first, then = (WORLDS[world](m, n, accuracy, rho, 200, rng) for accuracy in accuracies)
    for pair in zip(first, then, strict=True):
        ends = [interval_over_seeds(right, [n] * m) for right in pair]
        low, high = interval_of_sum([1, -1], [right.mean() / n for right in pair], ends)
        inside += low <= accuracies[0] - accuracies[1] <= high
    assert inside >= 182
