"""Tests of claims: each turns curves of accuracy into a number of ours with its intervals.

`worst_accuracy` judges the accuracy that agrees least, `longest_range` the largest tested distance with an accuracy
of one half or more, `range_rises` an order of ranges. `bicode_studies.claims.differences` compares accuracies.

Each number has two intervals: the one that is shown (95 %), and the one that is judged, at `FAMILY_LEVEL`. Where a
claim is about several numbers ("at every distance"), it is reproduced if all of them are, and contradicted if a single
one is. Then chance has several occasions to contradict, so a number outside its bounds is judged by an interval that is
wider by the number of numbers (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypedDict

import numpy as np

from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import Cell, Curve
from bicode_studies.statistics import LEVEL, interval_of_sum, last_reached, range_with_ends

FAMILY = 40  # claims that are judged by trials: 39 numbers and orders, and F12.6
FAMILY_LEVEL = 1 - (1 - LEVEL) / FAMILY  # in 95 % of all worlds, none of these intervals misses its truth (Bonferroni)
# The paper counts about 200 periods for each condition. Wilson's interval of 200 of 200 begins at 0.981, so the paper
# itself cannot tell an accuracy from one that is 0.02 away.
ACCURACY_BAND = 0.02

ClaimTest = Callable[[Tables, float, float], ClaimResult]
"""A test takes the tables of trials and the claim's bounds `lo` and `hi`, and returns what we find."""
Ends = tuple[float, float]
Interval = Callable[[float], Ends]
"""From a level to the ends of an interval."""


class BothIntervals(TypedDict):
    """The intervals of a number: of `LEVEL`, to be shown, and the wider one that is judged."""

    low: float
    high: float
    judged_low: float
    judged_high: float


def both_intervals(interval: Interval, times: int = 1) -> BothIntervals:
    """Return the interval that is shown and the one that is judged, as arguments of a `ClaimResult`.

    Parameters
    ----------
    interval : callable
        From a level to the ends of an interval.
    times : int
        Number of such intervals any of which may decide the claim.

    Returns
    -------
    dict
        ``low`` and ``high``, ``judged_low`` and ``judged_high``.
    """
    (low, high), (judged_low, judged_high) = interval(LEVEL), interval(1 - (1 - FAMILY_LEVEL) / times)
    return {"low": low, "high": high, "judged_low": judged_low, "judged_high": judged_high}


def worst_accuracy(*curves: Curve) -> ClaimTest:
    """Test all accuracies of some curves; the one that agrees least with the claim is judged.

    That is the one whose judged interval lies farthest outside the bounds; if none lies outside, the one whose interval
    leaves the bounds farthest.

    Parameters
    ----------
    *curves : Curve

    Returns
    -------
    callable
        A `ClaimTest`.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        cells = [cell for curve in curves for cell in curve.cells(tables)]
        found = []
        for number, cell in enumerate(cells):
            is_outside = _excess(cell.accuracy, cell.accuracy, lo, hi) > 0
            ends = both_intervals(cell.interval, len(cells) if is_outside else 1)
            apart = _excess(ends["judged_high"], ends["judged_low"], lo, hi)  # above 0 if all of it is outside
            beyond = _excess(ends["judged_low"], ends["judged_high"], lo, hi)
            found.append((max(apart, 0.0), beyond, number, ends))
        *_, number, ends = max(found)
        cell = cells[number]
        ours = f"{cell.accuracy:.3g} at {cell.at:g} m ({cell.seeds} seeds)"
        return ClaimResult(ours=ours, value=cell.accuracy, band=ACCURACY_BAND, **ends)

    return test


def _excess(least: float, most: float, lo: float, hi: float) -> float:
    """Return how far numbers leave their bounds; 0 and 1 are no bounds, for no accuracy lies beyond them."""
    return max(lo - least if lo > 0 else -1.0, most - hi if hi < 1 else -1.0)


def longest_range(*curves: Curve) -> ClaimTest:
    """Test the largest tested distance at which one of the curves has an accuracy of one half or more.

    Parameters
    ----------
    *curves : Curve
        Curves over distance.

    Returns
    -------
    callable
        A `ClaimTest`. The ends of its interval are tested distances, too: the last ones at which the lower and the
        upper end of the accuracy is one half or more.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        of_curves = [curve.cells(tables) for curve in curves]

        def reached(cells: list[Cell], accuracies: Sequence[float]) -> float:
            at = [0.0, *(cell.at for cell in cells)]
            return at[int(last_reached(np.array([accuracies]))[0])]

        def interval(level: float) -> Ends:
            each = [list(zip(*(cell.interval(level) for cell in cells), strict=True)) for cells in of_curves]
            lows, highs = zip(*([reached(cells, e) for e in ends] for cells, ends in zip(of_curves, each, strict=True)),
                              strict=True)  # fmt: skip
            return max(lows), max(highs)

        value = max(reached(cells, [cell.accuracy for cell in cells]) for cells in of_curves)
        return ClaimResult(ours=f"{value:g} m", value=value, **both_intervals(interval, len(curves)))

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
        of_curves = [curve.cells(tables) for curve in curves]

        def ranges(level: float) -> list[tuple[float, float, float]]:
            return [
                range_with_ends(
                    np.array([cell.at for cell in cells]),
                    [cell.accuracy for cell in cells],
                    [cell.interval(level) for cell in cells],
                )
                for cells in of_curves
            ]

        values = [middle for middle, *_ in ranges(LEVEL)]
        return smallest_step(values, lambda level: [(low, high) for _, low, high in ranges(level)], "m")

    return test


def smallest_step(values: Sequence[float], intervals: Callable[[float], Sequence[Ends]], unit: str) -> ClaimResult:
    """Judge numbers that should rise by the step that rises least.

    Parameters
    ----------
    values : sequence of float
        The smallest first.
    intervals : callable
        From a level to the ends of each value's interval.
    unit : str
        Unit of the values.

    Returns
    -------
    ClaimResult
        An order; `value` is the smallest step: the one whose judged interval begins lowest.
    """
    steps = list(pairwise(values))

    def interval_of_step(number: int) -> Interval:
        return lambda level: interval_of_sum([-1, 1], steps[number], intervals(level)[number : number + 2])

    found = [
        both_intervals(interval_of_step(number), len(steps) if then < first else 1)
        for number, (first, then) in enumerate(steps)
    ]
    number = min(range(len(steps)), key=lambda n: (found[n]["judged_high"] >= 0, found[n]["judged_low"]))
    value = steps[number][1] - steps[number][0]
    ours = f"{', '.join(f'{each:.3g}' for each in values)} {unit}; smallest step {value:+.3g}"
    return ClaimResult(ours=ours, value=value, is_order=True, **found[number])


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
        return min(results, key=lambda result: _agreement(result, lo, hi))

    return test


def _agreement(result: ClaimResult, lo: float, hi: float) -> tuple[bool, float]:
    """Return whether a result does not contradict its bounds, and how far inside them its judged interval lies."""
    least, most = result.bounds(lo, hi)
    low, high = result.judged_low or 0.0, result.judged_high or 0.0
    apart = bool(result.broken) or high < least - result.band or low > most + result.band
    return not apart, min(low - least, most - high)
