"""How far each receiver reads the ID: its range, and how the ranges of receivers compare."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_studies.robustness.stressors import DISTANCE
from bicode_studies.statistics import ranges_m

DRAWS = 1000  # of the bootstrap


def receiver_ranges(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Return the range of each receiver, see `statistics.ranges_m`, and its ratio to that of the first.

    Parameters
    ----------
    table : DataFrame
        Rows of `stressors.stress` over distance, the paper's receiver first; other stressors are left out.
    rng : numpy.random.Generator
        Chance for the intervals: seeds are drawn with replacement, the same ones for all receivers.

    Returns
    -------
    DataFrame
        One row for each receiver: ``receiver``; ``range_m``, ``low``, ``high``; ``times_paper`` (its range divided by
        that of the first receiver; nan where that is 0), ``times_low``, ``times_high``; counts of ``wrong_ids`` and
        ``periods``. Intervals are of 95 %.
    """
    own = table[table["stressor"] == DISTANCE.name]
    own = own.assign(share=own["right"] / own["periods"])
    receivers = list(dict.fromkeys(own["receiver"]))
    shares = np.stack(
        [own[own["receiver"] == r].pivot(index="seed", columns="level", values="share").to_numpy() for r in receivers]
    )  # receiver, seed, distance
    distances = np.unique(own["level"]).astype(float)
    n_seeds = shares.shape[1]
    drawn = shares[:, rng.integers(n_seeds, size=(DRAWS, n_seeds))].mean(axis=2)  # receiver, draw, distance
    drawn_m = np.array([ranges_m(distances, accuracies) for accuracies in drawn])
    middle_m = ranges_m(distances, shares.mean(axis=1))
    rows = []
    for receiver, middle, draws in zip(receivers, middle_m, drawn_m, strict=True):
        low, high = np.quantile(draws, (0.025, 0.975), method="nearest")
        times = _ratio(draws, drawn_m[0])
        times = times[~np.isnan(times)] if not np.isnan(times).all() else times
        times_low, times_high = np.quantile(times, (0.025, 0.975), method="nearest")
        mine = own[own["receiver"] == receiver]
        rows.append(
            {
                "receiver": receiver, "range_m": middle, "low": low, "high": high,
                "times_paper": float(_ratio(middle, middle_m[0])), "times_low": times_low, "times_high": times_high,
                "wrong_ids": int(mine["wrong_ids"].sum()), "periods": int(mine["periods"].sum()),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _ratio(ranges: npt.ArrayLike, first: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the quotient of ranges; nan where the second is 0."""
    return np.divide(ranges, np.where(np.asarray(first) > 0, first, np.nan))
