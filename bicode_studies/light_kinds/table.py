"""The table of names: what lights of each kind and rate were taken for, with intervals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from bicode_studies.light_kinds.trials import conditions, name_once
from bicode_studies.statistics import wilson
from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.sweep import CONSTANTS, sweep

SEEDS = 20
TABLE, CONFUSION = "light_names.csv", "light_names_confusion.csv"
CONDITION = ["kind", "rate_hz", "duty", "depth", "events_per_edge", "distance_m"]


def make_table(
    path: Path, *, seeds: int = SEEDS, store: Path | None = None, jobs: int | None = None, cluster: str | None = None
) -> pd.DataFrame:
    """Name every light of the table, and write one row for each.

    Parameters
    ----------
    path : Path
        File of the table; it is written when all lights are named.
    seeds : int
        Lights of each condition.
    store, jobs, cluster
        See `sweep.sweep`.

    Returns
    -------
    DataFrame

    Raises
    ------
    RuntimeError
        If trials fail; the others are kept in the store.
    """
    trials = [(condition, seed) for seed in range(seeds) for condition in conditions()]
    result = sweep(name_once, trials, store, jobs=jobs, cluster=cluster, data_files=CONSTANTS)
    if result.failures:
        raise RuntimeError(result.failure_line())
    table = result.table.assign(digest=digest_of(name_once, CONSTANTS))
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, lineterminator="\n", float_format="%.4g")
    return table


def confusion(table: pd.DataFrame) -> pd.DataFrame:
    """Count what the lights of each condition were named.

    Parameters
    ----------
    table : DataFrame
        See `make_table`.

    Returns
    -------
    DataFrame
        One row for each condition: its columns; ``lights``; ``median_events`` of one light; ``right`` with its 95 %
        interval (Wilson); ``wrong``, named as something else with certainty (no light is not such a name); and the
        number of each name.
    """
    rows: list[dict[Any, Any]] = []
    for _, part in table.groupby(CONDITION, sort=False):
        condition: dict[Any, Any] = part.iloc[0][CONDITION].to_dict()
        n, right = len(part), int(part["right"].sum())
        low, high = wilson(right, n)
        named = ~part["name"].isin(["unknown", "none", "noise"])
        rows.append(
            {
                **condition,
                "lights": n, "median_events": float(part["n_events"].median()),
                "right": right / n, "right_low": low, "right_high": high,
                "wrong": float((named & ~part["right"].astype(bool)).mean()), **part["name"].value_counts().to_dict(),
            }
        )  # fmt: skip
    return pd.DataFrame(rows).fillna(0)
