"""Read the first lines of a text file: comments, the sensor size, the names of the columns, the first events."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import BinaryIO

from bicode_lab.recordings.formats import READABLE, Header, RecordingError, raise_unless_lenient
from bicode_lab.recordings.text.layout import (
    TextLayout,
    is_number,
    layout_of_names,
    layout_of_numbers,
    separator_of,
    short_name,
)

_MAX_HEAD_LINES = 200
_SAMPLE_LINES = 200
_LONGEST_LINE = 4096
_BOM = b"\xef\xbb\xbf"
GEOMETRY = re.compile(rb"(?:\xef\xbb\xbf)?%\s*geometry\s*[:=]\s*(\d{1,6})\s*[,x ]\s*(\d{1,6})", re.IGNORECASE)
"""The first line of the CSV files that the vendor's decoder writes; then x,y,p,t follow without column names."""


def read_text_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Return the header of a text file with one event a line.

    Parameters
    ----------
    path : Path
        The file, for messages.
    file : binary file
        Open at its start.
    lenient : bool
        Accept a file without events.

    Returns
    -------
    Header
        Its layout is a `TextLayout`.

    Raises
    ------
    RecordingError
        If the lines are no text, or no events are found in them.
    """
    head: list[str] = []
    size_px: tuple[int, int] | None = None
    vendor = False
    while len(head) < _MAX_HEAD_LINES:
        offset = file.tell()
        raw = file.readline(_LONGEST_LINE)
        text = _printable(path, raw)
        if not raw or _is_row(text):
            break
        head.append(text)
        if found := GEOMETRY.match(raw):
            size_px, vendor = (int(found[1]), int(found[2])), True
        elif re.fullmatch(r"\d{1,6}[\s,x]+\d{1,6}", text):
            width, height = re.split(r"[\s,x]+", text)
            size_px = (int(width), int(height))
    file.seek(offset)
    if offset == 0 and file.read(len(_BOM)) != _BOM:
        file.seek(offset)
    offset = file.tell()
    sample = [line.decode("utf-8", "replace") for line in file.readlines(1 << 16)[:_SAMPLE_LINES]]
    sample = [line for line in sample if line.strip()]
    layout = _layout(head, sample, len(head) + 1, vendor)
    if layout is None:
        raise _not_events(path, head, sample)
    if not sample:
        total = os.fstat(file.fileno()).st_size
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {total}: no events; write or copy it again"
        )
    kind = "text" if layout.separator is None else "CSV"
    return Header(format=kind, size_px=size_px or _size_in_names(head), offset=offset, layout=layout)


def _printable(path: Path, raw: bytes) -> str:
    """Return a line of the head as text, after checking that it is text."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise RecordingError(f"{path}: text of 16-bit letters (UTF-16); save it as UTF-8 text")
    text = raw.removeprefix(_BOM).decode("utf-8", errors="replace").strip()
    is_comment = text.startswith(("#", "%"))
    if ("\ufffd" in text and not is_comment) or not text.replace("\t", " ").replace("\ufffd", "?").isprintable():
        raise RecordingError(f"{path}: not an event file; give {READABLE}")
    return text


def _is_row(text: str) -> bool:
    """Return whether a line holds numbers in at least three columns: an event, not a head."""
    if not text or text[0] in "#%":
        return False
    cells = text.split(separator_of(text))
    return len(cells) >= 3 and sum(is_number(cell) for cell in cells) >= 3


def _layout(head: list[str], sample: list[str], first_line: int, vendor: bool) -> TextLayout | None:
    """Return how the lines hold their events: by the vendor's rule, by column names, or by the numbers themselves."""
    if vendor:
        return TextLayout(columns=(0, 1, 2, 3), separator=",", first_line=first_line)
    for line in reversed(head):
        names = line.lstrip("#%! ")
        separator = separator_of(names)
        if layout := layout_of_names(names.split(separator), separator_of(sample[0]) if sample else separator,
                                     sample, first_line):  # fmt: skip
            return layout
    if any(line and line[0] not in "#%" and not re.fullmatch(r"\d+[\s,x]+\d+", line) for line in head):
        return None
    return layout_of_numbers(sample, first_line)


def _size_in_names(head: list[str]) -> tuple[int, int] | None:
    """Return the size that column names state as faery writes it: x@1280,y@720."""
    sizes = {}
    for line in head:
        for name in line.split(","):
            short, _, limit = name.strip().partition("@")
            if limit.isdecimal():
                sizes[short_name(short)[0]] = int(limit)
    return (sizes["x"], sizes["y"]) if {"x", "y"} <= sizes.keys() else None


def _not_events(path: Path, head: list[str], sample: list[str]) -> RecordingError:
    """Return the error of a text whose lines are not understood as events."""
    if path.suffix.lower() not in (".csv", ".tsv", ".txt"):
        return RecordingError(f"{path}: not an event file; give {READABLE}")
    told = next((line for line in head if line and line[0] not in "#%"), "") or "".join(sample[:1]).strip()
    names = "begin a CSV with its column names, such as t,x,y,p"
    return RecordingError(f"{path}: line {len(head) if sample and head else 1} is {told[:60]!r}; {names}")
