"""The trials a claim is about.   tables of trials, a condition -> one curve of accuracies

What is taken of the curves is in `claim_statistics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

Floats = npt.NDArray[np.float64]
Tables = Mapping[str, pd.DataFrame]
"""Rows of trials by figure: "08" .. "14"."""

DRAWS = 2000


class NoTrials(LookupError):
    """A figure's table, or the rows of a condition in it, is not there."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What we have to say to a claim.

    Parameters
    ----------
    ours : str
        In words and numbers.
    value, low, high : float, optional
        The number that is judged, and its 95 % interval.
    lo, hi : float, optional
        Within which it agrees, where the claim itself has no bounds.
    is_order : bool
        The value is a difference that must be above 0; one whose interval holds 0 is a tie.
    broken : str
        Where an order goes the other way by more than chance.
    holds : bool, optional
        For what is not a matter of chance: whether it is as the paper says.
    why_not : str
        Why it cannot be tested.
    """

    ours: str = ""
    value: float | None = None
    low: float | None = None
    high: float | None = None
    lo: float | None = None
    hi: float | None = None
    is_order: bool = False
    broken: str = ""
    holds: bool | None = None
    why_not: str = ""


class Cell(NamedTuple):
    """The trials of one condition: where it is on the curve, each seed's share of right periods, all periods."""

    distance_m: float
    shares: Floats
    periods: int

    @property
    def accuracy(self) -> float:
        """Mean over the seeds."""
        return float(self.shares.mean())

    def draws(self, rng: np.random.Generator) -> Floats:
        """A generator in, accuracies of drawn seeds out, shape (DRAWS,)."""
        return np.asarray(rng.choice(self.shares, (DRAWS, self.shares.size)).mean(axis=1))


Where = Mapping[str, str | float | tuple[float, float]]


def rows_where(tables: Tables, figure: str, where: Where) -> pd.DataFrame:
    """Tables, a figure, and a value or a (least, most) for some of its columns in; its rows that have them out.

    Raises
    ------
    NoTrials
        No table, or no such row.
    """
    if figure not in tables:
        raise NoTrials(f"no trials of figure {figure}")
    table = tables[figure]
    keep = np.ones(len(table), bool)
    for column, wanted in where.items():
        if column not in table:
            raise NoTrials(f"the trials of figure {figure} have no {column}")
        if isinstance(wanted, str):
            keep &= (table[column] == wanted).to_numpy()
        else:
            least, most = wanted if isinstance(wanted, tuple) else (wanted, wanted)
            values = table[column].to_numpy(float)
            keep &= (values >= least * (1 - 1e-6)) & (values <= most * (1 + 1e-6))
    if not keep.any():
        raise NoTrials(f"figure {figure} has no trials with {dict(where)}")
    return table[keep]


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One curve of a figure.

    Parameters
    ----------
    figure : str
    right : str
        The column that counts right periods.
    where : mapping
        Column to value, or to (least, most).
    by : str
        The column it runs over.
    """

    figure: str
    right: str
    where: Where = field(default_factory=dict)
    by: str = "distance_m"

    def with_(self, **more: Any) -> Curve:
        """The same curve where more is asked of it."""
        return Curve(figure=self.figure, right=self.right, where={**self.where, **more}, by=self.by)

    def over(self, by: str) -> Curve:
        """The same trials, as a curve over another column."""
        return Curve(figure=self.figure, right=self.right, where=self.where, by=by)

    def cells(self, tables: Tables) -> list[Cell]:
        """Tables in, a cell for each value of `by` out, rising."""
        rows = rows_where(tables, self.figure, self.where)
        rows = rows[rows["periods"] > 0].sort_values("seed", kind="stable")
        if rows.duplicated([self.by, "seed"]).any():
            raise ValueError(f"figure {self.figure} has several rows a seed and {self.by} with {dict(self.where)}")
        at = rows[self.by].to_numpy(float)
        shares, periods = (rows[self.right] / rows["periods"]).to_numpy(float), rows["periods"].to_numpy(int)
        return [Cell(float(here), shares[at == here], int(periods[at == here].sum())) for here in np.unique(at)]
