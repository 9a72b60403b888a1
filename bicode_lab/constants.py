"""The physical constants of the synthetic camera and of the experiments, each with its source and its range.

The file `constants.csv` holds the values. Most of them have a source. The values with an entry in `fitted_to` were
fitted, and only to the figure or claim of the paper that this column names (`bicode calibrate`, notebook 19). The
receiver's defaults use none of them; what the experiments ask of the receiver beyond its defaults is in the file, too.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True, kw_only=True)
class Constant:
    """One row of the file of constants.

    Parameters
    ----------
    name : str
    value : float
        In the unit `unit`.
    low, high : float
        Range of plausible values.
    unit : str
        Empty where the value is dimensionless or a count.
    fitted_to : str
        The figure or claim of the paper that the value was fitted to; empty where it was not fitted.
    source : str
        Where value and range come from.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    fitted_to: str
    source: str


@cache
def all_constants() -> dict[str, Constant]:
    """Read the file of constants.

    Returns
    -------
    dict of str to Constant
        By name, in the order of the file.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """
    found: dict[str, Constant] = {}
    text = (resources.files("bicode_lab") / "constants.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        value, low, high = (float(row[key]) for key in ("value", "low", "high"))
        if not low <= value <= high:
            raise ValueError(f"constants.csv: {row['name']}={value:g} is outside its range {low:g} .. {high:g}")
        found[row["name"]] = Constant(
            name=row["name"], value=value, low=low, high=high,
            unit=row["unit"], fitted_to=row["fitted_to"], source=row["source"],
        )  # fmt: skip
    return found


def constant(name: str) -> float:
    """Return the value of a constant.

    Parameters
    ----------
    name : str
        Name of a row of `constants.csv`.

    Returns
    -------
    float

    Examples
    --------
    >>> constant("threshold")
    0.25
    """
    return all_constants()[name].value
