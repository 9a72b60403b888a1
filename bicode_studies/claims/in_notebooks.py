"""What a notebook on a figure of section IV ends with: the constants that were fitted, and its claims with verdicts."""

from __future__ import annotations

import pandas as pd

from bicode_lab.constants import all_constants
from bicode_studies.claims.points import stated_points
from bicode_studies.claims.table import interval_text, read_claims, read_trials, verdict_text
from bicode_studies.claims.verdicts import judge_claims


def points_of(figure: str, by: str, levels: list[float], band: str = "") -> pd.DataFrame:
    """Return the points that the paper states for a figure.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    by : str
        The column that tells the figure's curves apart.
    levels : list of float
        The curves' values of `by`.
    band : str, optional
        "red" or "infrared", for the claims about light of this band only.

    Returns
    -------
    DataFrame
        Rows of `bicode_studies.claims.points.stated_points`.
    """
    claims = read_claims()
    return stated_points(claims[claims["band"] == band] if band else claims, figure, by, levels)


def claims_of(figure: str, table: pd.DataFrame, quick: bool) -> pd.DataFrame:
    """Judge the claims of a figure by its trials, with the rule of ``bicode claims``.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    table : DataFrame
        The rows of the figure's trials.
    quick : bool
        True where these are the short trials. Other figures that a claim refers to are taken from the tables of the
        same scale, if these have been made before.

    Returns
    -------
    DataFrame
        One row for each number and order of the figure: its class, the paper's words, what is tested, our finding
        with its 95 % interval, verdict and note.
    """
    claims = read_claims()
    is_of = claims["id"].str.startswith(f"F{int(figure)}.") | claims["figure"].str.match(rf"{int(figure)}[a-k]")
    mine = claims[is_of & claims["kind"].isin(["number", "order"])]
    judged = judge_claims(mine, {**read_trials(quick), figure: table})
    rows = judged.to_dict("records")
    shown = judged[["id", "class", "claim", "tested", "ours"]].assign(
        interval=[interval_text(row) for row in rows], verdict=[verdict_text(row) for row in rows], note=judged["note"]
    )
    return shown.rename(columns={"claim": "the paper", "interval": "95 %"}).set_index("id")


def fitted_for(figure: str) -> pd.DataFrame:
    """List the constants of ``constants.csv`` that were fitted to the paper.

    Parameters
    ----------
    figure : str
        "08" .. "14".

    Returns
    -------
    DataFrame
        One row for each constant: value, unit, range, what it was fitted to, whether that is this figure, and what the
        constant is.
    """
    number = int(figure)
    rows = []
    for each in all_constants().values():
        if not each.fitted_to:
            continue
        is_own = each.fitted_to == f"Fig. {number}" or each.fitted_to.startswith(f"F{number}.")
        rows.append(
            (each.name, each.value, each.unit, f"{each.low:g} .. {each.high:g}", each.fitted_to, is_own, each.source)
        )
    columns = ["constant", "value", "unit", "range", "fitted to", "of this figure", "what it is"]
    return pd.DataFrame(rows, columns=columns).set_index("constant")
