"""The trials that a claim is about, as curves of accuracy over distance, speed or another column.

What is computed from the curves is in `bicode_studies.claims.statistics`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from bicode_studies.claims.claim_result import NoTrials, Tables
from bicode_studies.statistics import Floats, interval_over_seeds

Wanted = str | float | tuple[float, float]
"""A value of a column, or the least and the largest value."""
Where = Mapping[str, Wanted]
"""What rows of trials must have: column to value."""


class Cell(NamedTuple):
    """The trials of one condition.

    Parameters
    ----------
    at : float
        Where the condition lies on its curve, in the unit of the curve's column.
    right, periods : ndarray, shape (seeds,)
        Numbers of right periods and of all periods of each seed.
    """

    at: float
    right: Floats
    periods: Floats

    @property
    def seeds(self) -> int:
        """Number of seeds."""
        return self.right.size

    @property
    def accuracy(self) -> float:
        """Mean share of right periods over the seeds, 0 .. 1."""
        return float((self.right / self.periods).mean())

    def interval(self, level: float) -> tuple[float, float]:
        """Return the interval of the accuracy over seeds.

        Parameters
        ----------
        level : float
            Share of all such intervals that hold the true accuracy.

        Returns
        -------
        low, high : float
            0 .. 1.
        """
        return interval_over_seeds(self.right, self.periods, level)


def rows_where(tables: Tables, figure: str, where: Where) -> pd.DataFrame:
    """Return the rows of a figure's trials that have the wanted values.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows of trials by figure.
    figure : str
        "08" .. "14".
    where : mapping
        Column to a value, or to the least and the largest value; numbers may differ by a millionth.

    Returns
    -------
    DataFrame

    Raises
    ------
    NoTrials
        If the figure has no table, or the table no such column or row.
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
        "08" .. "14".
    right : str
        The column that counts right periods.
    where : mapping
        What the curve's rows must have, as `rows_where` takes it.
    by : str
        The column that the curve runs over.
    """

    figure: str
    right: str
    where: Where = field(default_factory=dict)
    by: str = "distance_m"

    def narrowed(self, **more: Wanted) -> Curve:
        """Return the part of this curve that meets further conditions, given as column=value."""
        return replace(self, where={**self.where, **more})

    def over(self, by: str) -> Curve:
        """Return the same trials as a curve over another column."""
        return replace(self, by=by)

    def cells(self, tables: Tables) -> list[Cell]:
        """Collect the trials of each condition along the curve.

        Parameters
        ----------
        tables : mapping of str to DataFrame
            Rows of trials by figure.

        Returns
        -------
        list of Cell
            One for each value of `by`, rising. Trials without periods are left out.

        Raises
        ------
        NoTrials
            If there are no such trials.
        ValueError
            If a seed has several rows at one condition.
        """
        rows = rows_where(tables, self.figure, self.where)
        rows = rows[rows["periods"] > 0].sort_values("seed", kind="stable")
        if rows.duplicated([self.by, "seed"]).any():
            raise ValueError(
                f"figure {self.figure} has several rows per seed and {self.by} with {dict(self.where)}; "
                "name the receiver and the frame rule, too"
            )
        at = rows[self.by].to_numpy(float)
        right, periods = rows[self.right].to_numpy(float), rows["periods"].to_numpy(float)
        return [Cell(float(here), right[at == here], periods[at == here]) for here in np.unique(at)]
