"""The claims and the trials that judge them, read from their files, and the verdicts as a table to read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

from bicode_studies.claims.beside_null import CLASSES, counts_by_class, summary_line, verdict_text
from bicode_studies.claims.readings import by_reading
from bicode_studies.paper_experiments.results import FIGURES, read_results
from bicode_studies.repository import repository_root

TABLES = (*FIGURES, "13")  # Fig. 13 has no sweep; notebook 13 writes its table

MAX_CELL_LETTERS = 50  # in a column of the terminal's table; JSON and markdown have the whole text
HEAD = """# The paper's claims, judged by our trials

This file is generated: `bicode claims --write`. The claims are in `data/paper_claims.csv`, the trials in `results/`;
[Reading the claims](reading_the_claims.md) says how a sentence of the paper became bounds. One rule judges all of them:

- **reproduced**: the whole interval of our value is within the claim's bounds, or our facts are as the paper says. The
  bounds are widened by what the paper itself cannot tell: 0.02 of an accuracy, 5 % of a region.
- **contradicted**: the whole interval is outside these bounds, or a fact of ours is not as the paper says.
- **undecided**: the interval reaches across a bound, or an order is a tie. The interval that is judged is wider than
  the 95 % one that is shown, since 40 claims are judged by trials.
- **depends on the reading**: the sentence leaves two readings open, a and b, and their verdicts differ.
- **used as stated**: the package or its trials take this value from the paper, so agreement is no evidence.
- **not testable here**: the package has no model of what the claim is about.

What agreement is worth depends on the class of the claim, which `data/README.md` explains; `class_why` in the table of
claims has the reason for each. The *null model* is made of geometry and five numbers, without a sensor and a receiver
(`bicode_studies/claims/null_model.py`), and is judged by the same rule. A claim that it reproduces, too, does not say
that our camera is right.

Accuracies are shares of periods, 0 .. 1. A claim about several conditions shows the one that agrees least by its
interval: where all is read everywhere, this is the one with the fewest seeds.
"""


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


def as_text(judged: pd.DataFrame) -> str:
    """Return the verdicts as a table for the terminal, with the counts of each class below it.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_beside_null`.

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
            "null model": judged["null_model"],
            "class": judged["class"],
            "note": judged["note"].map(_shortened),
        }
    )
    return f"{shown.to_string(index=False)}\n\n{counts_by_class(judged).to_string()}"


def _shortened(text: str) -> str:
    """Cut a text to `MAX_CELL_LETTERS` letters."""
    return text if len(text) <= MAX_CELL_LETTERS else text[: MAX_CELL_LETTERS - 3] + "..."


def as_json(judged: pd.DataFrame) -> str:
    """Return the verdicts as JSON.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_beside_null`.

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
        Rows of `judge_beside_null`.

    Returns
    -------
    str
    """
    head = "| claim | the paper | tested | ours | 95 % | verdict | null model |\n|---|---|---|---|---|---|---|"
    parts = [summary_line(judged), "", *_counts_lines(judged)]
    for label in CLASSES:
        parts += ["", f"## Claims: {label}", "", head, *_lines(judged[judged["class"] == label])]
    rest = judged[~judged["class"].isin(CLASSES)]
    return "\n".join([*parts, "", "## Facts, rules and parameters", "", head, *_lines(rest)])


def as_page(judged: pd.DataFrame) -> str:
    """Return the text of ``docs/claims.md``: what the verdicts mean, and the tables of `as_markdown`.

    Parameters
    ----------
    judged : DataFrame
        Rows of `judge_beside_null`.

    Returns
    -------
    str
    """
    return f"{HEAD}\n{as_markdown(judged)}\n"


def _counts_lines(judged: pd.DataFrame) -> list[str]:
    """Return `counts_by_class` as the lines of a markdown table."""
    counts = counts_by_class(judged)
    rows = [("class", "", *counts.columns), ("---",) * (2 + counts.shape[1])]
    rows += [(*names, *map(str, row)) for names, row in zip(counts.index, counts.to_numpy(), strict=True)]
    return ["| " + " | ".join(row) + " |" for row in rows]


def _lines(judged: pd.DataFrame) -> list[str]:
    """Return the lines of a markdown table."""
    rows = []
    for row in judged.to_dict("records"):
        found = verdict_text(row) + (f" ({row['note']})" if row["note"] else "")
        null = row["null_model"] + (f" ({row['null_ours']})" if row["null_ours"] else "")
        cells = (row["id"], row["claim"], row["tested"], row["ours"], interval_text(row), found, null)
        rows.append("| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |")
    return rows
