"""Read the header of an AEDAT4 file: a flatbuffer with an XML text that describes the tracks."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

from bicode_lab.recordings.aedat.aedat4 import Tracks
from bicode_lab.recordings.formats import Header, RecordingError, raise_unless_lenient


def read_aedat4_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Read an AEDAT4 header, and walk through the packet lengths so that a cut file is noticed.

    Parameters
    ----------
    path : Path
        The file, for messages.
    file : binary file
        Open for reading.
    lenient : bool
        Accept a file that ends anywhere after its header.

    Returns
    -------
    Header

    Raises
    ------
    RecordingError
        If the header is damaged or tells of no events; in strict reading also if the file is cut short.
    """
    total = os.fstat(file.fileno()).st_size
    file.seek(14)
    length = int.from_bytes(file.read(4), "little")
    table = file.read(min(length, total))
    offset = 18 + length
    try:
        end, compression, description = _parse_aedat_head(table if len(table) == length else b"")
        size_px, events, triggers = _tracks(description)
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
    tracks = Tracks(end=end, compression=compression, events=events, triggers=triggers)
    return Header(format="AEDAT4", size_px=size_px, offset=offset, layout=tracks)


def _parse_aedat_head(table: bytes) -> tuple[int, int, str]:
    """Return from the flatbuffer 'IOHE' where its packets end (-1: end of file), their compression and its XML text."""
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
    return end, compression, text.decode("utf-8")


def _tracks(description: str) -> tuple[tuple[int, int] | None, int, int]:
    """Return the size of the first track of events in the XML of a file, its number, and that of triggers or -1."""
    size_px, events, triggers = None, -1, -1
    for track in ElementTree.fromstring(description).iterfind("node[@name='outInfo']/node"):
        kind = track.findtext("attr[@key='typeIdentifier']")
        if kind == "EVTS" and events < 0:
            width, height = (track.findtext(f"node[@name='info']/attr[@key='size{side}']") for side in "XY")
            size_px, events = (int(width or ""), int(height or "")), int(track.get("name", ""))
        elif kind == "TRIG" and triggers < 0:
            triggers = int(track.get("name", ""))
    return size_px, events, triggers
