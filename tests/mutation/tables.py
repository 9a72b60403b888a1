"""The tables of results: one row for each mutant, and one for each part."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from bicode_studies.statistics import wilson

COLUMNS = ["part", "file", "line", "function", "change", "outcome", "noticed_by", "reason"]
NAME = ["file", "function", "change"]


def mutant_table(rows: Iterable[dict[str, object]], equivalent: Path) -> pd.DataFrame:
    """Return the rows with the reasons why some survivors do what the unchanged code does.

    Parameters
    ----------
    rows : iterable of dict
        With all columns but the reason; the outcome is "noticed" or "survived".
    equivalent : Path
        Table of the reasons: file, function, change, reason.

    Returns
    -------
    DataFrame
        The outcome of a survivor with a reason is "equivalent".
    """
    table = pd.DataFrame(list(rows), columns=COLUMNS[:-1])
    reasons = pd.read_csv(equivalent, keep_default_na=False, dtype=str)
    table = table.merge(reasons, how="left", on=NAME).fillna({"reason": "", "noticed_by": "", "function": ""})
    table.loc[table.outcome == "noticed", "reason"] = ""
    table.loc[(table.outcome == "survived") & (table.reason != ""), "outcome"] = "equivalent"
    return table[COLUMNS]


def score_table(mutants: pd.DataFrame, all_mutants: dict[str, int]) -> pd.DataFrame:
    """Return one row for each part: how many mutants were tried and noticed, and the share with its interval.

    Parameters
    ----------
    mutants : DataFrame
        From `mutant_table`.
    all_mutants : dict
        Number of all mutants of each part.

    Returns
    -------
    DataFrame
        ``score`` is noticed / (noticed + survived), with the 95 % Wilson interval; equivalent ones do not count.
    """
    rows = []
    for part, of_part in mutants.groupby("part", sort=False):
        count = of_part.outcome.value_counts()
        noticed, survived = int(count.get("noticed", 0)), int(count.get("survived", 0))
        row = {"part": part, "all": all_mutants[str(part)], "tried": len(of_part), "noticed": noticed}
        row |= {"survived": survived, "equivalent": int(count.get("equivalent", 0))}
        if noticed + survived:
            low, high = wilson(noticed, noticed + survived)
            row |= {"score": noticed / (noticed + survived), "low": float(low), "high": float(high)}
        rows.append(row)
    return pd.DataFrame(rows).round(3)
