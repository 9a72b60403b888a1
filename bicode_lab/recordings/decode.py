"""Read a file in blocks, decode its words or lines, and validate every event.

One block is held in memory at a time. EVT2 and EVT3 are read only here. DAT, ES and CSV are read by faery and only
validated here, except in lenient reading, where their events come from here, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import EVENT_DTYPE, Events, copy_events
from bicode_lab.recordings.dat_es import decode_atis, decode_dat, decode_es
from bicode_lab.recordings.evt_read import decode_evt2, decode_evt3
from bicode_lab.recordings.formats import Header, RecordingError
from bicode_lab.recordings.validate import (
    COUNT,
    CUT,
    EVENT,
    EVENTS,
    KEPT,
    KIND,
    LENIENT_HINT,
    LINE,
    PLACE,
    VECTOR,
    Ints,
    dropped_counts,
    new_state,
    new_tally,
    raise_first_offence,
    validate_rows,
)

_BLOCK_BYTES = 1 << 17
_MAX_WAITING_BYTES = 1 << 22  # a kernel that waits for words which decide about a time word waits no longer than this
_BUFFER_EVENTS = 1 << 16


class Decoder:
    """Reads one file once, from its start to its end, and validates it on the way.

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

    Attributes
    ----------
    state, tally : ndarray of int64
        See `validate.validate_event`.
    """

    def __init__(self, path: Path, header: Header, width: int, height: int, lenient: bool = False) -> None:
        self.path = path
        self.header = header
        self.lenient = lenient
        self.tally = new_tally()
        self.state = new_state(width, height, header.t0_us, lenient)
        self._place_unit = {"CSV": "line", "AEDAT4": "", "npz": "", "HDF5": ""}.get(header.format, "byte")
        self._blocks = self._decode_lines() if header.format == "CSV" else self._decode_words()

    @property
    def dropped(self) -> dict[str, int]:
        """What was dropped so far: counts by cause."""
        return dropped_counts(self.tally)

    def pieces(self) -> Iterator[Events]:
        """Yield the good events block by block.

        Yields
        ------
        ndarray of EVENT_DTYPE, shape (n,), n >= 0

        Raises
        ------
        RecordingError
            In strict reading, at the first offence.
        """
        for piece in self._blocks:
            self.raise_offence()
            yield piece
        self.raise_offence()

    def advance(self, n_events: int | None = None) -> None:
        """Validate the file up to its first `n_events` events, or to its end.

        Parameters
        ----------
        n_events : int, optional
            Number of events from the start of the file; None goes to the end.

        Raises
        ------
        RecordingError
            In strict reading, at the first offence.
        """
        while n_events is None or self.state[EVENTS] < n_events:
            if next(self._blocks, None) is None or self.tally.any():
                break
        self.raise_offence()

    def filter(self, columns: tuple[Ints, Ints, Ints, Ints]) -> Events:
        """Validate events that were decoded elsewhere, and return the good ones.

        Parameters
        ----------
        columns : tuple of four ndarrays of integers, shape (n,)
            x, y, p and t [us].

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (m,), m <= n
        """
        rows = np.stack([np.asarray(column).astype(np.int64) for column in columns], axis=1)
        out = np.empty(len(rows), EVENT_DTYPE)
        return self._validate(rows, int(self.state[EVENTS]), out)

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
        """Raise the first offence found so far, after counting those like it up to the end of the file.

        Raises
        ------
        RecordingError
            If there is an offence and the file is read strictly.
        """
        if self.lenient or not self.tally.any():
            return
        for _ in self._blocks:
            pass
        raise_first_offence(self.path, self.state, self.tally, self._place_unit)

    def _validate(self, rows: Ints, place: int, out: Events) -> Events:
        """Validate rows of x, y, p, t, and return the good events as a part of the buffer `out`."""
        self.state[KEPT] = 0
        validate_rows(rows, place, self.state, self.tally, out)
        return out[: self.state[KEPT]]

    def _decode_words(self) -> Iterator[Events]:
        """Yield the good events of each block of words."""
        if self.header.format not in _KERNELS:
            return
        word, kernel = _KERNELS["ATIS" if self.header.atis else self.header.format]
        size = np.dtype(word).itemsize
        out = np.empty(_BUFFER_EVENTS, EVENT_DTYPE)
        place, data, final = self.header.offset, b"", False
        with self.path.open("rb") as file:
            file.seek(place)
            while not final:
                block = file.read(_BLOCK_BYTES)
                data, final = data + block, not block
                words = np.frombuffer(data, word, count=len(data) // size).astype(np.int64)
                used, n = 0, -1
                while n and used < words.size:
                    self.state[KEPT] = 0
                    no_more_waiting = final or len(data) > _MAX_WAITING_BYTES
                    n = kernel(words[used:], place + used * size, no_more_waiting, self.state, self.tally, out)
                    used += n
                    yield copy_events(out[: self.state[KEPT]])
                data, place = data[used * size :], place + used * size
        if data:
            self.note_end(CUT, len(data), place)
        elif self.header.format == "EVT3" and self.state[KIND] in (3, 4):
            self.note_end(VECTOR, 1, place)

    def _decode_lines(self) -> Iterator[Events]:
        """Yield the good events of each block of CSV lines."""
        line_number = 2
        with self.path.open("rb") as file:
            file.seek(self.header.offset)
            while lines := file.readlines(_BLOCK_BYTES):
                rows = self._parse_lines(lines)
                if rows is not None:
                    yield self._validate(rows, line_number, np.empty(len(rows), EVENT_DTYPE))
                else:
                    yield from self._decode_line_by_line(lines, line_number)
                line_number += len(lines)

    def _parse_lines(self, lines: list[bytes]) -> Ints | None:
        """Return lines of a CSV file as rows of x, y, p, t; None where a line is not an event."""
        try:
            rows = np.loadtxt(lines, np.int64, comments=None, delimiter=",", usecols=self.header.columns, ndmin=2)
        except ValueError:
            return None
        return rows if len(rows) == len(lines) else None

    def _decode_line_by_line(self, lines: list[bytes], line_number: int) -> Iterator[Events]:
        """Yield the good events of lines of which some are not events; those are an error, or counted and left out."""
        columns = self.header.columns
        for i, line in enumerate(lines):
            cells = line.split(b",")
            if len(cells) > max(columns) and all(_is_integer(cells[column]) for column in columns):
                rows = np.array([[int(cells[column]) for column in columns]])
                yield self._validate(rows, line_number + i, np.empty(1, EVENT_DTYPE))
                continue
            if not self.lenient:
                text = line.decode("utf-8", errors="replace").strip()[:60]
                message = f"line {line_number + i:,} is {text!r}; each line holds whole numbers for x, y, p and t in us"
                raise RecordingError(f"{self.path}: {message}; correct it or export the file again, {LENIENT_HINT}")
            self.tally[LINE, COUNT] += 1


_KERNELS: dict[str, tuple[str, Callable[..., Any]]] = {
    "EVT2": ("<u4", decode_evt2),
    "EVT3": ("<u2", decode_evt3),
    "DAT": ("<u8", decode_dat),
    "ES": ("u1", decode_es),
    "ATIS": ("u1", decode_atis),
}
"""Type of a word, and the function that decodes words, of each format."""


def _is_integer(cell: bytes) -> bool:
    """Return whether a cell of a CSV file holds an integer of 64 bits."""
    try:
        return np.iinfo(np.int64).min <= int(cell) <= np.iinfo(np.int64).max
    except ValueError:
        return False
