"""Read AEDAT files of version 2, which jAER writes: 32 bits of address and 32 bits of time [us] for each event.

Both numbers have the highest byte first. The bits of an address depend on the camera, from the lowest bit up:

    DVS128   1 bit of polarity (0 is ON), 7 of x, 7 of y, 1 that marks an external trigger
    DAVIS    12 bits of other data (bit 10 marks an external trigger, bit 11 is the polarity), 10 of x, 9 of y, 1 that
             marks frames and motion, which are passed over

Both count columns from the right and rows from the bottom. Facts: docs.inivation.com, "AEDAT file formats".
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError, raise_unless_lenient
from bicode_lab.recordings.raw.blocks import read_words
from bicode_lab.recordings.validate import CUT, Ints

_BLOCK_BYTES = 1 << 18
_SIZES_PX = {"DVS128": (128, 128), "DAVIS240": (240, 180), "DAVIS208": (208, 192), "DAVIS346": (346, 260),
             "DAVIS640": (640, 480)}  # fmt: skip


@dataclass(frozen=True)
class _Bits:
    """Where an address has its parts: masks before the shift."""

    x: tuple[int, int]
    y: tuple[int, int]
    on: int
    is_on_if_set: bool
    other: int
    trigger: int


_DVS128 = _Bits(x=(0xFE, 1), y=(0x7F00, 8), on=1, is_on_if_set=False, other=0, trigger=0x8000)
_DAVIS = _Bits(x=(0x3FF000, 12), y=(0x7FC00000, 22), on=0x800, is_on_if_set=True, other=1 << 31, trigger=0x400)


def read_aedat2_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Return the header of an AEDAT file of version 2: lines that begin with '#'.

    Parameters
    ----------
    path : Path
        The file, for messages.
    file : binary file
        Open at its start.
    lenient : bool
        Accept a file that ends anywhere after its header.

    Returns
    -------
    Header
        Its layout is "DVS128" or "DAVIS".

    Raises
    ------
    RecordingError
        In strict reading, if the file has no events or ends inside one.
    """
    offset, lines = 0, []
    while (line := file.readline(4096)).startswith(b"#") and re.fullmatch(rb"[^\x00-\x08\x0e-\x1f]*\n", line):
        offset += len(line)
        lines.append(line.decode("latin-1"))
    total = path.stat().st_size
    if total <= offset:
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {offset}: no events; record or copy it again"
        )
    if rest := (total - offset) % 8:
        raise_unless_lenient(
            lenient, f"{path}: cut short at byte {total - rest}: {rest} of the 8 bytes of an event; copy it again"
        )
    named = next((name for name in _SIZES_PX if re.search(name, "".join(lines), re.IGNORECASE)), "")
    if not named:
        file.seek(offset)
        data = file.read(1 << 16)
        addresses = np.frombuffer(data, ">u4", count=len(data) // 8 * 2)[::2]
        named = "" if (addresses >> 16).any() else "DVS128"
    layout = "DVS128" if named == "DVS128" else "DAVIS"
    return Header(format="AEDAT2", size_px=_SIZES_PX.get(named), offset=offset, layout=layout)


def read_aedat2(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an AEDAT file of version 2.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        If the header does not say which camera it was, and nobody told the size.
    """
    bits = _DVS128 if decoder.header.layout == "DVS128" else _DAVIS
    yield from read_words(decoder, "DAT", _as_dat(path, decoder, bits))


def _as_dat(path: Path, decoder: Decoder, bits: _Bits) -> Iterator[bytes]:
    """Yield the events of the file as those of a DAT file, which has the same clock of 32 bits."""
    sides = decoder.sides_px
    with path.open("rb") as file:
        file.seek(decoder.header.offset)
        while data := file.read(_BLOCK_BYTES):
            if rest := len(data) % 8:
                decoder.note_end(CUT, rest)
            pairs = np.frombuffer(data, ">u4", count=len(data) // 8 * 2).reshape(-1, 2).astype(np.int64)
            address, time = pairs[:, 0], pairs[:, 1]
            is_trigger = (address & bits.trigger != 0) & (address & bits.other == 0)
            is_event = ~is_trigger & (address & bits.other == 0)
            if is_trigger.any():
                marks = np.zeros((int(is_trigger.sum()), 3), np.int64)
                marks[:, 0], marks[:, 2] = time[is_trigger], 1
                decoder.add_triggers(marks)
            yield _words(address[is_event], time[is_event], bits, sides).tobytes()


def _words(address: Ints, time: Ints, bits: _Bits, sides: tuple[int, int]) -> Ints:
    """Return addresses and times as the 64-bit words of a DAT file."""
    x, y = (
        (side - 1 - ((address & mask) >> by)) & 0x3FFF for (mask, by), side in zip((bits.x, bits.y), sides, strict=True)
    )
    p = ((address & bits.on) != 0) == bits.is_on_if_set
    return np.asarray(time | x << 32 | y << 46 | p.astype(np.int64) << 60, "<i8")


def unknown_camera(path: Path) -> RecordingError:
    """Return the error of a file whose header names no camera that is known here."""
    names = ", ".join(_SIZES_PX)
    return RecordingError(f"{path}: the header names no camera of {names}; give --width and --height")
