"""Read the texts of variable length that an HDF5 file keeps in its heaps, without HDF5.

HDF5 itself never comes back from a heap with certain damage, and no signal stops it. A heap begins with "GCOL", has a
version, 3 free bytes and its length (64 bits), and then objects: number and count (16 bits each), 4 free bytes, length
(64 bits) and content up to a multiple of 8 bytes. Number 0 is the free rest. Facts: The HDF Group, "HDF5 File Format
Specification", section III.E.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

_SEARCHED_BYTES = 1 << 24  # at the beginning of the file, where its attributes are
_OBJECT = struct.Struct("<HH4xQ")
_LONGEST_TEXT = 4096


def heap_texts(path: Path) -> Iterator[str]:
    """Yield the texts in the heaps of an HDF5 file; what is damaged is passed over.

    Parameters
    ----------
    path : Path
        The file to read.

    Yields
    ------
    str
    """
    with path.open("rb") as file:
        data = file.read(_SEARCHED_BYTES)
    at = data.find(b"GCOL")
    while at >= 0:
        yield from _texts(data, at)
        at = data.find(b"GCOL", at + 4)


def _texts(data: bytes, start: int) -> Iterator[str]:
    """Yield the texts of the heap that begins at a byte."""
    if len(data) < start + 16:
        return
    end = min(start + int.from_bytes(data[start + 8 : start + 16], "little"), len(data))
    at = start + 16
    while at + _OBJECT.size <= end:
        number, _, length = _OBJECT.unpack_from(data, at)
        if number == 0 or length > end - at:
            return
        content = data[at + _OBJECT.size : at + _OBJECT.size + min(length, _LONGEST_TEXT)]
        yield content.rstrip(b"\0").decode("utf-8", "replace")
        at += _OBJECT.size + length + -length % 8
