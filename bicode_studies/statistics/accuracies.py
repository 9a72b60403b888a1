"""Accuracies of conditions with their intervals over seeds, from tables of trials."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bicode_studies.statistics.intervals import LEVEL
from bicode_studies.statistics.ranges import range_with_ends
from bicode_studies.statistics.seeds import interval_over_seeds


def over_seeds(table: pd.DataFrame, by: list[str], right: str = "id_right") -> pd.DataFrame:
    """Return the accuracy of each condition with its 95 % interval over seeds.

    Parameters
    ----------
    table : DataFrame
        One row for each trial: the columns `by`, ``periods`` (count), and `right` (count of right periods).
        Trials without periods are left out.
    by : list of str
        Columns that tell conditions apart.
    right : str
        Column that counts right periods.

    Returns
    -------
    DataFrame
        One row for each condition, in the order of the table: the columns `by`; ``seeds`` and ``periods`` (counts);
        ``accuracy``, the mean of the seeds' shares; ``low`` and ``high``, see `interval_over_seeds`.
    """
    seen = table[table["periods"] > 0]
    rows = []
    for key, group in seen.groupby(by, sort=False, dropna=False):
        counts, periods = group[right].to_numpy(float), group["periods"].to_numpy(int)
        low, high = interval_over_seeds(counts, periods)
        accuracy = float((counts / periods).mean())
        numbers = {"seeds": len(group), "periods": periods.sum(), "accuracy": accuracy, "low": low, "high": high}
        rows.append({**dict(zip(by, key, strict=True)), **numbers})
    return pd.DataFrame(rows, columns=[*by, "seeds", "periods", "accuracy", "low", "high"])


def accuracy_curves(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Return the accuracy curves of the blinker and of the 2D marker from the trials of an experiment.

    Parameters
    ----------
    table : DataFrame
        As `over_seeds` takes it, with ``receiver``, ``frame_rule_2d``, ``id_right`` and ``marker_2d_right``.
    by : list of str
        Columns that tell conditions apart, ``distance_m`` among them.

    Returns
    -------
    DataFrame
        ``kind`` ("blinker" or "2d"), ``receiver``, ``frame_rule_2d``, and the columns of `over_seeds`.
    """
    both = {"blinker": "id_right", "2d": "marker_2d_right"}
    keys = ["receiver", "frame_rule_2d", *by]
    parts = [over_seeds(table, keys, right).assign(kind=kind) for kind, right in both.items()]
    curves = pd.concat(parts, ignore_index=True)
    return curves[["kind", *curves.columns.drop("kind")]]


def range_over_seeds(
    table: pd.DataFrame, right: str, distance: str = "distance_m", level: float = LEVEL
) -> tuple[float, float, float]:
    """Return the range of a curve with its interval over seeds.

    Parameters
    ----------
    table : DataFrame
        One row for each trial of one curve: ``periods`` (count), and the columns `right` and `distance`.
    right : str
        Column that counts right periods.
    distance : str
        Column of the distances [m].
    level : float
        Level of the interval.

    Returns
    -------
    range_m, low_m, high_m : float
        As `range_with_ends` returns them [m].
    """
    at = np.unique(table[distance].to_numpy(float))
    groups = [table[table[distance] == each] for each in at]
    cells = [(group[right].to_numpy(float), group["periods"].to_numpy(float)) for group in groups]
    ends = [interval_over_seeds(k, n, level) for k, n in cells]
    return range_with_ends(at, [float((k / n).mean()) for k, n in cells], ends)
