"""Read the '%' lines at the beginning of a vendor's RAW or DAT file."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bicode_lab.recordings.formats import Header, RecordingError, raise_unless_lenient

# Sensor sizes by what a vendor's header says, such as 'sensor_generation 4.2' or 'plugin_name hal_plugin_gen3_fx3'.
_SENSOR_SIZES = (
    (r"genx?320", (320, 320)),
    (r"gen3", (640, 480)),
    (r"gen4|imx636|imx646", (1280, 720)),
)
_WORD_BYTES = {"EVT2": 4, "EVT2.1": 8, "EVT3": 2, "EVT4": 4, "DAT": 8}
_EVENT2D, _CD, _TRIGGER = 0, 12, 14  # types of a DAT file; the first two have the same 8 bytes
_SAMPLE_WORDS = 4096


def read_vendor_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Return the header of a RAW or DAT file.

    Parameters
    ----------
    path : Path
        The file, for messages.
    file : binary file
        Open at its start.
    lenient : bool
        Accept a file that ends anywhere after its format is known.

    Returns
    -------
    Header

    Raises
    ------
    RecordingError
        If the format is unknown; in strict reading also if the file has no events, or ends inside a word.
    """
    fields, offset = _vendor_fields(path, file, lenient)
    kind = fields.get("format", "").partition(";")[0] or ("EVT" + fields["evt"] if "evt" in fields else "")
    kind = kind.upper().removesuffix(".0").replace("EVT21", "EVT2.1")
    total = os.fstat(file.fileno()).st_size
    if not kind and "version" in fields:
        kind = "DAT" if fields["version"] in ("2", "2.0") else "DAT version " + fields["version"][:20]
        _check_dat_type(path, file, offset, total)
        offset += 2
    if kind not in _WORD_BYTES:
        found = f"the header says {kind}" if kind else "the header names no event format"
        raise RecordingError(
            f"{path}: {found}; give EVT2, EVT2.1, EVT3, EVT4 or DAT version 2 (the vendor's tools convert)"
        )
    if total <= offset:
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {total}: no events; record or copy it again"
        )
    word = _WORD_BYTES[kind]
    if rest := (total - offset) % word:
        at = total - rest
        raise_unless_lenient(
            lenient, f"{path}: cut short at byte {at}: {rest} of the {word} bytes of a word; copy it again"
        )
    size_px, size_from = _vendor_size(fields)
    return Header(
        format=kind,
        size_px=size_px,
        size_from=size_from,
        offset=offset,
        t0_us=_start_of_clock(path, fields.get("t0", "0"), lenient),
        swapped=kind == "EVT2.1" and _has_swapped_halves(fields, file, offset),
    )


def _check_dat_type(path: Path, file: BinaryIO, offset: int, total: int) -> None:
    """Raise RecordingError unless the two bytes after the lines of a DAT file announce CD events of 8 bytes."""
    file.seek(offset)
    kind = file.read(2)
    if kind[:1] == bytes([_TRIGGER]):
        raise RecordingError(f"{path}: holds external triggers and no events; give the file of CD events beside it")
    if total > offset and (kind[0] not in (_EVENT2D, _CD) or kind[1:] not in (b"\x08", b"")):
        raise RecordingError(
            f"{path}: no CD events of 8 bytes announced at byte {offset}; give a DAT file of CD events"
        )


def _start_of_clock(path: Path, t0: str, lenient: bool) -> int:
    """Return the time that a header says was taken off every event [us]."""
    if re.fullmatch(r"\d{1,18}", t0, re.ASCII):
        return int(t0)
    raise_unless_lenient(
        lenient, f"{path}: the header's t0 is {t0[:20]!r}, not whole microseconds; correct it or leave it out"
    )
    return 0


def _vendor_fields(path: Path, file: BinaryIO, lenient: bool) -> tuple[dict[str, str], int]:
    """Return the fields of the '%' lines by name, and the byte after them."""
    fields: dict[str, str] = {}
    offset = 0
    while (line := file.readline(4096)).startswith(b"%"):
        text = _as_text(line[1:])
        if text is None:
            break  # event bytes that happen to begin with a '%'
        name, _, value = text.strip().partition(" ")
        offset += len(line)
        if not line.endswith(b"\n"):
            raise_unless_lenient(lenient, f"{path}: cut short in the header, at byte {offset}; copy it again")
            break
        fields[name.lower()] = value.strip()
        if name == "end":
            break
    return fields, offset


def _as_text(line: bytes) -> str | None:
    """Return a line of a header as text, in UTF-8 or else with one byte a letter; None if it is no text."""
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        is_text = re.fullmatch(rb" ?\w+ [^\x00-\x08\x0b-\x1f\x7f]*\n", line.replace(b"\r\n", b"\n"))
        return line.decode("latin-1") if is_text else None


def _fields_of_format(fields: dict[str, str]) -> dict[str, str]:
    """Return what the field ``format`` says beside the name of the format, such as width=1280."""
    return dict(part.split("=", 1) for part in fields.get("format", "").split(";") if "=" in part)


def _vendor_size(fields: dict[str, str]) -> tuple[tuple[int, int] | None, str]:
    """Return the sensor size that header fields state or imply, and where it comes from."""
    if found := re.fullmatch(r"(\d+)\s*x\s*(\d+)", fields.get("geometry", "")):
        return (int(found[1]), int(found[2])), "file"
    in_format = _fields_of_format(fields)
    width, height = (fields.get(name, in_format.get(name, "")) for name in ("width", "height"))
    if width.isdecimal() and height.isdecimal():
        return (int(width), int(height)), "file"
    generation = fields.get("sensor_generation", "")
    names = f"gen{generation} {fields.get('plugin_name', '')} {fields.get('sensor_name', '')}".lower()
    for pattern, size_px in _SENSOR_SIZES:
        if re.search(pattern, names):
            return size_px, "sensor"
    return None, "file"


def _has_swapped_halves(fields: dict[str, str], file: BinaryIO, offset: int) -> bool:
    """Return whether the half of an EVT2.1 word that tells its kind comes first in the file.

    Sensors of the generation IMX636 send the halves so, and then ``endianness`` is "legacy". Where the header does not
    say it, that half is the one with more time words.
    """
    if stated := _fields_of_format(fields).get("endianness") or fields.get("endianness"):
        return stated.strip().lower() == "legacy"
    file.seek(offset)
    data = file.read(8 * _SAMPLE_WORDS)
    kinds = np.frombuffer(data, "<u4", count=len(data) // 8 * 2).reshape(-1, 2) >> 28
    first, second = (kinds == 8).sum(axis=0)
    return bool(first > second)
