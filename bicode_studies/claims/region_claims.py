"""Tests of claims about the marker's region in the frames of Fig. 13: its number of lit pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import rows_where
from bicode_studies.claims.statistics import ClaimTest, smallest_step
from bicode_studies.statistics import DRAWS, Floats


def region_px(tables: Tables, panel: str) -> Floats:
    """Return the marker's region in a frame of Fig. 13.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows of trials by figure.
    panel : str
        "a" .. "k".

    Returns
    -------
    ndarray, shape (seeds,)
        Number of pixels.
    """
    return rows_where(tables, "13", {"panel": panel}).sort_values("seed")["region_px"].to_numpy(float)


def _drawn_means(values: Floats, rng: np.random.Generator) -> Floats:
    """Draw values with replacement and return the mean of each draw, shape (DRAWS,)."""
    return np.asarray(rng.choice(values, (DRAWS, values.size)).mean(axis=1))


def region_rises(*panels: str) -> ClaimTest:
    """Test that the marker's region grows from panel to panel of Fig. 13.

    Parameters
    ----------
    *panels : str
        "a" .. "k", the one with the smallest region first.

    Returns
    -------
    callable
        A `ClaimTest`.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        regions = [region_px(tables, panel) for panel in panels]
        return smallest_step([float(each.mean()) for each in regions], [_drawn_means(r, rng) for r in regions], "px")

    return test


def region_ratio(above: str, below: str) -> ClaimTest:
    """Test the ratio of the marker's regions in two panels of Fig. 13.

    Parameters
    ----------
    above, below : str
        Panels of the numerator and of the denominator, "a" .. "k".

    Returns
    -------
    callable
        A `ClaimTest`.
    """

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        a, b = region_px(tables, above), region_px(tables, below)
        low, high = np.quantile(_drawn_means(a, rng) / _drawn_means(b, rng), [0.025, 0.975])
        value = float(a.mean() / b.mean())
        ours = f"{a.mean():.4g} px / {b.mean():.4g} px = {value:.3g}"
        return ClaimResult(ours=ours, value=value, low=float(low), high=float(high))

    return test


def region_exponent(panels: Sequence[str], sizes: Sequence[float]) -> ClaimTest:
    """Test the exponent k in: region proportional to size^k.

    Parameters
    ----------
    panels : sequence of str
        Panels of Fig. 13, "a" .. "k".
    sizes : sequence of float
        What the region is compared with, for each panel: the plate's side [m] or its area [m2].

    Returns
    -------
    callable
        A `ClaimTest`; the exponent is the slope of the straight line through the logarithms (least squares).
    """
    logs = np.log(sizes) - np.mean(np.log(sizes))

    def test(tables: Tables, lo: float, hi: float) -> ClaimResult:
        rng = np.random.default_rng(0)
        regions = [region_px(tables, panel) for panel in panels]
        drawn = np.log([_drawn_means(each, rng) for each in regions])
        value = float(logs @ np.log([each.mean() for each in regions]) / (logs @ logs))
        low, high = np.quantile(logs @ drawn / (logs @ logs), [0.025, 0.975])
        listed = ", ".join(f"{each.mean():.3g}" for each in regions)
        return ClaimResult(
            ours=f"{listed} px; exponent {value:.3g}", value=value, low=float(low), high=float(high)
        )  # fmt: skip

    return test
