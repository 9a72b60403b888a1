"""What a light may say, chip by chip: one interface for Bicode's packet and for UART letters.

A line code is a list of states, each with the LED's level and the states that may come
before it. The receiver looks for the likeliest walk through them, and asks the code at the
end what the chips of a frame mean. So a code that is not here yet is one class away.

    Bicode   start: off for 6 chips; each bit two unlike chips; repeats without a pause
    UART     start 0, 7 bits MSB first, even parity, two stop bits 1; idle is 1, LED on
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.manchester import Convention, manchester_decode
from bicode_lab.marker.packet import Bits, PacketFormat, decode_data_bits, encode_packet

UART_BITS = 7
UART_CHIPS = 11  # start, 7 bits, parity, two stop bits
TRIED_BITS = 12


@dataclass(frozen=True, eq=False)
class Trellis:
    """The states of a line code, one chip long each.

    Parameters
    ----------
    level : ndarray of uint8, shape (n,)
        LED off 0 or on 1.
    before : ndarray of int32, shape (n, 2)
        States that may come before each; -1 where there is none.
    place : ndarray of int32, shape (n,)
        Number of the chip in its frame; -1 between frames.
    """

    level: npt.NDArray[np.uint8]
    before: npt.NDArray[np.int32]
    place: npt.NDArray[np.int32]


class LineCode(Protocol):
    """What the soft receiver needs to know about a transmitter."""

    def __hash__(self) -> int:
        """Settings are frozen, so that what is made from them can be kept."""

    @property
    def chip_us(self) -> float:
        """Shortest time between two edges [us]."""

    @property
    def frame_chips(self) -> int:
        """Chips of one frame."""

    @property
    def start_chips(self) -> tuple[int, ...]:
        """Levels every frame begins with."""

    def trellis(self, checked: bool = False) -> Trellis:
        """All that may be sent; where `checked`, only what passes the code's check, if the walk can know it."""

    def encode(self, value: int) -> Bits:
        """A value in, the levels of its frame out, shape (frame_chips,)."""

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """The levels of a frame in, its value and whether its check holds out."""

    def frames(self) -> Bits | None:
        """All frames that pass the check, shape (n, frame_chips); None where they are too many to try."""


@dataclass(frozen=True, kw_only=True)
class BicodeLine:
    """The marker's packet (Fig. 5) as a line code.

    Parameters
    ----------
    packet_format : PacketFormat
    conventions : tuple of {"ieee", "thomas"}, optional
        Those to try; None takes the format's. Of two, the one whose checksum holds is right.

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
        """Half a bit [us]."""
        return self.packet_format.chip_us

    @property
    def frame_chips(self) -> int:
        """Chips of start, payload and checksum."""
        return 2 * self.packet_format.packet_bits

    @property
    def start_chips(self) -> tuple[int, ...]:
        """The LED is off."""
        return (0,) * (2 * self.packet_format.start_bits)

    def trellis(self, checked: bool = False) -> Trellis:
        """A ring of `frame_chips` places; the second chip of a bit is unlike its first. The checksum stays outside."""
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
        """A payload in, the levels of its packet out."""
        return encode_packet(value, self.packet_format)

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """The levels of a packet in, its payload and whether the checksum holds out."""
        data = np.asarray(chips, np.uint8)[len(self.start_chips) :]
        readings = []
        for convention in self.conventions or (self.packet_format.manchester,):
            bits, valid = manchester_decode(data, convention)
            payload, holds = decode_data_bits(bits, self.packet_format)
            readings.append((payload, holds and bool(valid.all())))
        return next((reading for reading in readings if reading[1]), readings[0])

    def frames(self) -> Bits | None:
        """Every payload in every convention; None for payloads of more than `TRIED_BITS`."""
        f = self.packet_format
        if f.payload_bits > TRIED_BITS:
            return None
        formats = [replace(f, manchester=convention) for convention in self.conventions or (f.manchester,)]
        return np.array([encode_packet(value, one) for one in formats for value in range(2**f.payload_bits)], np.uint8)


@dataclass(frozen=True, kw_only=True)
class UartLine:
    """On-off keyed letters, as public LED beacons send them; the LED is on for a 1.

    Parameters
    ----------
    rate_hz : float
        Chips (baud) a second.

    Examples
    --------
    >>> line = UartLine(rate_hz=3125)
    >>> "".join(map(str, line.encode(ord("S")))), line.decode(line.encode(ord("S")))
    ('01010011011', (83, True))
    """

    rate_hz: float

    def __post_init__(self) -> None:
        if not 0 < self.rate_hz <= 200_000:
            raise ValueError(f"rate_hz={self.rate_hz} is not in 0 .. 200000 Hz")

    @property
    def chip_us(self) -> float:
        """One bit [us]."""
        return 1e6 / self.rate_hz

    @property
    def frame_chips(self) -> int:
        """Start, letter, parity and stop."""
        return UART_CHIPS

    @property
    def start_chips(self) -> tuple[int, ...]:
        """One chip off, behind stop bits or idle, which are on."""
        return (0,)

    def trellis(self, checked: bool = False) -> Trellis:
        """Idle, then eleven places; behind the second stop bit, idle or the next start.

        Where it is checked, a state also knows the parity of the bits so far, and an odd frame cannot be.
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
        """A letter's code in, 0 .. 127, the levels of its frame out."""
        if not 0 <= value < 2**UART_BITS:
            raise ValueError(f"value={value} is no letter of {UART_BITS} bits; choose 0 .. {2**UART_BITS - 1}")
        bits = [value >> shift & 1 for shift in range(UART_BITS - 1, -1, -1)]
        return np.array([0, *bits, sum(bits) % 2, 1, 1], np.uint8)

    def decode(self, chips: npt.ArrayLike) -> tuple[int, bool]:
        """The levels of a frame in, the letter's code and whether the parity is even out."""
        levels = [int(level) for level in np.asarray(chips, np.uint8)]
        bits = levels[1 : UART_BITS + 1]
        value = int("".join(map(str, bits)), 2)
        return value, (sum(bits) + levels[UART_BITS + 1]) % 2 == 0

    def frames(self) -> Bits | None:
        """Every letter."""
        return np.array([self.encode(value) for value in range(2**UART_BITS)], np.uint8)


