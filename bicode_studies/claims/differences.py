"""Tests of claims that compare accuracies: an order of curves, and the mean difference of two.

Seeds of different conditions count as independent. This widens the interval of a difference where the conditions share
some of their chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.stats import norm

from bicode_studies.claims.claim_result import ClaimResult, NoTrials, Tables
from bicode_studies.claims.curves import Cell, Curve
from bicode_studies.claims.statistics import ACCURACY_BAND, FAMILY_LEVEL, ClaimTest, Ends, Interval, both_intervals
from bicode_studies.statistics import interval_of_sum


def accuracy_rises(*levels: Curve) -> ClaimTest:
    """Test that accuracy rises from each curve to the next, at the places that all of them have.

    Accuracies end at 0 and 1, so levels may tie at single places: the mean must rise from the first level to the
    last. No step between neighbouring levels may fall at any place by more than chance; the judged interval of a step
    is widened by the number of steps (Bonferroni).

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
        curves = cells_in_common(tables, *levels)
        value, interval = mean_difference(curves[0], curves[-1])
        neighbours = [pair for both in pairwise(curves) for pair in zip(*both, strict=True)]
        steps = [(then.at, *mean_difference([first], [then])) for first, then in neighbours]
        strict = 1 - (1 - FAMILY_LEVEL) / len(steps)
        falls = [f"{step:+.2g} at {at:g}" for at, step, ends in steps if ends(strict)[1] < 0]
        means = ", ".join(f"{np.mean([cell.accuracy for cell in cells]):.3g}" for cells in curves)
        return ClaimResult(
            ours=f"{means}; rises by {value:+.2g}", value=value, is_order=True, broken=", ".join(falls),
            **both_intervals(interval),
        )  # fmt: skip

    return test


def cells_in_common(tables: Tables, *curves: Curve) -> list[list[Cell]]:
    """Return the cells of curves at the places that all of them have.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows of trials by figure.
    *curves : Curve

    Returns
    -------
    list of list of Cell
        One list for each curve, all over the same places, rising.

    Raises
    ------
    NoTrials
        If the curves have no place in common.
    """
    found = [{cell.at: cell for cell in curve.cells(tables)} for curve in curves]
    places = sorted(set.intersection(*(set(cells) for cells in found)))
    if not places:
        figures = " and ".join(dict.fromkeys(curve.figure for curve in curves))
        raise NoTrials(f"the curves of figure {figures} have no place in common")
    return [[cells[at] for at in places] for cells in found]


def mean_difference(first: Sequence[Cell], then: Sequence[Cell]) -> tuple[float, Interval]:
    """Return the mean accuracy of some cells less that of others, and its interval.

    Parameters
    ----------
    first, then : sequence of Cell
        As many of one as of the other.

    Returns
    -------
    difference : float
        Mean of `then` less that of `first`, -1 .. 1.
    interval : callable
        From a level to the ends of its interval.
    """
    cells = [*first, *then]
    factors = np.repeat([-1.0, 1.0], len(first)) / len(first)
    accuracies = [cell.accuracy for cell in cells]

    def interval(level: float) -> Ends:
        return interval_of_sum(factors, accuracies, [cell.interval(level) for cell in cells])

    return float(factors @ accuracies), interval


def curves_alike(first: Curve, then: Curve, within: float) -> ClaimTest:
    """Test that two curves differ little, by the mean of their absolute differences.

    Chance makes absolute differences larger, never smaller in the mean. So the lower end of the interval allows for as
    large a mean as chance alone makes, with differences that scatter by a normal distribution around 0.

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
        pairs = list(zip(*cells_in_common(tables, first, then), strict=True))
        differences = [mean_difference([a], [b]) for a, b in pairs]
        value = float(np.mean([abs(each) for each, _ in differences]))

        def interval(level: float) -> Ends:
            z = float(norm.ppf((1 + level) / 2))
            halves = np.array([max(d - ends(level)[0], ends(level)[1] - d) for d, ends in differences])
            half = math.sqrt(float(halves @ halves)) / len(pairs)
            by_chance = math.sqrt(2 / math.pi) / z * float(halves.mean())
            return max(value - by_chance - math.sqrt(1 - 2 / math.pi) * half, 0.0), min(value + half, 1.0)

        ours = f"differ by {value:.2g} over {len(pairs)} distances"
        return ClaimResult(
            ours=ours, value=value, lo=0.0, hi=within, band=ACCURACY_BAND, **both_intervals(interval)
        )  # fmt: skip

    return test
