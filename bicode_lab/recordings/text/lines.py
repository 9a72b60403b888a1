"""Read the lines of a text file as events: plain ones at once, others in blocks, and one by one where needed."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder, as_integers
from bicode_lab.recordings.formats import RecordingError
from bicode_lab.recordings.text.layout import US_OF, TextLayout
from bicode_lab.recordings.text.plain_lines import parse_plain
from bicode_lab.recordings.validate import LENIENT_HINT, LINE, MAX_TIME_US, Ints

_BLOCK_BYTES = 1 << 18
_LEAST_LINE_BYTES = 8
_CLOSER_BYTES = 1 << 12  # that are read in the other way where a line is not plain
_TRUTHS = ((b"true", b"1"), (b"True", b"1"), (b"TRUE", b"1"), (b"false", b"0"), (b"False", b"0"), (b"FALSE", b"0"))


def read_lines(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of a text file, block by block; blank lines are passed over.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events, and knows the layout of the lines.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        In strict reading, at the first line that is no event.
    """
    layout: TextLayout = decoder.header.layout
    number = layout.first_line
    rows = np.empty((_BLOCK_BYTES // _LEAST_LINE_BYTES, 4), np.int64)
    with path.open("rb") as file:
        file.seek(decoder.header.offset)
        while data := file.read(_BLOCK_BYTES) + file.readline():
            closer = _CLOSER_BYTES
            while data:
                n, used = _plain(data, layout, rows)
                if n:
                    yield decoder.validate(rows[:n], number)
                    number, data, closer = number + n, data[used:], _CLOSER_BYTES
                    continue
                lines = BytesIO(data).readlines(closer)
                yield from _read(lines, number, decoder)
                number, data, closer = number + len(lines), data[sum(map(len, lines)) :], 2 * closer


def _plain(data: bytes, layout: TextLayout, rows: Ints) -> tuple[int, int]:
    """Read the plain lines that text begins with; return how many, and how many bytes they have."""
    separator = layout.separator or " "
    if layout.unit != "us" or len(set(layout.columns)) < 4:
        return 0, 0
    n, used = parse_plain(np.frombuffer(data, np.uint8), ord(separator), np.array(layout.columns, np.int64), rows)
    return n, used


def _read(lines: list[bytes], number: int, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of lines; the first has a number in the file."""
    layout: TextLayout = decoder.header.layout
    for start, run in _runs(lines):
        rows = _rows(run, layout)
        if rows is not None:
            yield decoder.validate(rows, number + start)
        else:
            yield from _line_by_line(run, number + start, decoder)


def _runs(lines: list[bytes]) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the lines between blank lines, each run with the number of its first line, counted from 0."""
    start = 0
    for i in range(len(lines) + 1):
        if i == len(lines) or lines[i].isspace():
            if i > start:
                yield start, lines[start:i]
            start = i + 1


def _rows(lines: list[bytes], layout: TextLayout) -> Ints | None:
    """Return lines as rows of x, y, p, t [us]; None where one of them is not an event."""
    if b"e" in lines[0] or b"E" in lines[0] or b"e" in lines[-1]:
        lines = [_without_words(line) for line in lines]
    kinds: tuple[type[np.int64] | type[np.float64], ...] = (np.int64, np.float64)
    for kind in kinds:
        try:
            table = np.loadtxt(lines, kind, comments=None, delimiter=layout.separator, usecols=layout.columns, ndmin=2)
        except (ValueError, OverflowError):
            continue
        return _in_us(table, layout.unit) if len(table) == len(lines) else None
    return None


def _without_words(line: bytes) -> bytes:
    """Return a line with 1 and 0 where it says true and false."""
    for word, digit in _TRUTHS:
        line = line.replace(word, digit)
    return line


def _in_us(table: npt.NDArray[Any], unit: str) -> Ints | None:
    """Return a table with its times in whole microseconds; None where a number is not whole or too large."""
    rows = np.empty(table.shape, np.int64)
    for k, column in enumerate(table.T):
        if k == 3 and unit != "us":
            in_us = column // 1000 if unit == "ns" and column.dtype.kind == "i" else column * US_OF[unit]
            rows[:, k], usable = as_integers(in_us, rounded=True)
        else:
            rows[:, k], usable = as_integers(column)
        if not usable.all():
            return None
    return rows if (np.abs(rows[:, 3]) < MAX_TIME_US).all() else None


def _line_by_line(lines: list[bytes], number: int, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of lines of which some are not events; those are an error, or counted and left out."""
    layout: TextLayout = decoder.header.layout
    for i, line in enumerate(lines):
        rows = _rows([line], layout)
        if rows is not None:
            yield decoder.validate(rows, number + i)
            continue
        if not decoder.lenient:
            text = line.decode("utf-8", errors="replace").strip()[:60]
            what = "whole numbers for x, y, p and t in us"
            if layout.unit != "us":
                what = f"whole numbers for x, y and p, and t in {layout.unit}"
            message = f"line {number + i:,} is {text!r}; each line holds {what}"
            raise RecordingError(f"{decoder.path}: {message}; correct it or export the file again, {LENIENT_HINT}")
        decoder.count(LINE)
