"""Read the packets of an AEDAT4 file: events and external triggers.

A packet has the number of its track and its length (32 bits each), and a flatbuffer that may be compressed by LZ4 or
Zstd. A flatbuffer begins with its size and the place of its table; the first field of the table is a list: of events
(64 bits of time [us], 16 each of x and y, 8 of polarity, 24 free), or of the places of triggers, which are tables of a
time and a kind (1 rising edge, 2 falling edge, 3 pulse of an external signal). Facts: docs.inivation.com, "AEDAT file
formats", and the schemas of dv-processing.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import RecordingError, raise_unless_lenient, words_of
from bicode_lab.recordings.validate import LENIENT_HINT, REST

_EVENT = np.dtype([("t", "<i8"), ("x", "<i2"), ("y", "<i2"), ("p", "u1"), ("free", "u1", 3)])
_LEVELS = {1: 1, 2: 0, 3: 1}  # kinds of triggers that are external signals, and the level after each
_LARGEST_PACKET = 1 << 30


@dataclass(frozen=True, kw_only=True)
class Tracks:
    """What the header of an AEDAT4 file says of its packets."""

    end: int
    """Byte at which they end."""
    compression: int
    """0 none, 1 and 2 LZ4, 3 and 4 Zstd."""
    events: int
    """Number of the track with events."""
    triggers: int
    """Number of the track with triggers; -1 where there is none."""


def read_aedat4(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an AEDAT4 file, packet by packet.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events; the layout of its header is a `Tracks`.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        In strict reading, if a packet is damaged.
    """
    tracks: Tracks = decoder.header.layout
    unpack = _unpacker(path, tracks.compression)
    at = decoder.header.offset
    with path.open("rb") as file:
        while at + 8 <= tracks.end:
            file.seek(at)
            track, length = struct.unpack("<iI", file.read(8))
            if track in (tracks.events, tracks.triggers) and at + 8 + length <= tracks.end:
                try:
                    packet = unpack(file.read(length))
                    if track == tracks.triggers:
                        decoder.add_triggers(_triggers(packet))
                        events = None
                    else:
                        events = _events(packet)
                except Exception as error:  # a damaged packet can make the libraries raise almost anything
                    message = (
                        f"{path}: the packet at byte {at} is damaged ({words_of(error)}); copy it again, {LENIENT_HINT}"
                    )
                    raise_unless_lenient(decoder.lenient, message)
                    decoder.count(REST)
                    events = None
                if events is not None:
                    yield decoder.filter((events["x"], events["y"], events["p"], events["t"]))
            at += 8 + length


def _unpacker(path: Path, compression: int) -> Callable[[bytes], bytes]:
    """Return the function that undoes the compression of a packet."""
    if compression in (1, 2):
        import lz4.frame

        return lambda data: bytes(lz4.frame.decompress(data))
    if compression in (3, 4):
        zstd = _zstd()
        return lambda data: bytes(zstd.decompress(data))
    if compression:
        raise RecordingError(
            f"{path}: packets of the unknown compression {compression}; save it anew without compression"
        )
    return lambda data: data


def _zstd() -> Any:
    """Return the module that unpacks Zstd: Python's own from 3.14 on."""
    try:
        from compression import zstd  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        from backports import zstd
    return zstd


def _list(packet: bytes) -> tuple[int, int]:
    """Return where the list of a packet begins, and how many entries it has."""
    if len(packet) < 12 or len(packet) > _LARGEST_PACKET:
        raise ValueError(f"{len(packet)} bytes")
    table = 4 + _number(packet, 4, "I")
    place = _field(packet, table, 0)
    if not place:
        return 0, 0
    start = place + _number(packet, place, "I")
    return start + 4, _number(packet, start, "I")


def _number(packet: bytes, at: int, kind: str) -> int:
    """Return a number of a packet."""
    if at < 0:
        raise ValueError(f"a place before the packet: {at}")
    (value,) = struct.unpack_from(f"<{kind}", packet, at)
    return int(value)


def _field(packet: bytes, table: int, number: int) -> int:
    """Return where a field of a table is; 0 where it is missing."""
    fields = table - _number(packet, table, "i")
    if 4 + 2 * number >= _number(packet, fields, "H"):
        return 0
    offset = _number(packet, fields + 4 + 2 * number, "H")
    return table + offset if offset else 0


def _events(packet: bytes) -> Any:
    """Return the events of a packet."""
    start, count = _list(packet)
    if start + count * _EVENT.itemsize > len(packet) + 7:
        raise ValueError(f"{count} events in {len(packet)} bytes")
    return np.frombuffer(packet.ljust(start + count * _EVENT.itemsize, b"\0"), _EVENT, count, start)


def _triggers(packet: bytes) -> Any:
    """Return the external triggers of a packet as rows of time, number of the input and level."""
    start, count = _list(packet)
    if start + 4 * count > len(packet):
        raise ValueError(f"{count} triggers in {len(packet)} bytes")
    rows = []
    for at in range(start, start + 4 * count, 4):
        table = at + _number(packet, at, "I")
        time, kind = _field(packet, table, 0), _field(packet, table, 1)
        level = _LEVELS.get(_number(packet, kind, "b") if kind else 0)
        if level is not None:
            rows.append((_number(packet, time, "q") if time else 0, 0, level))
    return np.array(rows, np.int64).reshape(-1, 3)
