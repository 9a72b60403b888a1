"""The paper's numbers on accuracies and ranges of a figure, as points to draw beside our curves.

The condition of each number is in columns of `data/paper_claims.csv`, so no value of the paper stands in a notebook.
A range "up to 20 m" is drawn as an accuracy of at least one half at that distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

QUANTITIES = {"acc_ID": "blinker", "acc_2D": "2d", "max_dist_ID": "blinker", "max_dist_2D": "2d"}
"""Quantities of the claims that are points, and the curve that they belong to."""
LEVELS = ("current_ma", "yaw_deg", "size_m", "illuminance_lux", "speed_m_per_s", "rpm")
"""Columns that tell the curves of a figure apart. A cell is a value, values as "0;40", or a range as "1e4..9e4"."""


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
