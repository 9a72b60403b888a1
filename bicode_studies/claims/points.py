"""What the paper states of a figure, as points to draw: its claims -> level, distance, accuracy.

A claim of `data/paper_claims.csv` names its condition in words ("10 cm, 40.9 mA, d<=7.5 m"). Here they are read, so
that no value of the paper stands in a notebook. Only numbers about accuracies and ranges are points; a range
"up to 20 m" is an accuracy of at least one half there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import pandas as pd

QUANTITIES = {"acc_ID": "blinker", "acc_2D": "2d", "max_dist_ID": "blinker", "max_dist_2D": "2d"}
LEVELS = {
    "current_ma": (r"([\d.]+) mA", 1.0),
    "yaw_deg": (r"theta(?:=| in \{)([\d,]+)", 1.0),
    "size_m": (r"([\d.]+) cm", 0.01),
    "illuminance_lux": (r"([\de.]+(?: and [\d.]+)?) lx", 1.0),
    "speed_m_per_s": (r"([\d.]+) m/s", 1.0),
    "rpm": (r"([\d.]+) rpm", 1.0),
}
"""How a claim's words name what a figure varies: a pattern, and what its number is multiplied by."""

NUMBER = r"\d+(?:\.\d+)?(?:e\d)?"
AT = re.compile(rf"(?:\bd ?(<=|>=|<|>|~)|(?:^|, ))({NUMBER}) m(?:,|$)")


def stated_points(claims: pd.DataFrame, figure: str, by: str, levels: Sequence[float]) -> pd.DataFrame:
    """The paper's claims, a figure, the column that tells its curves apart and its levels in; a row a point out.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, or some of its rows, all columns as text.
    figure : str
        "08" .. "14".
    by : str
        One of `LEVELS`.
    levels : sequence of float
        A claim that names no level is about all of these, one that names a range about those within.

    Returns
    -------
    DataFrame
        ``id``; ``kind``, "blinker" or "2d"; `by`; ``at_m``, where it is drawn; ``from_m`` and ``to_m``, over which
        distances it is said; ``op`` and ``accuracy``, 0 .. 1.

    Raises
    ------
    ValueError
        A column that no claim can name.
    """
    if by not in LEVELS:
        raise ValueError(f"by={by!r} is named by no claim; choose one of {', '.join(LEVELS)}")
    rows = []
    for claim in claims[claims["kind"] == "number"].to_dict("records"):
        kinds = [QUANTITIES[name] for name in str(claim["quantity"]).split(", ") if name in QUANTITIES]
        if not kinds or not str(claim["id"]).startswith(f"F{int(figure)}."):
            continue
        place, chosen = _place(claim, _span_m(claims, figure)), _chosen(str(claim["condition"]), by, levels)
        rows += [(claim["id"], kind, level, *place) for kind in kinds for level in chosen]
    return pd.DataFrame(rows, columns=["id", "kind", by, "at_m", "from_m", "to_m", "op", "accuracy"])


def _span_m(claims: pd.DataFrame, figure: str) -> tuple[float, float]:
    """The distances that the paper tried for a figure, where the claims tell them; else those of Fig. 8."""
    tried = claims[(claims["figure"] == str(int(figure))) & (claims["quantity"] == "distance range")]
    least, most = str(tried["value"].iloc[0]).split("..") if len(tried) else ("0.5", "50")
    return float(least), float(most)


def _place(claim: dict[object, object], span_m: tuple[float, float]) -> tuple[float, float, float, str, float]:
    """A claim in; where it is drawn, from where to where it is said [m], operator and accuracy out."""
    value, op = float(str(claim["value"])), str(claim["op"])
    if str(claim["quantity"]).startswith("max_dist"):
        return value, value, value, ">=", 0.5
    found = AT.search(str(claim["condition"]))
    if found is None:  # at any distance
        return math.sqrt(span_m[0] * span_m[1]), *span_m, op, value
    relation, at_m = found[1] or "=", float(found[2])
    if relation[0] == ">":
        return math.sqrt(at_m * span_m[1]), at_m, span_m[1], op, value
    return at_m, span_m[0] if relation[0] == "<" else at_m, at_m, op, value


def _chosen(condition: str, by: str, levels: Sequence[float]) -> list[float]:
    """The words of a condition in, those levels that it is about out."""
    pattern, scale = LEVELS[by]
    found = re.findall(pattern, condition)
    if not found:
        return list(levels)
    numbers = [float(number) * scale for number in re.findall(NUMBER, found[-1])]
    if ".." in found[-1]:
        return [level for level in levels if numbers[0] <= level <= numbers[-1]]
    return [level for level in levels if any(math.isclose(level, number) for number in numbers)]
