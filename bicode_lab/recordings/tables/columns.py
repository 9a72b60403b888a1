"""Find x, y, p and t among the arrays of a file, whatever they are called, and bring the times to microseconds.

Events lie in four arrays of one dimension (x, xs, ...; t, ts, timestamp, ...), in one array with fields of such names,
or in one array of N rows and 4 columns without names. Times of a floating-point type of which most have a fraction are
seconds, all others microseconds, unless the name says another unit (`t_ns`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Columns, Decoder, as_integers
from bicode_lab.recordings.formats import RecordingError
from bicode_lab.recordings.text.layout import US_OF, order_of, short_name

PIECE_EVENTS = 1 << 18
_SAMPLE_EVENTS = 2000

Array = npt.NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Table:
    """Where the events of a file lie."""

    names: tuple[str, str, str, str] | None
    """Names of the arrays, or of the fields of one array, that hold x, y, p and t; None for N x 4 without names."""
    whole: str = ""
    """Name of the one array that holds all four; empty where there are four arrays."""
    unit: str = ""
    """Unit of the time, if its name says one."""
    offset_us: int = 0
    """Time to add to every event [us]."""


def find_table(arrays: Mapping[str, tuple[Any, tuple[int, ...]]]) -> Table | None:
    """Find the events among arrays; None where there are none.

    Parameters
    ----------
    arrays : mapping of str to (dtype, shape)
        What there is.

    Examples
    --------
    >>> shape, u2 = (9,), np.dtype("u2")
    >>> find_table({"xs": (u2, shape), "ys": (u2, shape), "ps": (u2, shape), "ts": (u2, shape)}).names
    ('xs', 'ys', 'ps', 'ts')
    """
    if names := _four_names(list(arrays)):
        return Table(names=names, unit=short_name(names[3])[1])
    for name, (dtype, shape) in arrays.items():
        fields = [field for field in dtype.names or () if dtype[field].kind in "iubf"]
        if names := _four_names(fields):
            return Table(names=names, whole=name, unit=short_name(names[3])[1])
        if len(shape) == 2 and shape[1] == 4 and dtype.kind in "iuf":
            return Table(names=None, whole=name)
    return None


def _four_names(names: list[str]) -> tuple[str, str, str, str] | None:
    """Return those of the names that mean x, y, p and t; None where one is missing."""
    found: dict[str, str] = {}
    for name in names:
        found.setdefault(short_name(name)[0], name)
    if all(short in found for short in "xypt"):
        return found["x"], found["y"], found["p"], found["t"]
    return None


def missing_names(path: Path, what: str, names: list[str]) -> RecordingError:
    """Return the error of a file in which no events are found.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it holds: "arrays", "columns".
    names : list of str
        What they are called.
    """
    known = {short_name(name)[0] for name in names}
    missing = [name for name in "xypt" if name not in known]
    has = ", ".join(sorted(names))[:100] or "nothing"
    return RecordingError(f"{path}: {what} missing: {', '.join(missing)} (found: {has}); give x, y, p, t")


def check_kind(path: Path, what: str, name: str, dtype: Any, shape: tuple[int, ...]) -> None:
    """Raise RecordingError unless an array holds numbers in one dimension.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What the file calls its arrays: "array", "column".
    name : str
        The array.
    dtype : numpy.dtype
    shape : tuple of int
    """
    if dtype.kind not in "iubf" or max(shape, default=0) != int(np.prod(shape)):
        rule = "whole microseconds, or seconds," if short_name(name)[0] == "t" else "whole numbers"
        raise RecordingError(f"{path}: {what} {name} is {dtype} of shape {shape}; store {rule} in one dimension")


def check_sizes(path: Path, what: str, sizes: list[int]) -> None:
    """Raise RecordingError unless x, y, p and t have as many entries.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What the file calls its arrays: "arrays", "columns".
    sizes : list of int
    """
    if len(set(sizes)) > 1:
        raise RecordingError(f"{path}: {what} x, y, p, t have {sizes} entries; give one of each per event")


def read_table(decoder: Decoder, table: Table, n_events: int, part: Callable[[str, slice], Array]) -> Iterator[Events]:
    """Yield the good events of a table in pieces.

    Parameters
    ----------
    decoder : Decoder
        It validates the events.
    table : Table
        Where they lie.
    n_events : int
        How many there are.
    part : callable
        Returns some rows of the array of a name.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        If four columns without names do not tell which is which.
    """
    unit, order = table.unit, None
    for start in range(0, n_events, PIECE_EVENTS):
        rows = slice(start, start + PIECE_EVENTS)
        if table.names is None:
            whole = part(table.whole, rows)
            order = order or _order(decoder.path, table.whole, whole)
            columns = [whole[:, k] for k in order]
        elif table.whole:
            whole = part(table.whole, rows)
            columns = [whole[name] for name in table.names]
        else:
            columns = [part(name, rows) for name in table.names]
        x, y, p, t = (np.asarray(column).ravel() for column in columns)
        unit = unit or unit_of_times(t)
        yield decoder.filter(in_us((x, y, p, t), unit, table.offset_us))


def _order(path: Path, name: str, rows: Array) -> tuple[int, int, int, int]:
    """Return which columns of an array of N rows and 4 columns hold x, y, p and t."""
    some = rows[np.isfinite(rows.astype(np.float64)).all(axis=1)][:_SAMPLE_EVENTS]
    order = order_of([column.tolist() for column in some.T]) if len(some) else None
    if order is None:
        raise RecordingError(
            f"{path}: array {name} has 4 columns without names, and no order fits: the polarity is to be 0, 1 or -1, "
            "and the times are to rise; store arrays x, y, p, t"
        )
    return order


def unit_of_times(t: Array) -> str:
    """Return the unit of times without a stated unit: seconds where most have a fraction, else microseconds.

    Parameters
    ----------
    t : ndarray, shape (n,)
    """
    if t.dtype.kind != "f" or not t.size:
        return "us"
    finite = t[np.isfinite(t)]
    return "s" if 2 * np.count_nonzero(finite != np.rint(finite)) > finite.size else "us"


def in_us(columns: Columns, unit: str, offset_us: int = 0) -> Columns:
    """Return columns with their times in microseconds.

    Parameters
    ----------
    columns : tuple of four ndarrays, shape (n,)
        x, y, p and t.
    unit : str
        Unit of t, a key of `text.layout.US_OF`.
    offset_us : int
        Time to add [us].
    """
    x, y, p, t = columns
    if unit != "us":
        if unit == "ns" and t.dtype.kind in "iu":
            t = np.asarray(t) // 1000
        else:
            with np.errstate(over="ignore", invalid="ignore"):  # what is too large is no number, and is told
                t = t.astype(np.float64) * US_OF[unit]
    if offset_us and t.dtype.kind == "f":
        t = t.astype(np.float64) + offset_us
    elif offset_us:
        whole, usable = as_integers(t)
        t = np.where(usable, whole + offset_us, np.iinfo(np.int64).max)
    return x, y, p, t
