"""The physical constants, each with its source and range: one file for camera and experiments.   name -> value

`constants.csv` is what the synthetic camera and the experiments are set to. Most values have a source; those with
an entry in `fitted_to` were fitted, to that figure or claim of the paper only (`bicode calibrate`, notebook 19).
The receiver knows none of them: what the experiments ask of it beyond its defaults stands here, too.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True, kw_only=True)
class Constant:
    """One row of the file.

    Parameters
    ----------
    name : str
    value : float
    low, high : float
        The range it may come from.
    unit : str
    fitted_to : str
        A figure or claim of the paper; empty where it was not fitted.
    source : str
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
    """Nothing in, every constant by its name out, in the file's order.

    Raises
    ------
    ValueError
        A value outside its range.
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
    """The name of a constant in, its value out.

    Examples
    --------
    >>> constant("threshold")
    0.25
    """
    return all_constants()[name].value
