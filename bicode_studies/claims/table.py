"""The claims and the trials that judge them, read from their files, and the verdicts as a table to read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

from bicode_studies.claims.readings import DEPENDS, by_reading
from bicode_studies.claims.verdicts import VERDICTS, count_verdicts
from bicode_studies.paper_experiments.results import FIGURES, read_results
from bicode_studies.repository import repository_root

TABLES = (*FIGURES, "13")  # Fig. 13 has no sweep; notebook 13 writes its table

MAX_CELL_LETTERS = 50  # in a column of the terminal's table; JSON and markdown have the whole text
HEAD = """# The paper's claims, judged by our trials

This file is generated: `bicode claims --write`. The claims are in `data/paper_claims.csv`, the trials in `results/`;
[Reading the claims](reading_the_claims.md) says how a sentence of the paper became bounds. One rule judges all of them:

- **reproduced**: our value is within the claim's bounds, or our facts and orders are as the paper says.
- **contradicted**: our value and its whole 95 % interval are outside the bounds.
- **undecided**: our value is outside, but its interval reaches the bounds; or an order is a tie.
- **depends on the reading**: the sentence leaves two readings open, a and b, and their verdicts differ.
- **used as stated**: the package or its trials take this value from the paper, so agreement is no evidence.
- **not testable here**: the package has no model of what the claim is about.

What agreement is worth depends on the class of the claim, which `data/README.md` explains; `class_why` in the table of
claims has the reason for each.
"""
CLASSES = ("tests the model", "follows from a fit", "calibrated on")
"""The classes of numbers and orders."""


def read_claims() -> pd.DataFrame:
    """Read the paper's claims.

    Returns
    -------
    DataFrame
        ``data/paper_claims.csv`` of the repository, one row for each claim, all columns as text.
    """
    path = repository_root() / "data" / "paper_claims.csv"
    return pd.read_csv(path, dtype=str, keep_default_na=False)


def read_trials(quick: bool) -> dict[str, pd.DataFrame]:
    """Read the trials that judge the claims.

    Parameters
    ----------
    quick : bool
        True for the short trials, False for those at the paper's scale.

    Returns
    -------
    dict of str to DataFrame
        Rows of trials by figure, "08" .. "14"; a figure without a table is left out.
    """
    return {figure: table for figure in TABLES if (table := read_results(figure, quick)) is not None}


def missing_line(found: set[str], quick: bool) -> str:
    """Say which tables of trials are missing and which command makes them.

    Parameters
    ----------
    found : set of str
        Figures that have a table.
    quick : bool
        True for the short trials.

    Returns
    -------
    str
        One line; empty if none is missing.
    """
    missing = sorted({*TABLES} - found)
    if not missing:
        return ""
    folder = "quick/" if quick else ""
    names = (f"results/{folder}{each}.csv" for each in missing)
    made = "; ".join(f"bicode figures{'' if quick else ' --full'} --only {figure}" for figure in missing)
    return f"missing: {', '.join(names)}; claims of these figures have no trials yet; make the tables with: {made}"


def interval_text(row: Mapping[Any, Any]) -> str:
    """Return the 95 % interval of a claim in words.

    Parameters
    ----------
    row : mapping
        A row of `judge_claims`.

    Returns
    -------
    str
        One for each reading; empty if the row has no interval.
    """
    ends = [(row[f"low_{name}"], row[f"high_{name}"]) for name in "ab"]
    return by_reading([f"{low:.3g} .. {high:.3g}" for low, high in ends if pd.notna(low)] or [""])


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


def as_text(judged: pd.DataFrame) -> str:
    """Return the verdicts as a table for the terminal, with the counts below it.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_claims`.

    Returns
    -------
    str
    """
    shown = pd.DataFrame(
        {
            "id": judged["id"],
            "claim": judged["claim"].map(_shortened),
            "tested": judged["tested"].map(_shortened),
            "ours": judged["ours"],
            "95 %": [interval_text(row) for row in judged.to_dict("records")],
            "verdict": [verdict_text(row) for row in judged.to_dict("records")],
            "class": judged["class"],
            "note": judged["note"].map(_shortened),
        }
    )
    return f"{shown.to_string(index=False)}\n\n{count_verdicts(judged).to_string()}"


def _shortened(text: str) -> str:
    """Cut a text to `MAX_CELL_LETTERS` letters."""
    return text if len(text) <= MAX_CELL_LETTERS else text[: MAX_CELL_LETTERS - 3] + "..."


def as_json(judged: pd.DataFrame) -> str:
    """Return the verdicts as JSON.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_claims`.

    Returns
    -------
    str
        A list of objects; null where a number does not apply.
    """
    finite = judged.replace([math.inf, -math.inf], math.nan)
    return str(finite.to_json(orient="records", indent=1, force_ascii=False))


def as_markdown(judged: pd.DataFrame) -> str:
    """Return the verdicts as markdown: the counts, a table for each class of numbers and orders, and one of the facts.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_claims`.

    Returns
    -------
    str
    """
    head = "| claim | the paper | tested | ours | 95 % | verdict |\n|---|---|---|---|---|---|"
    parts = [headline(judged)]
    for label in CLASSES:
        parts += ["", f"## Claims: {label}", "", head, *_lines(judged[judged["class"] == label])]
    rest = judged[~judged["class"].isin(CLASSES)]
    return "\n".join([*parts, "", "## Facts, rules and parameters", "", head, *_lines(rest)])


def as_page(judged: pd.DataFrame) -> str:
    """Return the text of ``docs/claims.md``: what the verdicts mean, and the tables of `as_markdown`.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_claims`.

    Returns
    -------
    str
    """
    return f"{HEAD}\n{as_markdown(judged)}\n"


def headline(judged: pd.DataFrame) -> str:
    """Return in words how many claims of each class have each verdict.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_claims`.

    Returns
    -------
    str
        One line of markdown for each class of numbers and orders.
    """
    lines = []
    for label in CLASSES:
        counts = judged.loc[judged["class"] == label, "verdict"].value_counts()
        listed = ", ".join(f"{counts[each]} {each}" for each in VERDICTS if each in counts)
        lines.append(f"- **{label}**, {counts.sum()} claims: {listed}.")
    return "\n".join(lines)


def _lines(judged: pd.DataFrame) -> list[str]:
    """Return the lines of a markdown table."""
    rows = []
    for row in judged.to_dict("records"):
        found = verdict_text(row) + (f" ({row['note']})" if row["note"] else "")
        cells = (row["id"], row["claim"], row["tested"], row["ours"], interval_text(row), found)
        rows.append("| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |")
    return rows
