"""What the trials say of a claim.   curves -> a number of ours with its interval

A *curve* is a figure's trials at one condition, over distance. Of curves are taken

    worst     the accuracy that is furthest from what the claim says of all of them
    longest   the largest tested distance with accuracy >= 0.5
    further   orders of ranges: by how much the interpolated 50 % distances rise, at the smallest step
    better    orders of accuracies: by how much accuracy rises from the first level to the last, mean over
              the places (distances, speeds) that all levels have
    alike     the mean difference of two curves, its sign left out

Intervals are 95 %, by a bootstrap over seeds: of each condition as many seeds as it has are drawn, with
repetition, 2000 times. Seeds of different conditions are drawn apart, which widens the interval of a difference
where they have something in common.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from bicode_studies.claims.curves import Answer, Curve, Floats, NoTrials, Tables
from bicode_studies.statistics import bootstrap

HALF = 0.5  # a range ends where accuracy falls below it

Test = Callable[[Tables, float, float], Answer]
"""Tables and the claim's bounds in, our answer out."""


def worst(*curves: Curve) -> Test:
    """Curves in; a test of all their accuracies out, which answers with the one that agrees least."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        found = []
        for curve in curves:
            for cell in curve.cells(tables):
                low, high = bootstrap(cell.shares, cell.periods, rng)
                told = f"{cell.accuracy:.3g} at {cell.distance_m:g} m ({cell.shares.size} seeds)"
                value = cell.accuracy
                found.append((_beyond(value, value, lo, hi), _beyond(low, high, lo, hi), told, value, low, high))
        _, _, told, value, low, high = max(found)
        return Answer(ours=told, value=value, low=low, high=high)

    return test


def _beyond(low: float, high: float, lo: float, hi: float) -> float:
    """How far an accuracy's ends are outside of bounds; 0 and 1 bound nothing, for no accuracy is beyond them."""
    return max(lo - low if lo > 0 else -1.0, high - hi if hi < 1 else -1.0)


def longest(*curves: Curve) -> Test:
    """Curves in; a test of the largest tested distance that one of them reaches out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        found = []
        for curve in curves:
            cells = curve.cells(tables)
            at = np.array([0.0, *(cell.distance_m for cell in cells)])
            reached = _reached(np.column_stack([cell.draws(rng) for cell in cells]))
            low, high = np.quantile(at[reached], [0.025, 0.975], method="closest_observation")
            value = at[_reached(np.array([[cell.accuracy for cell in cells]]))[0]]
            found.append((float(value), float(low), float(high)))
        value, low, high = max(found)
        return Answer(ours=f"{value:g} m", value=value, low=low, high=high)

    return test


def _reached(accuracies: Floats) -> npt.NDArray[np.int64]:
    """Accuracies over rising distance, shape (n, distances), in; how many distances lie within the range out, (n,)."""
    above = accuracies >= HALF
    return np.asarray(np.where(above.any(axis=1), above.shape[1] - above[:, ::-1].argmax(axis=1), 0))


def half_distances(at_m: Floats, accuracies: Floats) -> Floats:
    """Rising distances, shape (d,), and accuracies, shape (n, d), in; where each falls below one half out, (n,) [m].

    Straight lines are drawn from the last distance with an accuracy of one half or more to the next; 0 where there
    is none, the last distance where there is none behind.

    Examples
    --------
    >>> half_distances(np.array([1.0, 2.0, 4.0]), np.array([[1, 0.75, 0.25], [1, 1, 0.6], [0.2, 0.1, 0]]))
    array([3., 4., 0.])
    """
    n = _reached(accuracies)
    rows = np.arange(len(accuracies))
    inner = (n > 0) & (n < at_m.size)
    here, there = np.maximum(n - 1, 0), np.minimum(n, at_m.size - 1)
    above, below = accuracies[rows, here], accuracies[rows, there]
    step = np.where(inner, (above - HALF) / np.where(inner, above - below, 1), 0)
    return np.asarray(np.where(n > 0, at_m[here] + step * (at_m[there] - at_m[here]), 0.0))


def further(*curves: Curve) -> Test:
    """Curves, the shortest range first, in; a test of that order out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        values, draws = [], []
        for curve in curves:
            cells = curve.cells(tables)
            at = np.array([cell.distance_m for cell in cells])
            values.append(half_distances(at, np.array([[cell.accuracy for cell in cells]])))
            draws.append(half_distances(at, np.column_stack([cell.draws(rng) for cell in cells])))
        return rising([float(value[0]) for value in values], draws, "m")

    return test


def rising(values: Sequence[float], draws: Sequence[Floats], unit: str) -> Answer:
    """Numbers that should rise, and draws of each, in; the answer, judged by the step that rises least, out."""
    steps = []
    for (first, then), (drawn_first, drawn_then) in zip(pairwise(values), pairwise(draws), strict=True):
        low, high = np.quantile(drawn_then - drawn_first, [0.025, 0.975])
        steps.append((float(low), then - first, float(high)))
    low, value, high = min(steps)
    return Answer(
        ours=f"{', '.join(f'{value:.3g}' for value in values)} {unit}; least step {value:+.3g}",
        value=value, low=low, high=high, is_order=True,
    )  # fmt: skip


def better(*levels: Curve) -> Test:
    """Curves, the one of the lowest accuracy first, in; a test of that order at the places they share out.

    Accuracies end at 0 and 1, so levels may tie at single places: what must rise is the mean, from the first
    level to the last. But no step between neighbouring levels may fall at any place, beyond an interval wide
    enough that it happens by chance in 5 % of all such tests (Bonferroni).
    """

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        curves = [{cell.distance_m: cell for cell in level.cells(tables)} for level in levels]
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
        return Answer(
            ours=f"{means}; rises by {value:+.2g}", value=value, low=float(low), high=float(high),
            is_order=True, broken=", ".join(falls),
        )  # fmt: skip

    return test


def alike(first: Curve, then: Curve, within: float) -> Test:
    """Two curves and a difference in; a test that they differ by no more, mean over distances, out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        a, b = ({cell.distance_m: cell for cell in curve.cells(tables)} for curve in (first, then))
        places = sorted(set(a) & set(b))
        if not places:
            raise NoTrials(f"figures {first.figure} and {then.figure} have no distance in common")
        value = float(np.mean([abs(a[at].accuracy - b[at].accuracy) for at in places]))
        drawn = np.mean([np.abs(a[at].draws(rng) - b[at].draws(rng)) for at in places], axis=0)
        low, high = np.quantile(drawn, [0.025, 0.975])
        told = f"differ by {value:.2g} over {len(places)} distances"
        return Answer(ours=told, value=value, low=float(low), high=float(high), lo=0.0, hi=within)

    return test


def all_of(*tests: Test) -> Test:
    """Tests of one claim in; one that answers with the answer that agrees least out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        answers = [each(tables, lo, hi) for each in tests]
        return min(answers, key=lambda answer: (not answer.broken, _margin(answer, lo, hi)))

    return test


def _margin(answer: Answer, lo: float, hi: float) -> float:
    """How far inside its bounds an answer's value lies; for orders, the lower end of its interval."""
    if answer.is_order:
        return answer.low or 0.0
    least, most = (lo if answer.lo is None else answer.lo), (hi if answer.hi is None else answer.hi)
    value = answer.value or 0.0
    return min(value - least, most - value)
