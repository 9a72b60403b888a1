"""Tests of claims: each turns curves of accuracy into a number of ours with its 95 % interval.

`worst_accuracy` judges the accuracy that agrees least, `longest_range` the largest tested distance with an accuracy
of one half or more, `range_rises` and `accuracy_rises` an order of curves, `curves_alike` the mean difference of two.

Intervals come from a bootstrap over seeds: for each condition as many seeds as it has are drawn with replacement.
Seeds of different conditions are drawn independently. This widens the interval of a difference where the conditions
share some of their chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from bicode_studies.claims.claim_result import ClaimResult, NoTrials, Tables
from bicode_studies.claims.curves import Curve
from bicode_studies.statistics import Floats, bootstrap, last_reached, ranges_m

ClaimTest = Callable[[Tables, float, float], ClaimResult]
"""A test takes the tables of trials and the claim's bounds `lo` and `hi`, and returns what we find."""


def worst_accuracy(*curves: Curve) -> ClaimTest:
    """Test all accuracies of some curves; the one that agrees least with the claim is judged.

    Parameters
    ----------
    *curves : Curve

    Returns
    -------
    callable
        A `ClaimTest`.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        found = []
        for curve in curves:
            for cell in curve.cells(tables):
                low, high = bootstrap(cell.shares, cell.periods, rng)
                ours = f"{cell.accuracy:.3g} at {cell.at:g} m ({cell.shares.size} seeds)"
                value = cell.accuracy
                found.append((_excess(value, value, lo, hi), _excess(low, high, lo, hi), ours, value, low, high))
        _, _, ours, value, low, high = max(found)
        return ClaimResult(ours=ours, value=value, low=low, high=high)

    return test


def _excess(low: float, high: float, lo: float, hi: float) -> float:
    """Return how far an interval leaves its bounds; 0 and 1 are no bounds, for no accuracy lies beyond them."""
    return max(lo - low if lo > 0 else -1.0, high - hi if hi < 1 else -1.0)


def longest_range(*curves: Curve) -> ClaimTest:
    """Test the largest tested distance at which one of the curves has an accuracy of one half or more.

    Parameters
    ----------
    *curves : Curve
        Curves over distance.

    Returns
    -------
    callable
        A `ClaimTest`. The ends of its interval are tested distances, too.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        found = []
        for curve in curves:
            cells = curve.cells(tables)
            at = np.array([0.0, *(cell.at for cell in cells)])
            reached = last_reached(np.column_stack([cell.draws(rng) for cell in cells]))
            low, high = np.quantile(at[reached], [0.025, 0.975], method="closest_observation")
            value = at[last_reached(np.array([[cell.accuracy for cell in cells]]))[0]]
            found.append((float(value), float(low), float(high)))
        value, low, high = max(found)
        return ClaimResult(ours=f"{value:g} m", value=value, low=low, high=high)

    return test


