"""Read AEDAT files of version 3.1, which cAER and DV 1.0 write: packets of events of one kind.

A packet has a head of 28 bytes: kind and source (16 bits each), bytes of an event, place of the time in it, turns of
the clock, how many events there is room for, how many there are, how many are valid (32 bits each). Kind 1 are polarity
events: 32 bits (from the lowest: valid, polarity, 15 of y, 15 of x) and 32 bits of time [us]. Kind 0 are special
events; 2, 3 and 4 of these are edges and pulses of an external trigger.

Facts: docs.inivation.com, "AEDAT file formats".
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Columns, Decoder
from bicode_lab.recordings.formats import Header, RecordingError, raise_unless_lenient
from bicode_lab.recordings.validate import CUT, LENIENT_HINT, REST, Ints

_HEAD = struct.Struct("<hhiiiiii")
_SPECIAL, _POLARITY = 0, 1
_TRIGGER_KINDS = {2: 1, 3: 0, 4: 1}  # rising edge, falling edge, pulse: the level after it
_SIZES_PX = {"DVS128": (128, 128), "DAVIS240": (240, 180), "DAVIS208": (208, 192), "DAVIS346": (346, 260),
             "DAVIS640": (640, 480), "DAVIS128": (128, 128)}  # fmt: skip


def read_aedat3_header(path: Path, file: BinaryIO, lenient: bool) -> Header:
    """Return the header of an AEDAT file of version 3.1: lines up to ``#!END-HEADER``.

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

    Raises
    ------
    RecordingError
        If the header does not end, or the packets are compressed; in strict reading also if there are none.
    """
    start = file.read(1 << 16)
    end = start.find(b"#!END-HEADER")
    offset = start.find(b"\n", end) + 1
    if end < 0 or not offset:
        raise RecordingError(f"{path}: cut short or damaged in the header, before byte {len(start)}; copy it again")
    text = start[:end].decode("latin-1")
    version = text[2:].split("\n")[0].strip()
    found = re.search(r"#\s*Format:\s*(\S+)", text)
    packing = found[1] if found else "RAW"
    if version != "AER-DAT3.1" or packing.upper() != "RAW":
        raise RecordingError(
            f"{path}: {version[:20]} with packets of the format {packing[:20]}; give AER-DAT3.1 with the format RAW"
        )
    if path.stat().st_size <= offset:
        raise_unless_lenient(
            lenient, f"{path}: ends after its header, at byte {offset}: no events; record or copy it again"
        )
    source = " ".join(re.findall(r"#\s*Source[^\n]*", text))
    size_px = next((size for name, size in _SIZES_PX.items() if re.search(name, source, re.IGNORECASE)), None)
    return Header(format="AEDAT3.1", size_px=size_px, offset=offset)


def read_aedat3(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an AEDAT file of version 3.1, packet by packet.

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
        In strict reading, if the head of a packet is damaged or the file is cut short.
    """
    with path.open("rb") as file:
        file.seek(decoder.header.offset)
        total = path.stat().st_size
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            kind, _, size, at_time, turns, room, n, _ = _HEAD.unpack(head)
            at = file.tell()
            if kind < 0 or size < 8 or not 0 <= at_time <= size - 4 or not 0 <= n <= room or turns < 0:
                _refuse(decoder, REST, f"the head of the packet at byte {at - _HEAD.size} is damaged", at)
                return
            data = file.read(min(n * size, total - at))
            if len(data) < n * size:
                _refuse(decoder, CUT, f"cut short in the packet at byte {at - _HEAD.size}", at, len(data) % size or 1)
            file.seek(min(at + room * size, total))
            if kind in (_SPECIAL, _POLARITY):
                rows = np.frombuffer(data, "u1", count=len(data) // size * size).reshape(-1, size)
                word = rows[:, :4].copy().view("<u4").ravel().astype(np.int64)
                time = rows[:, at_time : at_time + 4].copy().view("<i4").ravel().astype(np.int64) + (turns << 31)
                word, time = word[word & 1 == 1], time[word & 1 == 1]
                if kind == _POLARITY:
                    yield decoder.filter(_columns(word, time))
                else:
                    _keep_triggers(decoder, word >> 1 & 0x7F, time)
        if head:
            _refuse(decoder, CUT, f"cut short in the head of a packet at byte {total - len(head)}", total, len(head))


def _columns(word: Ints, time: Ints) -> Columns:
    """Return the columns of polarity events."""
    return word >> 17 & 0x7FFF, word >> 2 & 0x7FFF, word >> 1 & 1, time


def _keep_triggers(decoder: Decoder, kinds: Ints, time: Ints) -> None:
    """Keep the external triggers among special events."""
    for kind, level in _TRIGGER_KINDS.items():
        chosen = time[kinds == kind]
        decoder.add_triggers(np.stack([chosen, np.zeros_like(chosen), np.full_like(chosen, level)], axis=1))


def _refuse(decoder: Decoder, rule: int, what: str, at: int, count: int = 1) -> None:
    """Raise RecordingError in strict reading; note the offence in lenient reading."""
    raise_unless_lenient(decoder.lenient, f"{decoder.path}: {what}; copy it again, {LENIENT_HINT}")
    decoder.note_end(rule, count, at)
