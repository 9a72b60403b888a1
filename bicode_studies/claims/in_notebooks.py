"""What a notebook on a figure of section IV shows of the claims: points to draw, fitted constants, and verdicts.

The condition of each number of the paper is in columns of `data/paper_claims.csv`, so no value of the paper stands in a
notebook. A range "up to 20 m" is drawn as an accuracy of at least one half at that distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from bicode_lab.constants import all_constants
from bicode_studies.claims.beside_null import judge_beside_null, verdict_text
from bicode_studies.claims.table import interval_text, read_claims, read_trials
from bicode_studies.claims.verdicts import NO_TRIALS

QUANTITIES = {"acc_ID": "blinker", "acc_2D": "2d", "max_dist_ID": "blinker", "max_dist_2D": "2d"}
"""Quantities of the claims that are points, and the curve that they belong to."""
LEVELS = ("current_ma", "yaw_deg", "size_m", "illuminance_lux", "speed_m_per_s", "rpm")
"""Columns that tell the curves of a figure apart. A cell is a value, values as "0;40", or a range as "1e4..9e4"."""
NOT_ENOUGH = "not enough trials"


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
        Rows of `stated_points`.
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
        with its 95 % interval, the verdicts on ours and on the null model, and a note. Short trials are too few for a
        verdict, so they get `NOT_ENOUGH` in its place.
    """
    claims = read_claims()
    is_of = claims["id"].str.startswith(f"F{int(figure)}.") | claims["figure"].str.match(rf"{int(figure)}[a-k]")
    mine = claims[is_of & claims["kind"].isin(["number", "order"])]
    judged = judge_beside_null(mine, {**read_trials(quick), figure: table})
    rows = judged.to_dict("records")
    verdicts = [verdict_text(row) for row in rows]
    if quick:
        verdicts = [words if words.startswith(NO_TRIALS) else NOT_ENOUGH for words in verdicts]
    shown = judged[["id", "class", "claim", "tested", "ours"]].assign(
        interval=[interval_text(row) for row in rows], verdict=verdicts,
        null_model=judged["null_model"], note=judged["note"],
    )  # fmt: skip
    return shown.rename(columns={"claim": "the paper", "interval": "95 %", "null_model": "null model"}).set_index("id")


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


def stated_points(claims: pd.DataFrame, figure: str, by: str, levels: Sequence[float]) -> pd.DataFrame:
    """Return the points that the paper states for a figure.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, or some of its rows, all columns as text.
    figure : str
        "08" .. "14".
    by : str
        The column that tells the figure's curves apart, one of `LEVELS`.
    levels : sequence of float
        The curves' values of `by`. A claim without a value is about all of these, one with a range about those within.

    Returns
    -------
    DataFrame
        One row for each point: ``id`` of the claim; ``kind``, "blinker" or "2d"; `by`; ``at_m``, the distance at which
        the point is drawn; ``from_m`` and ``to_m``, the distances over which the claim is stated; ``op`` and
        ``accuracy``, 0 .. 1.

    Raises
    ------
    ValueError
        If no claim can state `by`.
    """
    if by not in LEVELS:
        raise ValueError(f"by={by!r} is stated by no claim; choose one of {', '.join(LEVELS)}")
    span_m = _tested_span_m(claims, figure)
    rows = []
    for claim in claims[claims["kind"] == "number"].to_dict("records"):
        kinds = [QUANTITIES[name] for name in str(claim["quantity"]).split(", ") if name in QUANTITIES]
        if not kinds or not str(claim["id"]).startswith(f"F{int(figure)}."):
            continue
        place, chosen = _place(claim, span_m), _stated_levels(str(claim[by]), levels)
        rows += [(claim["id"], kind, level, *place) for kind in kinds for level in chosen]
    return pd.DataFrame(rows, columns=["id", "kind", by, "at_m", "from_m", "to_m", "op", "accuracy"])


def _tested_span_m(claims: pd.DataFrame, figure: str) -> tuple[float, float]:
    """Return the first and last distance that the paper tested for a figure; without a claim, those of Fig. 8."""
    tested = claims[(claims["figure"] == str(int(figure))) & (claims["quantity"] == "distance range")]
    first, last = str(tested["value"].iloc[0]).split("..") if len(tested) else ("0.5", "50")
    return float(first), float(last)


def _place(claim: dict[object, object], span_m: tuple[float, float]) -> tuple[float, float, float, str, float]:
    """Return where a claim is drawn, from where to where it is stated [m], its operator and its accuracy.

    A claim that holds up to a distance is drawn there; one without a last distance at the geometric mean of its ends.
    """
    value, op = float(str(claim["value"])), str(claim["op"])
    if str(claim["quantity"]).startswith("max_dist"):
        return value, value, value, ">=", 0.5
    stated_from, stated_to = str(claim["distance_from_m"]), str(claim["distance_to_m"])
    from_m = float(stated_from) if stated_from else span_m[0]
    to_m = float(stated_to) if stated_to else span_m[1]
    return to_m if stated_to else math.sqrt(from_m * to_m), from_m, to_m, op, value


def _stated_levels(cell: str, levels: Sequence[float]) -> list[float]:
    """Return the levels that a cell states: all where it is empty, else its values, or those within its range."""
    if not cell:
        return list(levels)
    if ".." in cell:
        least, most = (float(end) for end in cell.split(".."))
        return [level for level in levels if least <= level <= most]
    values = [float(value) for value in cell.split(";")]
    return [level for level in levels if any(math.isclose(level, value) for value in values)]