def range_rises(*curves: Curve) -> ClaimTest:
    """Test that the range rises from each curve to the next.

    Parameters
    ----------
    *curves : Curve
        Curves over distance, the shortest range first.

    Returns
    -------
    callable
        A `ClaimTest` of ranges as `bicode_studies.statistics.ranges_m` defines them.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        values, draws = [], []
        for curve in curves:
            cells = curve.cells(tables)
            at_m = np.array([cell.at for cell in cells])
            values.append(ranges_m(at_m, np.array([[cell.accuracy for cell in cells]])))
            draws.append(ranges_m(at_m, np.column_stack([cell.draws(rng) for cell in cells])))
        return smallest_step([float(value[0]) for value in values], draws, "m")

    return test


def smallest_step(values: Sequence[float], draws: Sequence[Floats], unit: str) -> ClaimResult:
    """Judge numbers that should rise by the step that rises least.

    Parameters
    ----------
    values : sequence of float
        The smallest first.
    draws : sequence of ndarray, each of shape (DRAWS,)
        Draws of each value.
    unit : str
        Unit of the values.

    Returns
    -------
    ClaimResult
        An order; `value` is the smallest step.
    """
    steps = []
    for (first, then), (drawn_first, drawn_then) in zip(pairwise(values), pairwise(draws), strict=True):
        low, high = np.quantile(drawn_then - drawn_first, [0.025, 0.975])
        steps.append((float(low), then - first, float(high)))
    low, value, high = min(steps)
    listed = ", ".join(f"{value:.3g}" for value in values)
    ours = f"{listed} {unit}; smallest step {value:+.3g}"
    return ClaimResult(ours=ours, value=value, low=low, high=high, is_order=True)


def accuracy_rises(*levels: Curve) -> ClaimTest:
    """Test that accuracy rises from each curve to the next, at the places that all of them have.

    Accuracies end at 0 and 1, so levels may tie at single places: the mean must rise from the first level to the
    last. No step between neighbouring levels may fall at any place by more than chance; the interval of a step is so
    wide that in 5 % of all such tests chance alone makes one of them fall (Bonferroni).

    Parameters
    ----------
    *levels : Curve
        Curves over the same column, the lowest accuracy first.

    Returns
    -------
    callable
        A `ClaimTest`. It raises `NoTrials` if the curves have no place in common.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        curves = [{cell.at: cell for cell in level.cells(tables)} for level in levels]
        places = sorted(set.intersection(*(set(curve) for curve in curves)))
        if not places:
            raise NoTrials(f"the curves of figure {levels[0].figure} have no place in common")
        draws = [{at: curve[at].draws(rng) for at in places} for curve in curves]
        rise = np.mean([draws[-1][at] - draws[0][at] for at in places], axis=0)
        value = float(np.mean([curves[-1][at].accuracy - curves[0][at].accuracy for at in places]))
        low, high = np.quantile(rise, [0.025, 0.975])
        beyond = 1 - 0.025 / (len(places) * (len(levels) - 1))
        falls = [
            f"{float(np.mean(then[at] - first[at])):+.2g} at {at:g}"
            for first, then in pairwise(draws)
            for at in places
            if np.quantile(then[at] - first[at], beyond) < 0
        ]
        means = ", ".join(f"{np.mean([curve[at].accuracy for at in places]):.3g}" for curve in curves)
        return ClaimResult(
            ours=f"{means}; rises by {value:+.2g}", value=value, low=float(low), high=float(high),
            is_order=True, broken=", ".join(falls),
        )  # fmt: skip

    return test


def curves_alike(first: Curve, then: Curve, within: float) -> ClaimTest:
    """Test that two curves differ little, by the mean of their absolute differences.

    Parameters
    ----------
    first, then : Curve
        Curves over distance.
    within : float
        The largest mean difference of accuracy that agrees, 0 .. 1.

    Returns
    -------
    callable
        A `ClaimTest`. It raises `NoTrials` if the curves have no distance in common.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        a, b = ({cell.at: cell for cell in curve.cells(tables)} for curve in (first, then))
        places = sorted(set(a) & set(b))
        if not places:
            raise NoTrials(f"figures {first.figure} and {then.figure} have no distance in common")
        value = float(np.mean([abs(a[at].accuracy - b[at].accuracy) for at in places]))
        drawn = np.mean([np.abs(a[at].draws(rng) - b[at].draws(rng)) for at in places], axis=0)
        low, high = np.quantile(drawn, [0.025, 0.975])
        ours = f"differ by {value:.2g} over {len(places)} distances"
        return ClaimResult(ours=ours, value=value, low=float(low), high=float(high), lo=0.0, hi=within)

    return test


def least_favourable(*tests: ClaimTest) -> ClaimTest:
    """Combine several tests of one claim; the least favourable result counts.

    Parameters
    ----------
    *tests : callable
        `ClaimTest` functions.

    Returns
    -------
    callable
        A `ClaimTest`.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        results = [each(tables, lo, hi) for each in tests]
        return min(results, key=lambda result: (not result.broken, _margin(result, lo, hi)))

    return test


def _margin(result: ClaimResult, lo: float, hi: float) -> float:
    """Return how far inside its bounds a value lies; for an order, the lower end of its interval."""
    if result.is_order:
        return result.low or 0.0
    least, most = (lo if result.lo is None else result.lo), (hi if result.hi is None else result.hi)
    value = result.value or 0.0
    return min(value - least, most - value)
