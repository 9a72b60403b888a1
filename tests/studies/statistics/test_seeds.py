"""The interval over seeds: what it is where it is known exactly, its laws, and its coverage."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.special import betainc, expit, logit
from scipy.stats import beta, betabinom, binom

from bicode_studies.statistics import interval_over_seeds
from bicode_studies.statistics.seeds import RHO, probability_up_to
from tests.studies.statistics.coverage import REPEATS, TABLE, WORLDS, misses

seeds = st.integers(2, 12).flatmap(
    lambda m: st.lists(
        st.integers(1, 30).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))), min_size=m, max_size=m
    )
)
COVERAGE = pd.read_csv(TABLE)


def binomial_interval(k: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of k of n independent results in which k itself counts half (mid-p)."""

    def end_at(tail: float) -> float:
        return float(brentq(lambda p: binom.cdf(k, n, p) - binom.pmf(k, n, p) / 2 - tail, 1e-9, 1 - 1e-9, xtol=1e-12))

    return (end_at((1 + level) / 2) if k else 0.0), (end_at((1 - level) / 2) if k < n else 1.0)


@pytest.mark.parametrize(("k", "m"), [(0, 10), (10, 10), (9, 30), (25, 40), (1, 1), (20, 40)])
@pytest.mark.parametrize("level", [0.9, 0.95, 0.9987])
def test_seeds_of_one_period_have_the_exact_binomial_interval(k: int, m: int, level: float) -> None:
    """Every correlation says the same then. Ends never lie nearer than where no period is right, or none is wrong."""
    none = binomial_interval(0, m, level)[1]
    low, high = binomial_interval(k, m, level)
    expected = min(low, 1 - none), max(high, none)
    assert interval_over_seeds([1] * k + [0] * (m - k), [1] * m, level) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("right", "m"), [(5, 10), (3, 10), (12, 20)])
def test_seeds_that_are_all_right_or_all_wrong_count_as_one_result_each(right: int, m: int) -> None:
    """Of 200 periods each, they leave no doubt of a correlation near 1."""
    found = interval_over_seeds([200] * right + [0] * (m - right), [200] * m)
    assert found == pytest.approx(binomial_interval(right, m), abs=0.01)


def test_periods_that_scatter_as_independent_ones_count_nearly_one_by_one() -> None:
    """With 40 seeds of 200 periods, the interval is at most a quarter wider than that of 8,000 independent ones."""
    right = np.random.default_rng(3).binomial(200, 0.6, 40)
    low, high = interval_over_seeds(right, [200] * 40)
    least, most = binomial_interval(int(right.sum()), 8000)
    assert 0.97 < (high - low) / (most - least) < 1.25
    assert (high + low) / 2 == pytest.approx((most + least) / 2, abs=0.001)


def test_correlations_are_the_middles_of_24_equally_likely_parts() -> None:
    """Those below one in a million are set to it."""
    middles = (np.arange(24) + 0.5) / 24
    least = beta(0.15, 0.5).cdf(1e-6)
    assert beta(0.15, 0.5).cdf(RHO) == pytest.approx(np.maximum(middles, least))
    assert (RHO == 1e-6).sum() == (middles < least).sum() > 0


@pytest.mark.parametrize(
    ("right", "periods"), [([3, 0, 5, 9], [7, 4, 5, 20]), ([1, 0, 0], [2, 2, 2]), ([4, 6], [4, 6]), ([0, 0], [3, 30])]
)
@pytest.mark.parametrize("accuracy", [0.03, 0.4, 0.9])
def test_the_tail_is_the_mean_over_correlations_that_the_module_describes(
    right: list[int], periods: list[int], accuracy: float
) -> None:
    """Written with one correlation at a time, from SciPy's own distributions."""
    k, n, m = np.array(right), np.array(periods), len(right)
    share, wrong, sums = (k / n).mean(), 1 - accuracy, np.zeros(2)
    for rho in RHO:
        alike = 1 / (rho / m + (1 - rho) * (1 / n).sum() / m**2)
        x = alike * share
        below = betainc(alike - x + 1, x, wrong) if k.any() else 0
        up_to = betainc(alike - x, x + 1, wrong) if (k < n).any() else 1
        total = 1 / rho - 1  # a beta distribution of a and b has the correlation 1 / (a + b + 1)
        whole = np.where(k == n, accuracy, np.where(k == 0, wrong, 0))
        by_degrees = betabinom.pmf(k, n, accuracy * total, wrong * total).prod()
        all_or_nothing = ((1 - rho) * binom.pmf(k, n, accuracy) + rho * whole).prod()
        sums += (by_degrees + all_or_nothing) * np.array([(below + up_to) / 2, 1])
    found = probability_up_to(k.astype(float), n.astype(float))(accuracy)
    assert found == pytest.approx(sums[0] / sums[1], rel=1e-7)


