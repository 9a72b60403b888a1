"""Read the header of an event file: its format, its sensor size and where the events begin.

The content tells the format, never the name: by a magic number, or by the '%' lines at the beginning of a vendor's
RAW or DAT file. A name that contradicts the content is an error. Every error is one line that says where and what is
wrong, which rule is broken, and the way out.
"""

from __future__ import annotations

import os
import re
import struct
import zipfile
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

from bicode_lab.recordings.formats import EXTENSIONS, READABLE, Header, RecordingError, raise_unless_lenient
from bicode_lab.recordings.hdf5 import read_hdf5_header

_OTHER_FILES = {
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"%PDF": "a PDF document",
    b"MATLAB": "a MATLAB file",
    b"\x1f\x8b": "a gzip archive",
    b"#!AER-DAT": "an AEDAT file older than version 4",
    b"\x93NUMPY": "a single numpy array",
}

# Sensor sizes by what a vendor's header says, such as 'sensor_generation 4.2' or 'plugin_name hal_plugin_gen3_fx3'.
_SENSOR_SIZES = (
    (r"genx?320", (320, 320)),
    (r"gen3", (640, 480)),
    (r"gen4|imx636|imx646", (1280, 720)),
)


def read_header(path: Path, lenient: bool = False) -> Header:
    """Read the header of an event file.

    Parameters
    ----------
    path : Path
        The file to read.
    lenient : bool
        Accept any name, and a file that ends anywhere after its format is known.

    Returns
    -------
    Header

    Raises
    ------
    RecordingError
        If the file is missing, a directory, unreadable, empty or not an event file; in strict reading also if it
        has no events after its header, ends inside an event, or has the name of another format.
    """
    if not path.exists():
        raise RecordingError(f"{path}: no such file; check the path")
    if not path.is_file():
        what = "a directory" if path.is_dir() else "not a regular file"
        raise RecordingError(f"{path}: {what}; give one event file ({READABLE})")
    try:
        with path.open("rb") as file:
            header = _read_open_file(path, file, lenient)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error.strerror}); check its permissions") from None
    suffix = path.suffix.lower()
    known = {extension for extensions in EXTENSIONS.values() for extension in extensions}
    if suffix in known and suffix not in EXTENSIONS[header.format]:
        right = EXTENSIONS[header.format][0]
        raise_unless_lenient(lenient, f"{path}: named {suffix} but holds {header.format}; rename it to end in {right}")
    return header


def _read_open_file(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Tell the format of an open file from its first bytes, and read its header."""
    start = file.read(512)
    file.seek(0)
    if not start:
        raise RecordingError(f"{path}: empty (0 bytes); record or copy it again")
    if start.startswith(b"#!AER-DAT4.0\r\n"):
        return _read_aedat_header(path, file, lenient)
    if start.startswith(b"Event Stream"):
        return _read_es_header(path, start, lenient)
    if start.startswith(b"PK\x03\x04") or (path.suffix.lower() == ".npz" and start.startswith(b"PK")):
        return _read_npz_header(path)
    if start.startswith(b"\x89HDF\r\n\x1a\n"):
        return read_hdf5_header(path)
    for magic, what in _OTHER_FILES.items():
        if start.startswith(magic):
            raise RecordingError(f"{path}: not an event file but {what}; give {READABLE}")
    if start.startswith(b"%"):
        return _read_vendor_header(path, file, lenient)
    return _read_csv_header(path, file, lenient)


def _read_vendor_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Read the '%' lines of a RAW or DAT file."""
    fields, offset = _vendor_fields(path, file, lenient)
    kind = fields.get("format", "").partition(";")[0] or ("EVT" + fields["evt"] if "evt" in fields else "")
    kind = kind.upper().removesuffix(".0")
    total = os.fstat(file.fileno()).st_size
    if not kind and "version" in fields:
        kind = "DAT" if fields["version"] in ("2", "2.0") else "DAT version " + fields["version"][:20]
        file.seek(offset)
        if total > offset and file.read(2) not in (b"\x0c\x08", b"\x0c"):
            raise RecordingError(
                f"{path}: no CD events of 8 bytes announced at byte {offset}; give a DAT file of CD events"
            )
        offset += 2
    if kind not in ("EVT2", "EVT3", "DAT"):
        found = f"the header says {kind}" if kind else "the header names no event format"
        raise RecordingError(f"{path}: {found}; give EVT2, EVT3 or DAT version 2 (convert with the vendor's tools)")
    if total <= offset:
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {total}: no events; record or copy it again"
        )
    word = {"EVT2": 4, "EVT3": 2, "DAT": 8}[kind]
    if rest := (total - offset) % word:
        at = total - rest
        raise_unless_lenient(
            lenient, f"{path}: cut short at byte {at}: {rest} of the {word} bytes of a word; copy it again"
        )
    size_px, size_from = _vendor_size(fields)
    t0 = fields.get("t0", "0")
    if not re.fullmatch(r"\d{1,18}", t0, re.ASCII):
        raise_unless_lenient(
            lenient, f"{path}: the header's t0 is {t0[:20]!r}, not whole microseconds; correct it or leave it out"
        )
        t0 = "0"
    return Header(format=kind, size_px=size_px, size_from=size_from, offset=offset, t0_us=int(t0))


