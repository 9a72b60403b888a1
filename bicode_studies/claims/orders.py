"""Tests of orders of curves at each place or in the mean, and of pairs of curves that should differ little."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from bicode_studies.claims.claim_result import ClaimResult, NoTrials, Tables
from bicode_studies.claims.curves import Curve
from bicode_studies.claims.differences import accuracy_rises, curves_alike, mean_difference
from bicode_studies.claims.statistics import FAMILY_LEVEL, ClaimTest, both_intervals

NOTHING = 0.005  # an accuracy up to this is one of nothing read: the paper counts about 200 periods for each condition


def rises_at_each(*levels: Curve) -> ClaimTest:
    """Test that accuracy rises from the first curve to the last at each place; the one that agrees least is judged.

    Parameters
    ----------
    *levels : Curve
        Curves over the same column, the lowest accuracy first. Places at which even the last one reads nothing
        (`NOTHING`) are left out, since nothing can fall from there.

    Returns
    -------
    callable
        A `ClaimTest`. It raises `NoTrials` if nothing is read anywhere.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        places = [cell.at for cell in levels[-1].cells(tables) if cell.accuracy > NOTHING]
        if not places:
            raise NoTrials(f"figure {levels[-1].figure} has no place at which anything is read")
        steps = accuracy_rises(*levels)(tables, lo, hi)  # its single steps are judged with regard to their number
        each = [accuracy_rises(*(level.narrowed(**{level.by: at}) for level in levels)) for at in places]
        results = [
            replace(found, ours=f"{found.ours} at {at:g}", broken=steps.broken)
            for at, found in ((at, test(tables, lo, hi)) for at, test in zip(places, each, strict=True))
        ]
        return min(results, key=lambda result: (result.judged_low or 0.0, result.value or 0.0))

    return test


def most_different(*pairs: tuple[Curve, Curve]) -> ClaimTest:
    """Test that two curves of each pair differ little; the pair that differs most is judged.

    Parameters
    ----------
    *pairs : tuple of 2 Curve

    Returns
    -------
    callable
        A `ClaimTest`; the claim's upper bound is the largest mean difference of accuracy that agrees.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        results = [curves_alike(first, then, hi)(tables, lo, hi) for first, then in pairs]
        return max(results, key=lambda result: result.value or 0.0)

    return test


def mean_rises(*levels: Curve) -> ClaimTest:
    """Test that the mean accuracy over the places rises from the first curve to the last.

    Parameters
    ----------
    *levels : Curve
        Curves over the same places, the lowest accuracy first.

    Returns
    -------
    callable
        A `ClaimTest`. No step of the mean from one curve to the next may fall by more than chance; what happens at a
        single place does not count.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        curves = [level.cells(tables) for level in levels]
        means = [float(np.mean([cell.accuracy for cell in cells])) for cells in curves]
        steps = [mean_difference(first, then) for first, then in pairwise(curves)]
        strict = 1 - (1 - FAMILY_LEVEL) / len(steps)
        falls = [f"{step:+.2g} in the mean" for step, interval in steps if interval(strict)[1] < 0]
        value, interval = mean_difference(curves[0], curves[-1])
        return ClaimResult(
            ours=f"{', '.join(f'{mean:.3g}' for mean in means)}; rises by {value:+.2g}", value=value,
            is_order=True, broken=", ".join(falls), **both_intervals(interval),
        )  # fmt: skip

    return test