@dataclass(frozen=True, eq=False)
class Nodes:
    """A trellis with memory: a state and the levels of the chips before it.

    What a sensor shows in a chip depends on the edges that went before, so its likelihood
    is known per `context`: the levels of the last `memory` chips, the newest in bit 0.

    Parameters
    ----------
    context : ndarray of int32, shape (n,)
    before : ndarray of int32, shape (n, 4)
        Nodes that may come before each; -1 where there is none.
    place : ndarray of int32, shape (n,)
        See `Trellis`.
    """

    context: npt.NDArray[np.int32]
    before: npt.NDArray[np.int32]
    place: npt.NDArray[np.int32]


@cache
def nodes_of(line: LineCode, memory: int, checked: bool = False) -> Nodes:
    """A line code and a number of chips in, its states with so much memory out."""
    trellis = line.trellis(checked)
    n, size = trellis.level.size, 1 << memory
    reached: set[tuple[int, int]] = set()
    ahead: dict[tuple[int, int], set[tuple[int, int]]] = {}
    frontier = [(s, context) for s in range(n) for context in range(size) if context & 1 == trellis.level[s]]
    followers: list[list[int]] = [[t for t in range(n) if s in trellis.before[t]] for s in range(n)]
    for _ in range(memory):  # a context that no walk has made is dropped
        reached, ahead = set(), {}
        for state, context in frontier:
            for follower in followers[state]:
                node = (follower, (context << 1 | int(trellis.level[follower])) & (size - 1))
                reached.add(node)
                ahead.setdefault(node, set()).add((state, context))
        frontier = sorted(reached)
    number = {node: i for i, node in enumerate(frontier)}
    before = np.full((len(frontier), 4), -1, np.int32)
    for node, i in number.items():
        known = sorted(number[other] for other in ahead[node] if other in number)
        before[i, : len(known)] = known
    contexts = np.array([c for _, c in frontier], np.int32)
    return Nodes(contexts, before, trellis.place[[s for s, _ in frontier]])


@cache
def contexts_of(line: LineCode, memory: int) -> npt.NDArray[np.int32] | None:
    """A line code that repeats its frame, in; the contexts of each frame that passes the check out.

    Shape (n, frame_chips), from chip number memory - 1 on, as a walk from there has them; None as `LineCode.frames`.
    """
    frames = line.frames()
    if frames is None:
        return None
    levels = frames.astype(np.int32)
    return sum((np.roll(levels, back + 1 - memory, axis=1) << back for back in range(memory)), np.zeros_like(levels))


def _trellis(level: Sequence[int], before: Sequence[Sequence[int]], place: Sequence[int]) -> Trellis:
    """Lists in, the trellis out."""
    padded = [[*ahead, -1][:2] for ahead in before]
    return Trellis(np.array(level, np.uint8), np.array(padded, np.int32), np.array(place, np.int32))
