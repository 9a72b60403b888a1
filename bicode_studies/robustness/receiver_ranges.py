"""How far each receiver reads the ID: its range, and how the ranges of receivers compare."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bicode_studies.robustness.stressors import DISTANCE
from bicode_studies.statistics import interval_of_sum, range_over_seeds

Range = tuple[float, float, float]


def receiver_ranges(table: pd.DataFrame) -> pd.DataFrame:
    """Return the range of each receiver, see `statistics.ranges_m`, and its ratio to that of the first.

    All receivers read the same recordings, but the intervals of the ratios take their ranges as independent. So they
    are wider than they need be.

    Parameters
    ----------
    table : DataFrame
        Rows of `stressors.stress` over distance, the paper's receiver first; other stressors are left out.

    Returns
    -------
    DataFrame
        One row for each receiver: ``receiver``; ``range_m``, ``low``, ``high``; ``times_paper`` (its range divided by
        that of the first receiver; nan where that is 0), ``times_low``, ``times_high``; counts of ``wrong_ids`` and
        ``periods``. Intervals are of 95 %.
    """
    own = table[table["stressor"] == DISTANCE.name]
    rows, first = [], None
    for receiver, mine in own.groupby("receiver", sort=False):
        range_m = range_over_seeds(mine, "right", "level")
        times = _ratio(range_m, first) if first else (1.0, 1.0, 1.0) if range_m[0] else (np.nan, np.nan, np.nan)
        first = first or range_m
        rows.append(
            {
                "receiver": receiver, **dict(zip(("range_m", "low", "high"), range_m, strict=True)),
                **dict(zip(("times_paper", "times_low", "times_high"), times, strict=True)),
                "wrong_ids": int(mine["wrong_ids"].sum()), "periods": int(mine["periods"].sum()),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _ratio(of: Range, to: Range) -> Range:
    """Return the quotient of two ranges with its interval, from the difference of their logarithms."""
    if not (of[0] and to[0]):
        return (0.0, 0.0, np.nan) if to[0] else (np.nan, np.nan, np.nan)
    with np.errstate(divide="ignore"):  # the lower end of a range may be 0
        logs = np.log([of, to])
    low, high = interval_of_sum([1, -1], logs[:, 0], logs[:, 1:])
    return of[0] / to[0], float(np.exp(low)), float(np.exp(high))
