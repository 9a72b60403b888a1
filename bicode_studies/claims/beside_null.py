"""The verdicts on our trials beside those on the null model, and how many of each class of claims come out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from bicode_studies.claims.claim_result import Tables
from bicode_studies.claims.null_model import null_tables
from bicode_studies.claims.readings import DEPENDS, by_reading
from bicode_studies.claims.verdicts import REPRODUCED, VERDICTS, judge_claims

NOT_ASKED = "not asked"
CLASSES = ("tests the model", "follows from a fit", "calibrated on")
"""The classes of numbers and orders."""


def judge_beside_null(claims: pd.DataFrame, tables: Tables) -> pd.DataFrame:
    """Judge claims by the trials, and numbers and orders by the null model, too.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, or some of its rows, all columns as text.
    tables : mapping of str to DataFrame
        Rows of trials by figure.

    Returns
    -------
    DataFrame
        Rows of `judge_claims` with ``null_ours``, ``null_verdict`` and ``null_model``: what the null model finds, the
        verdict on it, and this with those on its readings. The null model is not asked about facts.
    """
    judged = judge_claims(claims, tables)
    asked = judge_claims(claims[claims["class"].isin(CLASSES)], null_tables()).set_index("id")
    words = pd.Series([verdict_text(row) for row in asked.to_dict("records")], asked.index, dtype=object)
    return judged.assign(
        null_ours=judged["id"].map(asked["ours"]).fillna(""),
        null_verdict=judged["id"].map(asked["verdict"]).fillna(NOT_ASKED),
        null_model=judged["id"].map(words).fillna(NOT_ASKED),
    )


def verdict_text(row: Mapping[Any, Any]) -> str:
    """Return the verdict on a claim, with those on its readings where these differ.

    Parameters
    ----------
    row : mapping
        A row of `judge_claims`.

    Returns
    -------
    str
    """
    if row["verdict"] != DEPENDS:
        return str(row["verdict"])
    return f"{DEPENDS}: {by_reading([row['verdict_a'], row['verdict_b']])}"


def counts_by_class(judged: pd.DataFrame) -> pd.DataFrame:
    """Count the verdicts on numbers and orders, class by class, ours and the null model's.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_beside_null`.

    Returns
    -------
    DataFrame
        Two rows for each class, "ours" and "null model"; a column for each verdict that occurs, and ``all``.
    """
    measured = judged[judged["class"].isin(CLASSES)]
    parts = {
        (label, who): measured.loc[measured["class"] == label, column].value_counts()
        for label in CLASSES
        for who, column in (("ours", "verdict"), ("null model", "null_verdict"))
    }
    counts = pd.DataFrame(parts).T.reindex(columns=VERDICTS).fillna(0).astype(int)
    counts = counts.loc[:, (counts > 0).any()]
    return counts.assign(all=counts.sum(axis=1)).rename_axis(index=["class", ""], columns="")


def summary_line(judged: pd.DataFrame) -> str:
    """Return in one line how many claims that test the model come out, by our trials and by the null model.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_beside_null`.

    Returns
    -------
    str
    """
    counts = counts_by_class(judged).reindex(columns=VERDICTS, fill_value=0).T
    ours, null = counts[CLASSES[0], "ours"], counts[CLASSES[0], "null model"]
    return (
        f"Of the {ours.sum()} statements of the paper that test the simulation, it reproduces {ours[REPRODUCED]} "
        f"({ours[DEPENDS]} more in one of two readings); a model without sensor and receiver reproduces "
        f"{null[REPRODUCED]} ({null[DEPENDS]} more)."
    )
