"""Parse the messages with events of ROS 1 and ROS 2, byte by byte, so that a million events take milliseconds.

ROS 1 packs the fields one after the other. ROS 2 writes CDR: four bytes ahead, and every number at a multiple of its
size (8 at most), counted from there.

    EventArray   (dvs_msgs, prophesee_event_msgs)  header, height, width, events: x, y (16 bits), seconds and
                 nanoseconds (32 bits each), polarity (8 bits)
    EventPacket  (event_camera_msgs)  header, height, width, number, time base, encoding, byte order, bytes
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bicode_lab.recordings.decode import Columns

_PACKED = np.dtype([("x", "<u2"), ("y", "<u2"), ("s", "<u4"), ("ns", "<u4"), ("p", "u1")])
_FIRST_OF_CDR = _PACKED
_NEXT_OF_CDR = np.dtype(
    {"names": ["x", "y", "s", "ns", "p"], "formats": ["<u2", "<u2", "<u4", "<u4", "u1"], "offsets": [0, 2, 6, 10, 14],
     "itemsize": 16}
)  # fmt: skip
_BYTES_TO_NEXT = 14  # the second event begins at a multiple of 2 that is none of 4, and all later ones do, too


@dataclass(frozen=True, kw_only=True)
class Packet:
    """What an EventPacket holds."""

    width: int
    height: int
    time_base: int
    encoding: str
    data: bytes


class _Cursor:
    """Reads the fields of a message in their order."""

    def __init__(self, message: bytes, is_cdr: bool) -> None:
        if is_cdr and (len(message) < 4 or message[1] != 1):
            raise ValueError("a message that is not little-endian CDR")
        self._body, self._is_cdr, self.at = message[4:] if is_cdr else message, is_cdr, 0

    def number(self, kind: str) -> int:
        """Return the next number of a kind of `struct`."""
        size = struct.calcsize(kind)
        if self._is_cdr:
            self.at += -self.at % size
        (value,) = struct.unpack_from(f"<{kind}", self._body, self.at)
        self.at += size
        return int(value)

    def take(self, size: int) -> bytes:
        """Return the next bytes."""
        if size > len(self._body) - self.at:
            raise ValueError(f"a message of {len(self._body)} bytes that is to hold {size} from byte {self.at} on")
        self.at += size
        return self._body[self.at - size : self.at]

    def text(self) -> str:
        """Return the next text."""
        return self.take(self.number("I")).rstrip(b"\0").decode("utf-8", "replace")

    def header(self) -> tuple[int, int]:
        """Pass over the header of a message; return the width and the height that follow it."""
        for _ in range(2 if self._is_cdr else 3):  # ROS 1 counts its messages
            self.number("I")
        self.text()
        height, width = self.number("I"), self.number("I")
        return width, height


def parse_event_array(message: bytes, is_cdr: bool) -> tuple[tuple[int, int], Columns]:
    """Return the sensor size and the events of an EventArray.

    Parameters
    ----------
    message : bytes
        The message as it is in the bag.
    is_cdr : bool
        True for ROS 2.

    Returns
    -------
    size_px : (int, int)
        Width and height.
    columns : tuple of four ndarrays, shape (n,)
        x, y, p and t [us].

    Raises
    ------
    ValueError, struct.error
        If the message is cut short or damaged.
    """
    cursor = _Cursor(message, is_cdr)
    size_px, n = cursor.header(), cursor.number("I")
    if not is_cdr or n == 0:
        rows = np.frombuffer(cursor.take(n * _PACKED.itemsize), _PACKED)
        return size_px, _in_us([rows])
    first = np.frombuffer(cursor.take(_PACKED.itemsize), _FIRST_OF_CDR)
    if n == 1:
        return size_px, _in_us([first])
    cursor.take(_BYTES_TO_NEXT - _PACKED.itemsize)
    rest = cursor.take((n - 1) * _NEXT_OF_CDR.itemsize - 1) + b"\0"  # nothing follows the last polarity
    return size_px, _in_us([first, np.frombuffer(rest, _NEXT_OF_CDR)])


def _in_us(parts: list[npt.NDArray[Any]]) -> Columns:
    """Return the columns of rows of events, with their times in microseconds."""
    x, y, s, ns, p = (
        np.concatenate([part[name] for part in parts]).astype(np.int64) for name in ("x", "y", "s", "ns", "p")
    )
    return x, y, p, s * 1_000_000 + ns // 1000


def parse_event_packet(message: bytes, is_cdr: bool) -> Packet:
    """Return what an EventPacket holds.

    Parameters
    ----------
    message : bytes
        The message as it is in the bag.
    is_cdr : bool
        True for ROS 2.

    Raises
    ------
    ValueError, struct.error
        If the message is cut short or damaged.
    """
    cursor = _Cursor(message, is_cdr)
    width, height = cursor.header()
    cursor.number("Q")
    time_base, encoding = cursor.number("Q"), cursor.text()
    cursor.number("B")
    return Packet(
        width=width, height=height, time_base=time_base, encoding=encoding, data=cursor.take(cursor.number("I"))
    )


def columns_of_mono(packet: Packet) -> Columns:
    """Return the events of a packet in the encoding "mono": 64 bits each.

    From the lowest bit up: 32 bits of time after the time base [ns], 16 of x, 15 of y and 1 of polarity.
    """
    words = np.frombuffer(packet.data, "<u8", count=len(packet.data) // 8)
    t_ns = (words & np.uint64(0xFFFFFFFF)).astype(np.int64) + packet.time_base % (1 << 62)
    x, y, p = ((words >> np.uint64(by)).astype(np.int64) & mask for by, mask in ((32, 0xFFFF), (48, 0x7FFF), (63, 1)))
    return x, y, p, t_ns // 1000


def columns_of_libcaer(packet: Packet) -> Columns:
    """Return the events of a packet in the encoding "libcaer": 64 bits each.

    The lower 32 bits are those of a polarity event of AEDAT 3.1, the upper 32 the time after the time base [us].
    """
    words = np.frombuffer(packet.data, "<u8", count=len(packet.data) // 8).astype(np.int64)
    word, time = words & 0xFFFFFFFF, words >> 32
    turns = np.cumsum(np.diff(time, prepend=time[:1]) < 0) << 31
    t_us = packet.time_base % (1 << 62) // 1000 + time + turns
    return word >> 17 & 0x7FFF, word >> 2 & 0x7FFF, word >> 1 & 1, t_us


def columns_of_libcaer_cmp(packet: Packet) -> Columns:
    """Return the events of a packet in the encoding "libcaer_cmp": 16-bit words, the upper 4 bits tell the kind.

    0 upper and 1 lower 12 bits of the time after the time base [us]; 2 column; 3 row and polarity: one event; 4 row and
    polarity, then 5 one bit for each of 8 rows.
    """
    rows: list[tuple[int, int, int, int]] = []
    high = low = x = y = p = 0
    for word in np.frombuffer(packet.data, "<u2", count=len(packet.data) // 2).tolist():
        kind, value = word >> 12, word & 0xFFF
        if kind == 0:
            high = value << 12
        elif kind == 1:
            low = value
        elif kind == 2:
            x = value & 0x7FF
        elif kind == 3:
            rows.append((x, value & 0x7FF, value >> 11, high | low))
        elif kind == 4:
            y, p = value & 0x7FF, value >> 11
        elif kind == 5:
            rows += [(x, y + bit, p, high | low) for bit in range(8) if value >> bit & 1]
            y += 8
        else:
            raise ValueError(f"a word of unknown kind {kind} in a packet of libcaer_cmp")
    table = np.array(rows, np.int64).reshape(-1, 4)
    return table[:, 0], table[:, 1], table[:, 2], table[:, 3] + packet.time_base % (1 << 59)