def _vendor_fields(path: Path, file: BinaryIO, lenient: bool) -> tuple[dict[str, str], int]:
    """Return the fields of the '%' lines by name, and the byte after them."""
    fields: dict[str, str] = {}
    offset = 0
    while (line := file.readline(4096)).startswith(b"%"):
        try:
            name, _, value = line[1:].decode("utf-8").strip().partition(" ")
        except UnicodeDecodeError:
            break  # event bytes that happen to begin with a '%'
        offset += len(line)
        if not line.endswith(b"\n"):
            raise_unless_lenient(lenient, f"{path}: cut short in the header, at byte {offset}; copy it again")
            break
        fields[name.lower()] = value.strip()
        if name == "end":
            break
    return fields, offset


def _vendor_size(fields: dict[str, str]) -> tuple[tuple[int, int] | None, str]:
    """Return the sensor size that header fields state or imply, and where it comes from."""
    if found := re.fullmatch(r"(\d+)\s*x\s*(\d+)", fields.get("geometry", "")):
        return (int(found[1]), int(found[2])), "file"
    in_format = dict(part.split("=", 1) for part in fields.get("format", "").split(";") if "=" in part)
    width, height = (fields.get(name, in_format.get(name, "")) for name in ("width", "height"))
    if width.isdecimal() and height.isdecimal():
        return (int(width), int(height)), "file"
    generation = fields.get("sensor_generation", "")
    names = f"gen{generation} {fields.get('plugin_name', '')} {fields.get('sensor_name', '')}".lower()
    for pattern, size_px in _SENSOR_SIZES:
        if re.search(pattern, names):
            return size_px, "sensor"
    return None, "file"


def _read_es_header(path: Path, start: bytes, lenient: bool) -> Header:
    """Read an Event Stream header: 12 bytes of magic number, 3 of version, 1 of type, 4 of size."""
    if len(start) < 20:
        raise RecordingError(f"{path}: cut short in the header, at byte {len(start)} of 20; copy it again")
    if start[12] != 2 or start[15] not in (1, 2):
        found = f"version {start[12]}, type {start[15]}"
        raise RecordingError(f"{path}: Event Stream {found}; give version 2, type 1 (DVS) or 2 (ATIS)")
    if path.stat().st_size == 20:
        raise_unless_lenient(lenient, f"{path}: ends after its header, at byte 20: no events; record or copy it again")
    width, height = struct.unpack_from("<HH", start, 16)
    return Header(format="ES", size_px=(width, height), offset=20, atis=start[15] == 2)