def test_ends_below_the_least_accuracy_that_is_tried_are_0() -> None:
    """One right of ten seeds of one period: the lower end is nearly (1 - level) / 10, if that is 1e-9 or more."""
    one, n = [1] + [0] * 9, [1] * 10
    for end in (1.3e-9, 1.8e-9):
        low, _ = interval_over_seeds(one, n, 1 - 10 * end)
        assert low == pytest.approx(end, rel=1e-3)
        assert 1 - interval_over_seeds([0] + [1] * 9, n, 1 - 10 * end)[1] == pytest.approx(end, rel=1e-3)
    for end in (0.6e-9, 0.9e-9):
        assert interval_over_seeds(one, n, 1 - 10 * end)[0] == 0
        assert interval_over_seeds([0] + [1] * 9, n, 1 - 10 * end)[1] == 1


def test_an_end_at_the_least_accuracy_itself_is_0_and_one_that_no_accuracy_reaches_is_1() -> None:
    tail = probability_up_to(np.array([1.0]), np.array([10.0]))(1e-9)
    assert interval_over_seeds([1], [10], 2 * tail - 1)[0] == 0
    assert probability_up_to(np.full(100, 5.0), np.full(100, 10.0))(1 - 1e-9) == 0
    assert interval_over_seeds([5] * 100, [10] * 100, 1)[1] == 1


def test_ends_are_found_to_a_third_of_a_millionth_of_their_odds() -> None:
    """Where the tail probability is that of the end, found anew by a finer search."""
    rng = np.random.default_rng(0)
    for _ in range(12):
        n = rng.integers(20, 200, 8)
        k = rng.binomial(n, 0.4)
        tail = probability_up_to(k.astype(float), n.astype(float))
        for end, at in zip(interval_over_seeds(k, n), (0.975, 0.025), strict=True):
            exact = brentq(lambda x, at=at, tail=tail: tail(expit(x)) - at, -9, 9, xtol=1e-12)
            assert abs(logit(end) - exact) < 3.3e-7


def test_a_seed_counts_as_much_as_another_however_long_it_is() -> None:
    low, high = interval_over_seeds([1000, 5], [1000, 10])
    assert low < 0.75 < high
    assert interval_over_seeds([5, 1000], [10, 1000]) == (low, high)


@given(seeds)
@settings(max_examples=40, deadline=None)
def test_it_encloses_the_share_and_is_the_same_seen_from_the_other_side(counted: list[tuple[int, int]]) -> None:
    right, n = np.array(counted).T
    low, high = interval_over_seeds(right, n)
    assert 0 <= low <= (right / n).mean() <= high <= 1
    assert interval_over_seeds(n - right, n) == pytest.approx((1 - high, 1 - low), abs=1e-5)
    wide_low, wide_high = interval_over_seeds(right, n, 0.999)
    assert wide_low <= low
    assert wide_high >= high


@given(seeds)
@settings(max_examples=40, deadline=None)
def test_no_end_is_nearer_than_without_a_right_or_without_a_wrong_period(counted: list[tuple[int, int]]) -> None:
    right, n = np.array(counted).T
    low, high = interval_over_seeds(right, n)
    assert high >= interval_over_seeds(0 * n, n)[1] - 1e-9
    assert low <= interval_over_seeds(n, n)[0] + 1e-9


