"""What a light may send, chip by chip: one interface for Bicode's packet and for UART characters.

A line code is a list of states. Each has the level of the LED and the states that may come before it. The receiver
looks for the most likely path through the states, and then asks the code what the chips of a frame mean. Another
transmitter needs one more class here, and a caller that uses it (`receiver`, or the command ``bicode decode``)::

    Bicode   start: off for 6 chips; each bit is two unlike chips; packets follow each other without a pause
    UART     start 0, 7 bits with the most significant first, even parity, two stop bits 1; idle is 1, LED on
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.manchester import Convention, manchester_decode
from bicode_lab.marker.packet import Bits, PacketFormat, decode_data_bits, encode_packet

UART_BITS = 7
UART_CHIPS = 11  # start, 7 bits, parity, two stop bits
MAX_LISTED_BITS = 12  # payloads of more bits have too many frames to list them all


@dataclass(frozen=True, eq=False)
class Trellis:
    """The states of a line code; each lasts one chip.

    Parameters
    ----------
    level : ndarray of uint8, shape (n,)
        Level of the LED in each state: 0 off, 1 on.
    before : ndarray of int32, shape (n, 2)
        States that may come before each state; -1 where there is only one.
    place : ndarray of int32, shape (n,)
        Number of the chip in its frame; -1 between frames.
    """

    level: npt.NDArray[np.uint8]
    before: npt.NDArray[np.int32]
    place: npt.NDArray[np.int32]


class LineCode(Protocol):
    """What the soft receiver needs to know about a transmitter."""

    def __hash__(self) -> int:
        """Return a hash; line codes are frozen, so that what is built from them can be kept."""

    @property
    def chip_us(self) -> float:
        """Shortest time between two edges [us]."""

    @property
    def frame_chips(self) -> int:
        """Number of chips in a frame."""

    @property
    def start_chips(self) -> tuple[int, ...]:
        """Levels that every frame begins with."""

    def trellis(self, checked: bool = False) -> Trellis:
        """Return the states; if `checked`, only frames that pass the check are allowed, where states can know it."""

    def encode(self, value: int) -> Bits:
        """Return the levels of the frame of a value, shape (frame_chips,)."""

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """Return the value of a frame and whether its check holds, from its levels, shape (frame_chips,)."""

    def frames(self) -> Bits | None:
        """Return all frames that pass the check, shape (n, frame_chips), or None if they are too many."""


@dataclass(frozen=True, kw_only=True)
class BicodeLine:
    """The packet of the marker (Fig. 5) as a line code.

    Parameters
    ----------
    packet_format : PacketFormat
    conventions : tuple of {"ieee", "thomas"}, optional
        Manchester conventions to try; None takes that of the format. The one whose checksum holds is right.

    Examples
    --------
    >>> line = BicodeLine(packet_format=PacketFormat())
    >>> line.decode(line.encode(0x25)), line.frame_chips, line.start_chips
    ((37, True), 28, (0, 0, 0, 0, 0, 0))
    """

    packet_format: PacketFormat
    conventions: tuple[Convention, ...] | None = None

    @property
    def chip_us(self) -> float:
        """Half the length of a bit [us]."""
        return self.packet_format.chip_us

    @property
    def frame_chips(self) -> int:
        """Number of chips of start, payload and checksum."""
        return 2 * self.packet_format.packet_bits

    @property
    def start_chips(self) -> tuple[int, ...]:
        """Levels of the start: the LED is off."""
        return (0,) * (2 * self.packet_format.start_bits)

    def trellis(self, checked: bool = False) -> Trellis:
        """Return a ring of `frame_chips` places in which the second chip of a bit is unlike its first.

        The states do not know the checksum, so `checked` makes no difference.
        """
        n_start, n = len(self.start_chips), self.frame_chips
        columns: list[list[tuple[int, int]]] = [[(k, 0)] for k in range(n_start)]
        columns += [[(k, 0), (k, 1)] for k in range(n_start, n)]
        names = [name for column in columns for name in column]
        number = {name: i for i, name in enumerate(names)}
        before = []
        for k, level in names:
            ahead = columns[k - 1]
            if k >= n_start and (k - n_start) % 2:
                ahead = [(k - 1, 1 - level)]
            before.append([number[name] for name in ahead])
        return _trellis([level for _, level in names], before, [k for k, _ in names])

    def encode(self, value: int) -> Bits:
        """Return the levels of the packet of a payload, shape (frame_chips,)."""
        return encode_packet(value, self.packet_format)

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """Return the payload of a packet and whether its checksum holds, from its levels, shape (frame_chips,)."""
        data = np.asarray(chips, np.uint8)[len(self.start_chips) :]
        readings = []
        for convention in self.conventions or (self.packet_format.manchester,):
            bits, valid = manchester_decode(data, convention)
            payload, holds = decode_data_bits(bits, self.packet_format)
            readings.append((payload, holds and bool(valid.all())))
        return next((reading for reading in readings if reading[1]), readings[0])

    def frames(self) -> Bits | None:
        """Return the packet of every payload in every convention, shape (n, frame_chips).

        Returns None for payloads of more than `MAX_LISTED_BITS` bits.
        """
        f = self.packet_format
        if f.payload_bits > MAX_LISTED_BITS:
            return None
        formats = [replace(f, manchester=convention) for convention in self.conventions or (f.manchester,)]
        return np.array([encode_packet(value, one) for one in formats for value in range(2**f.payload_bits)], np.uint8)


@dataclass(frozen=True, kw_only=True)
class UartLine:
    """On-off keyed UART characters, as public LED beacons send them; the LED is on for a 1.

    Parameters
    ----------
    rate_hz : float
        Chips per second (baud), above 0 and up to 200 000 [Hz].

    Examples
    --------
    >>> line = UartLine(rate_hz=3125)
    >>> "".join(map(str, line.encode(ord("S")))), line.decode(line.encode(ord("S")))
    ('01010011011', (83, True))
    """

    rate_hz: float

    def __post_init__(self) -> None:
        if not 0 < self.rate_hz <= 200_000:
            raise ValueError(f"rate_hz={self.rate_hz} is not above 0 and up to 200000 Hz; choose the baud rate")

    @property
    def chip_us(self) -> float:
        """Length of a bit [us]."""
        return 1e6 / self.rate_hz

    @property
    def frame_chips(self) -> int:
        """Number of chips of start, character, parity and stop."""
        return UART_CHIPS

    @property
    def start_chips(self) -> tuple[int, ...]:
        """Level of the start: one chip off; the stop bits or the idle line before it are on."""
        return (0,)

    def trellis(self, checked: bool = False) -> Trellis:
        """Return an idle state and the eleven places of a frame.

        After the second stop bit comes the idle state or the next start.
        If `checked`, a state also knows the parity of the bits before it, and a frame of odd parity is not allowed.
        """
        names: list[tuple[int, int, int]] = [(-1, 1, 0), (0, 0, 0)]
        ahead: list[list[tuple[int, int, int]]] = [[], []]
        layer = [names[1]]
        for k in range(1, UART_BITS + 2):
            behind: dict[tuple[int, int, int], list[tuple[int, int, int]]] = {}
            for state, level in itertools.product(layer, (0, 1)):
                parity = state[2] ^ level if checked else 0
                if k <= UART_BITS or parity == 0:
                    behind.setdefault((k, level, parity), []).append(state)
            layer = list(behind)
            names += layer
            ahead += behind.values()
        names += [(UART_CHIPS - 2, 1, 0), (UART_CHIPS - 1, 1, 0)]
        ahead += [layer, [names[-2]]]
        ahead[:2] = [[names[0], names[-1]]] * 2
        number = {name: i for i, name in enumerate(names)}
        before = [[number[name] for name in group] for group in ahead]
        return _trellis([level for _, level, _ in names], before, [k for k, _, _ in names])

    def encode(self, value: int) -> Bits:
        """Return the levels of the frame of a character, shape (11,).

        Raises
        ------
        ValueError
            If `value` is not in 0 .. 127.
        """
        if not 0 <= value < 2**UART_BITS:
            raise ValueError(f"value={value} is no character of {UART_BITS} bits; choose 0 .. {2**UART_BITS - 1}")
        bits = [value >> shift & 1 for shift in range(UART_BITS - 1, -1, -1)]
        return np.array([0, *bits, sum(bits) % 2, 1, 1], np.uint8)

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """Return the code of a character, 0 .. 127, and whether the parity is even, from its levels, shape (11,)."""
        levels = [int(level) for level in np.asarray(chips, np.uint8)]
        bits = levels[1 : UART_BITS + 1]
        value = int("".join(map(str, bits)), 2)
        return value, (sum(bits) + levels[UART_BITS + 1]) % 2 == 0

    def frames(self) -> Bits | None:
        """Return the frame of every character, shape (128, 11)."""
        return np.array([self.encode(value) for value in range(2**UART_BITS)], np.uint8)


def _trellis(level: Sequence[int], before: Sequence[Sequence[int]], place: Sequence[int]) -> Trellis:
    """Make a trellis from lists of the states' levels, of the states before each, and of their places."""
    padded = [[*ahead, -1][:2] for ahead in before]
    return Trellis(np.array(level, np.uint8), np.array(padded, np.int32), np.array(place, np.int32))
