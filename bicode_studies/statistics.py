"""Trials of an experiment -> its curves, accuracy over distance, with intervals over seeds."""

from __future__ import annotations

import pandas as pd

from bicode_studies.score import over_seeds


def curves_of(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Rows of an experiment's trials in, all its curves out: `over_seeds` of the blinker and of the 2D marker.

    Parameters
    ----------
    table : DataFrame
        As `over_seeds` takes it, with ``receiver``, ``frame_rule_2d``, ``id_right`` and ``marker_2d_right``.
    by : list of str
        Columns that tell conditions apart, ``distance_m`` among them.

    Returns
    -------
    DataFrame
        What `over_seeds` gives, behind ``kind`` ("blinker" or "2d"), ``receiver`` and ``frame_rule_2d``.
    """
    both = {"blinker": "id_right", "2d": "marker_2d_right"}
    keys = ["receiver", "frame_rule_2d", *by]
    parts = [over_seeds(table, keys, right).assign(kind=kind) for kind, right in both.items()]
    return pd.concat(parts, ignore_index=True)[["kind", *parts[0].columns.drop("kind")]]
