"""Find out how the lines of a text file hold their events: separator, order of the columns, unit of the time.

A header tells it, or the lines do: without column names, the polarity is the column that holds nothing but 0, 1 and -1,
and the time is the first or the last column. Times with a fraction are seconds, whole numbers are microseconds, unless
the name of the column says another unit (`t_ns`, `time [ms]`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

US_OF = {"us": 1.0, "s": 1e6, "ms": 1e3, "ns": 1e-3}
"""How many microseconds each unit of time has."""

_NAMES = {
    "x": ("x", "xs", "col", "column"),
    "y": ("y", "ys", "row"),
    "p": ("p", "ps", "on", "pol", "polarity", "polarities"),
    "t": ("t", "ts", "time", "times", "timestamp", "timestamps"),
}
_SHORT = {name: short for short, names in _NAMES.items() for name in names}
_UNIT = re.compile(r"(.+?)[\s_]*[\[(]?\s*(us|µs|ns|ms|s|sec|seconds)\s*[\])]?", re.DOTALL)
_SEPARATORS = (",", ";", "\t", None)


@dataclass(frozen=True, kw_only=True)
class TextLayout:
    """How the lines of a text file hold their events."""

    columns: tuple[int, int, int, int]
    """Numbers of the columns that hold x, y, p and t, counted from 0."""
    separator: str | None
    """What divides the columns; None for blanks."""
    unit: str = "us"
    """Unit of the time, a key of `US_OF`."""
    first_line: int = 1
    """Number of the first line with an event."""


def short_name(name: str) -> tuple[str, str]:
    """Return which of x, y, p and t a name means, and the unit of time in it; the name itself where it means none.

    Parameters
    ----------
    name : str
        Name of a column, an array or a data set, in any case.

    Returns
    -------
    short, unit : str
        The unit is empty where the name says none.

    Examples
    --------
    >>> short_name("Timestamp [ns]"), short_name("pol"), short_name("sensor")
    (('t', 'ns'), ('p', ''), ('sensor', ''))
    """
    name = name.strip().strip("\"'").strip().lower()
    if name in _SHORT:
        return _SHORT[name], ""
    if (found := _UNIT.fullmatch(name)) and _SHORT.get(found[1]) == "t":
        unit = {"µs": "us", "sec": "s", "seconds": "s"}.get(found[2], found[2])
        return "t", unit
    return name, ""


def separator_of(line: str) -> str | None:
    """Return what divides the columns of a line: comma, semicolon, tab, or blanks (None)."""
    return next(mark for mark in _SEPARATORS if mark is None or line.count(mark) >= 3)


def unit_of(times: list[str]) -> str:
    """Return the unit of times as they are written: seconds where most of them have a fraction, else microseconds."""
    broken = sum(float(time) != int(float(time)) for time in times)
    return "s" if 2 * broken > len(times) else "us"


def layout_of_names(names: list[str], separator: str | None, lines: list[str], first_line: int) -> TextLayout | None:
    """Return the layout of a table with column names; None where x, y, p and t are not among the names.

    Parameters
    ----------
    names : list of str
        Names of the columns, in the order of the file.
    separator : str or None
        What divides the columns.
    lines : list of str
        Some lines after the header, to tell the unit of the time.
    first_line : int
        Number of the first line with an event.
    """
    columns: dict[str, int] = {}
    unit = ""
    for position, name in enumerate(names):
        short, its_unit = short_name(name.partition("@")[0])
        if short in ("x", "y", "p", "t") and short not in columns:
            columns[short] = position
            unit = its_unit or unit
    if len([name for name in "xypt" if name in columns]) < 4:
        return None
    x, y, p, t = (columns[name] for name in "xypt")
    times = [cells[t].strip() for line in lines if len(cells := line.split(separator)) > t]
    if not unit:
        unit = unit_of([time for time in times if is_number(time)])
    return TextLayout(columns=(x, y, p, t), separator=separator, unit=unit, first_line=first_line)


def layout_of_numbers(lines: list[str], first_line: int) -> TextLayout | None:
    """Return the layout of lines of four numbers without names; None where they do not tell it.

    Parameters
    ----------
    lines : list of str
        Some lines, one event each.
    first_line : int
        Number of the first of them in the file.
    """
    if not lines:
        return None
    separator = separator_of(lines[0])
    rows = [[cell.strip() for cell in line.split(separator)] for line in lines]
    rows = [row for row in rows if len(row) == 4 and all(is_number(cell) for cell in row)]
    if not rows or 2 * len(rows) < len(lines):
        return None
    columns = list(zip(*rows, strict=True))
    order = order_of([[float(cell) for cell in column] for column in columns])
    if order is None:
        return None
    unit = unit_of(list(columns[order[3]]))
    return TextLayout(columns=order, separator=separator, unit=unit, first_line=first_line)


def order_of(columns: list[list[float]]) -> tuple[int, int, int, int] | None:
    """Return which of four columns without names hold x, y, p and t; None where they do not tell it.

    Known orders are t x y p, x y p t and x y t p. The one that fits best is taken; of equal ones, that whose time runs
    furthest.

    Parameters
    ----------
    columns : list of four lists of float
        The first values of each column.

    Examples
    --------
    >>> order_of([[3, 5, 9], [7, 2, 1], [4, 0, 2], [1, 0, 1]])
    (1, 2, 3, 0)
    """
    fitting = []
    for x, y, p, t in ((1, 2, 3, 0), (0, 1, 2, 3), (0, 1, 3, 2)):
        times, places = columns[t], columns[x] + columns[y]
        offences = sum(later < earlier for earlier, later in pairwise(times))
        offences += sum(value not in (-1, 0, 1) for value in columns[p])
        offences += sum(place != int(place) for place in places)
        if offences <= max(1, len(times) // 10):  # some of the events may be damaged
            fitting.append((offences, min(times) - max(times), (x, y, p, t)))
    return min(fitting)[2] if fitting else None


def is_number(cell: str) -> bool:
    """Return whether a cell holds a finite number."""
    try:
        return abs(float(cell)) < float("inf")
    except ValueError:
        return False
