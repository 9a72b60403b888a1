"""Tests of claims about the marker's region in the frames of Fig. 13: its number of lit pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import rows_where
from bicode_studies.claims.statistics import ClaimTest, Ends, both_intervals, smallest_step
from bicode_studies.statistics import Floats, interval_of_mean, interval_of_sum

# A square region of 30 pixels a side has 120 pixels along its outline. Half a pixel on all of them is 6 % of its area,
# so where the marker lies between the pixels changes a region by about as much.
RATIO_BAND = 0.05


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


def _interval_of_logs(factors: npt.ArrayLike, regions: Sequence[Floats], level: float) -> Ends:
    """Return the interval of a sum of the logarithms of mean regions, each times a factor."""
    means = [each.mean() for each in regions]
    ends = np.maximum([interval_of_mean(each, level) for each in regions], 1e-9)  # a region has no less than 0 px
    return interval_of_sum(factors, np.log(means), np.log(ends))


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
        regions = [region_px(tables, panel) for panel in panels]
        means = [float(each.mean()) for each in regions]
        return smallest_step(means, lambda level: [interval_of_mean(each, level) for each in regions], "px")

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
        a, b = region_px(tables, above), region_px(tables, below)
        value = float(a.mean() / b.mean())

        def interval(level: float) -> Ends:
            low, high = np.exp(_interval_of_logs([1, -1], [a, b], level)).tolist()
            return low, high

        ours = f"{a.mean():.4g} px / {b.mean():.4g} px = {value:.3g}"
        return ClaimResult(ours=ours, value=value, band=RATIO_BAND * value, **both_intervals(interval))

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
        regions = [region_px(tables, panel) for panel in panels]
        factors = logs / (logs @ logs)
        value = float(factors @ np.log([each.mean() for each in regions]))
        listed = ", ".join(f"{each.mean():.3g}" for each in regions)
        return ClaimResult(
            ours=f"{listed} px; exponent {value:.3g}", value=value, band=RATIO_BAND * value,
            **both_intervals(lambda level: _interval_of_logs(factors, regions, level)),
        )  # fmt: skip

    return test
