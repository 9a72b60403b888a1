"""What a notebook on a figure of section IV ends with: which constants were fitted, and its claims with verdicts."""

from __future__ import annotations

import pandas as pd

from bicode_lab.constants import all_constants
from bicode_studies.claims.points import stated_points
from bicode_studies.claims.verdicts import judge_claims
from bicode_studies.cli.claims import interval_of, read_claims, read_tables
from bicode_studies.repository import figures_folder, repository_root


def points_of(figure: str, by: str, levels: list[float], condition: str = "") -> pd.DataFrame:
    """A figure, "08" .. "14", and what its curves differ in, in; the points that the paper states out.

    `condition` keeps only claims whose condition has these words; see `evaluation.stated.stated_points`.
    """
    claims = read_claims(repository_root())
    return stated_points(claims[claims["condition"].str.contains(condition, regex=False)], figure, by, levels)


def claims_of(figure: str, table: pd.DataFrame) -> pd.DataFrame:
    """A figure and the rows of its trials in; its claims, judged, out.

    The rule is that of ``bicode claims``. What a claim asks of other figures is taken from their tables, where they
    were written to the folder of figures before.
    """
    claims = read_claims(repository_root())
    is_of = claims["id"].str.startswith(f"F{int(figure)}.") | claims["figure"].str.match(rf"{int(figure)}[a-k]")
    mine = claims[is_of & claims["kind"].isin(["number", "order"])]
    judged = judge_claims(mine, {**read_tables(figures_folder()), figure: table})
    shown = judged[["id", "claim", "tested", "ours"]].assign(
        interval=[interval_of(row) for row in judged.to_dict("records")], verdict=judged["verdict"], note=judged["note"]
    )
    return shown.rename(columns={"claim": "the paper", "interval": "95 %"}).set_index("id")


def fitted_for(figure: str) -> pd.DataFrame:
    """A figure in; the constants of `constants.csv` that were fitted, and whether this figure was used for it, out."""
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
