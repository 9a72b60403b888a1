"""Validate what a reader finds in a file, event by event, and keep account of it: good, dropped, triggers, remarks.

Every reader of a format passes what it decodes through one `Decoder`. So the rules, the error messages and the counts
are the same in all formats.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.events import EVENT_DTYPE, Events, no_events
from bicode_lab.recordings.formats import Header, RecordingError
from bicode_lab.recordings.time_order import TimeOrder
from bicode_lab.recordings.validate import (
    ANY_ORDER,
    COUNT,
    EVENT,
    EVENTS,
    HEIGHT,
    KEPT,
    MAX_TIME_US,
    NUMBER,
    PASSED,
    PLACE,
    T0,
    VALUE,
    WIDTH,
    Ints,
    dropped_counts,
    new_state,
    new_tally,
    raise_first_offence,
    take_good,
    validate_rows,
)

TRIGGER_DTYPE = np.dtype([("p", "<i2"), ("t", "<i8"), ("id", "<i2")], align=True)
"""An external trigger: the level after the edge (0 or 1), the time [us] and the number of the input."""

Columns = tuple[npt.NDArray[np.generic], npt.NDArray[np.generic], npt.NDArray[np.generic], npt.NDArray[np.generic]]
"""x, y, p and t [us] of some events, as integers, floats or truth values."""


class Decoder:
    """Validates one reading of a file, from its start to its end.

    Parameters
    ----------
    path : Path
        The file.
    header : Header
        What the file says about itself.
    width, height : int
        Sensor size [px].
    lenient : bool
        Whether good events of a damaged file are passed on; otherwise the first offence is an error.
    place_unit : str
        What a place in the file counts: "byte" or "line"; empty where places are not known.
    any_order : bool
        Whether lenient reading judges the times of events by those that follow (see `time_order`). Formats with time
        words of their own judge these instead.

    Attributes
    ----------
    state, tally : ndarray of int64
        See `validate.validate_event`.
    """

    def __init__(
        self,
        path: Path,
        header: Header,
        width: int,
        height: int,
        lenient: bool = False,
        place_unit: str = "",
        any_order: bool = True,
    ) -> None:
        self.path = path
        self.header = header
        self.lenient = lenient
        self.tally = new_tally()
        self.state = new_state(width, height, header.t0_us, lenient)
        self.state[ANY_ORDER] = lenient and any_order
        self._order = TimeOrder(self.state, self.tally) if self.state[ANY_ORDER] else None
        self._place_unit = place_unit
        self._triggers: list[Ints] = []
        self._off = set[int]()  # the polarities 0 and -1 that the file uses
        self._remarks: list[str] = []
        self._at_end = False

    @property
    def dropped(self) -> dict[str, int]:
        """What was dropped so far: counts by cause."""
        return dropped_counts(self.tally)

    @property
    def remarks(self) -> list[str]:
        """What is worth knowing of the file, though nothing is wrong with it: one line each, counts at its end."""
        counted = []
        if self._at_end and (words := int(self.state[PASSED])):
            counted.append(f"{words:,} words of the vendor's own kind 9 were passed over (some cameras pad their data)")
        if self._at_end and (marks := sum(len(rows) for rows in self._triggers)):
            counted.append(f"{marks:,} external triggers (bicode decode --triggers lists them)")
        return [*self._remarks, *counted]

    @property
    def triggers(self) -> npt.NDArray[np.void]:
        """The external triggers found so far, in the order of the file: `TRIGGER_DTYPE`, shape (n,)."""
        rows = np.concatenate([np.empty((0, 3), np.int64), *self._triggers])
        found = np.empty(len(rows), TRIGGER_DTYPE)
        for k, name in enumerate(("t", "id", "p")):
            found[name] = rows[:, k]
        return found

    @property
    def sides_px(self) -> tuple[int, int]:
        """Width and height of the sensor."""
        return int(self.state[WIDTH]), int(self.state[HEIGHT])

    def remark(self, line: str) -> None:
        """Add a remark, unless it was made before."""
        if line not in self._remarks:
            self._remarks.append(line)

    def add_triggers(self, rows: Ints) -> None:
        """Keep external triggers: rows of time [us], number of the input and level, shape (n, 3)."""
        if len(rows):
            self._triggers.append(rows.astype(np.int64))

    def validate(self, rows: Ints, place: int) -> Events:
        """Validate rows of x, y, p, t, and return the good events.

        Parameters
        ----------
        rows : ndarray of int64, shape (n, 4)
            x, y, p and t [us]; p may be -1 for OFF.
        place : int
            Line of the first row, or number of its event.

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (m,), m <= n
        """
        if (events := self._all_good((rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3]))) is not None:
            return events
        out = np.empty(len(rows), EVENT_DTYPE)
        self.state[KEPT] = 0
        validate_rows(self._with_zero_for_off(rows), place, self.state, self.tally, out)
        return self.in_order(out[: self.state[KEPT]])

    def filter(self, columns: Columns) -> Events:
        """Validate events that are given in columns, and return the good ones.

        Parameters
        ----------
        columns : tuple of four ndarrays, shape (n,)
            x, y, p and t [us]. Numbers with a fraction are rounded in t, and are no good elsewhere.

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (m,), m <= n
        """
        if (good_events := self._all_good(columns)) is not None:
            return good_events
        rows = np.empty((len(columns[0]), 4), np.int64)
        good = np.ones(len(rows), np.bool_)
        for k, column in enumerate(columns):
            rows[:, k], usable = as_integers(column, rounded=k == 3)
            if k == 3:
                usable = usable & (np.abs(rows[:, 3]) < MAX_TIME_US)
            if not usable.all() and not self.tally[NUMBER, COUNT]:
                first = self.state[EVENTS] + np.argmin(usable)
                self.tally[NUMBER, [EVENT, PLACE, VALUE]] = first, first, k
            good &= usable
        n_bad = np.count_nonzero(~good)
        self.tally[NUMBER, COUNT] += n_bad
        events = self.validate(rows[good] if n_bad else rows, int(self.state[EVENTS]))
        self.state[EVENTS] += n_bad
        return events

    def _all_good(self, columns: Columns) -> Events | None:
        """Return events that are given in columns of integers; None if one of them needs a closer look."""
        if self._order is not None or -1 in self._off or not all(column.dtype.kind in "iub" for column in columns):
            return None
        x, y, p, t = columns
        small = x.dtype == y.dtype == np.uint16
        narrow = np.int8 if p.dtype.itemsize == 1 and p.dtype != np.uint8 else np.int64
        kinds = (*[np.uint16 if small else np.int64] * 2, narrow, np.int64)
        whole: Any = tuple(np.ascontiguousarray(column, kind) for column, kind in zip((x, y, p, t), kinds, strict=True))
        out = np.empty((t.size, 2), np.int64)
        is_too_late = t.dtype == np.uint64 and (whole[3] < 0).any()
        if is_too_late or not take_good(whole, self.state, out):
            return None
        if 0 not in self._off and (whole[2] == 0).any():
            self._off.add(0)
        return out.view(EVENT_DTYPE)[:, 0]

    def in_order(self, events: Events) -> Events:
        """Return the events that are known to be in the order of time; strict reading has checked that before."""
        return events if self._order is None else self._order.judge(events)

    def rest(self) -> Events:
        """Return the events that waited for those after them; to be called once, at the end of the file."""
        self._at_end = True
        return no_events() if self._order is None else self._order.judge(no_events(), final=True)

    def count(self, rule: int) -> None:
        """Count something that lenient reading leaves out."""
        self.tally[rule, COUNT] += 1

    def note_end(self, rule: int, count: int, place: int = 0) -> None:
        """Record an offence at the end of the file.

        Parameters
        ----------
        rule : int
            Row of the tally, for example `validate.CUT`.
        count : int
            How often the rule is broken there.
        place : int
            Byte at which it occurs.
        """
        self.tally[rule, [COUNT, EVENT, PLACE]] = count, self.state[EVENTS], place

    def raise_offence(self) -> None:
        """Raise the offence that comes first in the file.

        Raises
        ------
        RecordingError
            If there is an offence and the file is read strictly.
        """
        if not self.lenient and self.tally.any():
            raise_first_offence(self.path, self.state, self.tally, self._place_unit)

    def shift_clock(self, t0_us: int) -> None:
        """Add a time to all events and triggers that follow [us]."""
        self.state[T0] = t0_us

    def _with_zero_for_off(self, rows: Ints) -> Ints:
        """Return rows with 0 where the polarity is -1, after checking that the file does not use both for OFF."""
        is_minus = rows[:, 2] == -1
        if is_minus.any():
            self._off.add(-1)
            rows = rows.copy()
            rows[is_minus, 2] = 0
            is_zero = (rows[:, 2] == 0) & ~is_minus
        else:
            is_zero = rows[:, 2] == 0
        if len(self._off) < 2 and is_zero.any():
            self._off.add(0)
        if len(self._off) == 2 and not self.lenient:
            raise RecordingError(
                f"{self.path}: the polarities 0 and -1 both occur, and only one of them can be OFF; "
                "store OFF as 0 and ON as 1, or read both as OFF with lenient=True (--lenient)"
            )
        return rows


def as_integers(column: npt.NDArray[np.generic], rounded: bool = False) -> tuple[Ints, npt.NDArray[np.bool_]]:
    """Return a column as integers of 64 bits, and which of its values such integers hold.

    Parameters
    ----------
    column : ndarray, shape (n,)
        Integers, floats or truth values.
    rounded : bool
        Whether a fraction is rounded; otherwise a value with a fraction is not held.

    Returns
    -------
    whole : ndarray of int64, shape (n,)
        0 where the value is not held.
    usable : ndarray of bool, shape (n,)
    """
    if column.dtype.kind == "f":
        values = column.astype(np.float64)
        whole = np.rint(values)
        usable = np.isfinite(values) & (np.abs(values) < 2.0**62) & (rounded | (whole == values))
        return np.where(usable, whole, 0).astype(np.int64), usable
    if column.dtype.kind == "u" and column.dtype.itemsize == 8:
        whole = column.astype(np.int64)  # what is too large becomes negative
        return np.where(whole >= 0, whole, 0), whole >= 0
    return column.astype(np.int64), np.ones(column.size, np.bool_)