def test_without_a_right_period_the_seeds_count_and_not_the_periods() -> None:
    """Ten seeds without a right period: nearly the upper end of 0 of 10, however many periods they have."""
    ends = [interval_over_seeds([0] * 10, [n] * 10)[1] for n in (1, 5, 20, 200, 2000)]
    assert ends[0] == pytest.approx(1 - 0.05**0.1, abs=1e-6)  # half of (1 - p)^10 is 0.025
    assert all(0.24 < end < 0.26 for end in ends)


@pytest.mark.parametrize(("m", "n"), [(10, 5), (10, 20), (20, 20), (40, 5)])
@pytest.mark.parametrize("fill", ["in turn", "one after another"])
def test_one_right_period_more_moves_the_ends_by_little(m: int, n: int, fill: str) -> None:
    """From none to all right, one by one: no end jumps by more than eight periods' worth, nor falls by two."""
    right, ends = np.zeros(m), [interval_over_seeds([0] * m, [n] * m)]
    for step in range(m * n):
        right[step % m if fill == "in turn" else step // n] += 1
        ends.append(interval_over_seeds(right, [n] * m))
    moves = np.diff(ends, axis=0) * m * n
    assert moves.max() < 8
    assert moves.min() > -2
    assert ends[1][1] >= ends[0][1]  # one right period has no smaller upper end than none


@pytest.mark.parametrize("periods", [[], [10, 0]])
def test_seeds_without_periods_have_no_interval(periods: list[int]) -> None:
    with pytest.raises(ValueError, match="leave out seeds without periods"):
        interval_over_seeds([0] * len(periods), periods)


def test_the_table_of_coverage_is_as_the_design_says() -> None:
    """At least 94 % are held, up to what 1,000 repeats scatter, and 94 to 96 % in the mean where both ends can miss."""
    scatter = np.sqrt(0.06 * 0.94 / REPEATS)
    assert COVERAGE["coverage"].min() > 0.94 - 3.1 * scatter  # of 1,053 conditions, 1 would lie beyond
    assert (COVERAGE["coverage"] < 0.94).mean() < 0.02
    none = {(m, n): interval_over_seeds([0] * m, [n] * m)[1] for m, n in COVERAGE.groupby(["seeds", "periods"]).groups}
    least = COVERAGE[["seeds", "periods"]].apply(tuple, axis=1).map(none)
    both = COVERAGE[COVERAGE["accuracy"].between(least, 1 - least)]  # elsewhere one of the ends cannot miss
    assert len(both) > 300
    assert 0.94 < both["coverage"].mean() < 0.96
    rest = COVERAGE.drop(both.index)
    assert 0.97 < rest["coverage"].mean() < 0.985
    assert rest[["below", "above"]].min(axis=1).max() == 0


@pytest.mark.parametrize("row", COVERAGE.sample(12, random_state=0).index)
def test_the_coverage_is_that_of_the_table(row: int) -> None:
    """Both numbers scatter by the root of p (1 - p) / repeats; they differ by less than 3.5 of that together."""
    case, repeats = COVERAGE.loc[row], 300
    names = ("world", "seeds", "periods", "accuracy", "rho")
    found = 1 - sum(misses(*(case[name] for name in names), repeats, seed=1))
    p = min(case["coverage"], 1 - 3 / REPEATS)
    assert abs(found - case["coverage"]) < 3.5 * np.sqrt(p * (1 - p) * (1 / repeats + 1 / REPEATS))


@pytest.mark.parametrize("accuracy", [0.05, 0.3, 0.5])
@pytest.mark.parametrize("world", WORLDS)
def test_the_ends_lie_where_the_tail_probability_says(world: str, accuracy: float) -> None:
    """What the table counts as held is held by the interval itself."""
    m, n = 10, 20
    none = interval_over_seeds([0] * m, [n] * m)[1]
    for right in WORLDS[world](m, n, accuracy, 0.3, 30, np.random.default_rng(5)):
        low, high = interval_over_seeds(right, [n] * m)
        tail = probability_up_to(right.astype(float), np.full(m, float(n)))(accuracy)
        assert (low <= accuracy) == (tail <= 0.975 or accuracy >= 1 - none)
        assert (high >= accuracy) == (tail >= 0.025 or accuracy <= none)