def _read_npz_header(path: Path) -> Header:
    """Check that an npz file has arrays x, y, p and t; `npz` reads them, and the size where it is stated."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = {Path(name).stem for name in archive.namelist() if name.endswith(".npy")}
    except Exception:  # a damaged directory can make zipfile raise almost anything
        raise RecordingError(f"{path}: damaged or cut short: not a whole npz file; write or copy it again") from None
    if missing := [name for name in "xypt" if name not in names]:
        has = ", ".join(sorted(names)) or "none"
        raise RecordingError(f"{path}: arrays missing: {', '.join(missing)} (found: {has}); give x, y, p, t")
    return Header(format="npz")


def _read_csv_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Read the first line of a CSV file: column names, perhaps with the size as faery writes it (x@1280,y@720)."""
    line = file.readline(4096)
    text = line.decode("utf-8", errors="replace").strip().lower()
    if "\ufffd" in text or not text.isprintable():
        raise RecordingError(f"{path}: not an event file; give {READABLE}")
    columns = {}
    size = {}
    for position, name in enumerate(text.split(",")):
        short, _, limit = name.strip().partition("@")
        short = {"on": "p", "polarity": "p", "timestamp": "t"}.get(short, short)
        columns[short] = position
        if limit.isdecimal():
            size[short] = int(limit)
    if any(name not in columns for name in "xypt"):
        if path.suffix.lower() != ".csv":
            raise RecordingError(f"{path}: not an event file; give {READABLE}")
        raise RecordingError(f"{path}: line 1 is {text[:60]!r}; begin a CSV with its column names, such as t,x,y,p")
    if path.stat().st_size == len(line):
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {len(line)}: no events; write or copy it again"
        )
    x, y, p, t = (columns[name] for name in "xypt")
    size_px = (size["x"], size["y"]) if {"x", "y"} <= size.keys() else None
    return Header(format="CSV", size_px=size_px, offset=len(line), columns=(x, y, p, t))


def _read_aedat_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Read an AEDAT4 header, and walk through the packet lengths so that a cut file is noticed.

    This is done with care, because faery can crash the whole process where a header is damaged.
    """
    total = os.fstat(file.fileno()).st_size
    file.seek(14)
    length = int.from_bytes(file.read(4), "little")
    table = file.read(min(length, total))
    offset = 18 + length
    try:
        end, description = _parse_aedat_head(table if len(table) == length else b"")
        size_px = _aedat_size(description)
    except (struct.error, UnicodeDecodeError, ElementTree.ParseError, ValueError):
        raise RecordingError(
            f"{path}: cut short or damaged in the header, before byte {offset}; copy it again"
        ) from None
    if size_px is None:
        raise RecordingError(f"{path}: holds no track of events; give an AEDAT4 file recorded with events")
    if end > total:
        raise_unless_lenient(
            lenient, f"{path}: cut short at byte {total}: its packets end at byte {end}; copy it again"
        )
    if total <= offset or end == offset:
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {offset}: no events; record or copy it again"
        )
    end = total if end == -1 else min(end, total)
    at = offset
    while at < end:
        file.seek(at + 4)
        length = int.from_bytes(file.read(4), "little")
        if at + 8 + length > end:
            raise_unless_lenient(lenient, f"{path}: cut short in the packet at byte {at} of {end}; copy it again")
        at += 8 + length
    return Header(format="AEDAT4", size_px=size_px, offset=offset)


def _parse_aedat_head(table: bytes) -> tuple[int, str]:
    """Return from the flatbuffer 'IOHE' the byte at which its packets end (-1: end of file), and its XML text."""
    if table[4:8] != b"IOHE":
        raise ValueError("not an IOHeader")
    (root,) = struct.unpack_from("<I", table, 0)
    fields = root - struct.unpack_from("<i", table, root)[0]
    if fields < 0:
        raise ValueError("fields outside the header")
    size, _, in_compression, in_end, in_description = struct.unpack_from("<5H", table, fields)
    if size < 10 or not in_description:
        raise ValueError("no description")
    compression = struct.unpack_from("<i", table, root + in_compression)[0] if in_compression else 0
    end = struct.unpack_from("<q", table, root + in_end)[0] if in_end else -1
    if end < -1 or not 0 <= compression <= 4:
        raise ValueError("no such compression or place")
    at = root + in_description
    at += struct.unpack_from("<I", table, at)[0]
    (length,) = struct.unpack_from("<I", table, at)
    (text,) = struct.unpack_from(f"<{length}s", table, at + 4)
    return end, text.decode("utf-8")


def _aedat_size(description: str) -> tuple[int, int] | None:
    """Return the sensor size of the first event track in the XML of an AEDAT4 file, or None."""
    for track in ElementTree.fromstring(description).iterfind("node[@name='outInfo']/node"):
        if track.findtext("attr[@key='typeIdentifier']") == "EVTS":
            width, height = (track.findtext(f"node[@name='info']/attr[@key='size{side}']") for side in "XY")
            return int(width or ""), int(height or "")
    return None
