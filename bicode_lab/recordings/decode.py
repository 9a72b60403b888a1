"""A file's bytes read in blocks   its words or lines -> good events, and a tally of the others

One block is held at a time. EVT2 and EVT3 are read here alone; DAT, ES and CSV are read
by faery and only judged here, unless they are read leniently.
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
    LENIENT,
    LENIENTLY,
    LINE,
    PLACE,
    VECTOR,
    Ints,
    complain,
    dropped,
    judge_columns,
    new_state,
    new_tally,
)

_BLOCK_BYTES = 1 << 17
_MOST_BYTES = 1 << 22  # never waits longer than this for the words that tell
_BUFFER_EVENTS = 1 << 16


class Decoder:
    """A file read once, from its start to its end, and judged on the way."""

    def __init__(self, path: Path, header: Header, width: int, height: int, lenient: bool = False) -> None:
        self.path = path
        self.header = header
        self.lenient = lenient
        self.tally = new_tally()
        self.state = new_state(width, height, header.t0_us, lenient)
        self.place_is = {"CSV": "line", "AEDAT4": "", "npz": "", "HDF5": ""}.get(header.format, "byte")
        self._pieces = self._lines() if header.format == "CSV" else self._words()

    @property
    def dropped(self) -> dict[str, int]:
        """What was dropped so far: cause -> count."""
        return dropped(self.tally)

    def pieces(self) -> Iterator[Events]:
        """Nothing in, the good events out, block by block.

        Raises
        ------
        RecordingError
            Reading strictly, at the first offence.
        """
        for piece in self._pieces:
            self.complain()
            yield piece
        self.complain()

    def advance(self, n_events: int | None = None) -> None:
        """Judge the file up to its first `n_events` events, or to the end; complain at the first offence."""
        while n_events is None or self.state[EVENTS] < n_events:
            if next(self._pieces, None) is None or self.tally.any():
                break
        self.complain()

    def filter(self, columns: tuple[Ints, Ints, Ints, Ints]) -> Events:
        """Columns x, y, p, t that were decoded elsewhere in, the good events of them out."""
        rows = np.stack([np.asarray(column).astype(np.int64) for column in columns], axis=1)
        out = np.empty(len(rows), EVENT_DTYPE)
        return self._judge_rows(rows, int(self.state[EVENTS]), out)

    def note_end(self, rule: int, count: int, place: int = 0) -> None:
        """Count an offence at the end of the file."""
        self.tally[rule, [COUNT, EVENT, PLACE]] = count, self.state[EVENTS], place

    def complain(self) -> None:
        """Reading strictly, raise the first offence, after its like were counted to the end of the file."""
        if self.lenient or not self.tally.any():
            return
        for _ in self._pieces:
            pass
        complain(self.path, self.state, self.tally, self.place_is)

    def _judge_rows(self, rows: Ints, place: int, out: Events) -> Events:
        self.state[KEPT] = 0
        judge_columns(rows, place, self.state, self.tally, out)
        return out[: self.state[KEPT]]

    def _words(self) -> Iterator[Events]:
        """The good events of each block of words."""
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
                    enough = final or len(data) > _MOST_BYTES
                    n = kernel(words[used:], place + used * size, enough, self.state, self.tally, out)
                    used += n
                    yield copy_events(out[: self.state[KEPT]])
                data, place = data[used * size :], place + used * size
        if data:
            self.note_end(CUT, len(data), place)
        elif self.header.format == "EVT3" and self.state[KIND] in (3, 4):
            self.note_end(VECTOR, 1, place)

    def _lines(self) -> Iterator[Events]:
        """The good events of each block of lines."""
        line_number = 2
        with self.path.open("rb") as file:
            file.seek(self.header.offset)
            while lines := file.readlines(_BLOCK_BYTES):
                rows = self._table(lines)
                if rows is not None:
                    yield self._judge_rows(rows, line_number, np.empty(len(rows), EVENT_DTYPE))
                else:
                    yield from self._one_by_one(lines, line_number)
                line_number += len(lines)

    def _table(self, lines: list[bytes]) -> Ints | None:
        """Lines of a CSV in, rows of x, y, p, t out, or None where not every line is one."""
        try:
            rows = np.loadtxt(lines, np.int64, comments=None, delimiter=",", usecols=self.header.columns, ndmin=2)
        except ValueError:
            return None
        return rows if len(rows) == len(lines) else None

    def _one_by_one(self, lines: list[bytes], line_number: int) -> Iterator[Events]:
        """The same where some lines are no events: those are an error, or left out and counted."""
        wanted = self.header.columns
        for i, line in enumerate(lines):
            cells = line.split(b",")
            if len(cells) > max(wanted) and all(_is_integer(cells[column]) for column in wanted):
                rows = np.array([[int(cells[column]) for column in wanted]])
                yield self._judge_rows(rows, line_number + i, np.empty(1, EVENT_DTYPE))
                continue
            if not self.state[LENIENT]:
                text = line.decode("utf-8", errors="replace").strip()[:60]
                message = f"line {line_number + i:,} is {text!r}; each line holds whole numbers for x, y, p and t in us"
                raise RecordingError(f"{self.path}: {message}; correct it or export the file again, {LENIENTLY}")
            self.tally[LINE, COUNT] += 1


_KERNELS: dict[str, tuple[str, Callable[..., Any]]] = {
    "EVT2": ("<u4", decode_evt2),
    "EVT3": ("<u2", decode_evt3),
    "DAT": ("<u8", decode_dat),
    "ES": ("u1", decode_es),
    "ATIS": ("u1", decode_atis),
}


def _is_integer(cell: bytes) -> bool:
    try:
        return np.iinfo(np.int64).min <= int(cell) <= np.iinfo(np.int64).max
    except ValueError:
        return False
