"""The packet (Fig. 5): a start, the payload and a checksum, encoded to chips and decoded again.

The LED is off during the start. Then payload and checksum follow, bit after bit at the rate f_ID. Each bit is sent as
two chips (half bits) by Manchester coding, see `manchester`. The paper's packet has 3 + 8 + 3 bits at 1 kHz, which
makes 8 payload bits in 14 ms, or 571 bit/s (III-A).

The paper does not print the rule of its three checksum bits, which it calls "a check sum". The default here is the
number of ones modulo 8; a CRC of three bits is the other choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.manchester import Convention, manchester_encode

Bits = npt.NDArray[np.uint8]
ChecksumKind = Literal["sum", "crc3"]
BitOrder = Literal["msb", "lsb"]

CRC3_DIVISOR = 0b1011  # x^3 + x + 1
CRC3_FINAL_XOR = 0b111


@dataclass(frozen=True, kw_only=True)
class PacketFormat:
    """The settings that marker and receiver share; the defaults are the paper's (III-A, Fig. 5).

    Parameters
    ----------
    start_bits : int
        Length of the start in bit times, 2 .. 64. Within data the LED is off for one bit time at most.
    payload_bits : int
        Width of the ID, 1 .. 32; 8 bits give 256 IDs.
    checksum : {"sum", "crc3"}
        Number of ones in the payload modulo 2**checksum_bits, or CRC-3 (x^3 + x + 1, initial value 0, final xor 7).
    checksum_bits : int
        Width of the checksum, 1 .. 8; a CRC-3 has 3.
    f_id_hz : float
        Bit rate f_ID [Hz]; one chip lasts 1 / (2 f_ID).
    manchester : {"ieee", "thomas"}
        How a 1 is sent: "ieee" off then on, "thomas" on then off.
    bit_order : {"msb", "lsb"}
        Which end of payload and checksum is sent first.

    Raises
    ------
    ValueError
        If a setting is out of range.

    Examples
    --------
    >>> paper = PacketFormat()
    >>> paper.packet_us, round(paper.payload_rate_bps)
    (14000.0, 571)
    """

    start_bits: int = 3
    payload_bits: int = 8
    checksum: ChecksumKind = "sum"
    checksum_bits: int = 3
    f_id_hz: float = 1000.0
    manchester: Convention = "ieee"
    bit_order: BitOrder = "msb"

    def __post_init__(self) -> None:
        if not 2 <= self.start_bits <= 64:
            raise ValueError(
                f"start_bits={self.start_bits} is not in 2 .. 64; data are off for up to one bit, so take 2+"
            )
        if not 1 <= self.payload_bits <= 32:
            raise ValueError(f"payload_bits={self.payload_bits} is not in 1 .. 32")
        if self.checksum not in ("sum", "crc3"):
            raise ValueError(f"checksum={self.checksum!r} is not known; choose 'sum' or 'crc3'")
        if not 1 <= self.checksum_bits <= 8:
            raise ValueError(f"checksum_bits={self.checksum_bits} is not in 1 .. 8")
        if self.checksum == "crc3" and self.checksum_bits != 3:
            raise ValueError(f"checksum_bits={self.checksum_bits} does not fit a CRC-3; choose 3, or checksum='sum'")
        if not 0 < self.f_id_hz <= 100_000:
            raise ValueError(f"f_id_hz={self.f_id_hz} is not in 0 .. 100000 Hz")
        if self.manchester not in ("ieee", "thomas"):
            raise ValueError(f"manchester={self.manchester!r} is not known; choose 'ieee' or 'thomas'")
        if self.bit_order not in ("msb", "lsb"):
            raise ValueError(f"bit_order={self.bit_order!r} is not known; choose 'msb' or 'lsb'")

    @property
    def data_bits(self) -> int:
        """Number of bits after the start: payload and checksum."""
        return self.payload_bits + self.checksum_bits

    @property
    def packet_bits(self) -> int:
        """Length of a whole packet in bit times: start, payload and checksum."""
        return self.start_bits + self.data_bits

    @property
    def chip_us(self) -> float:
        """Length of a chip, which is half a bit [us]."""
        return 5e5 / self.f_id_hz

    @property
    def packet_us(self) -> float:
        """Length of a whole packet [us]."""
        return self.packet_bits * 2 * self.chip_us

    @property
    def payload_rate_bps(self) -> float:
        """Payload bits per second of a marker that sends without pause [bit/s]."""
        return self.payload_bits / (self.packet_us * 1e-6)


def payload_to_bits(payload: int, packet_format: PacketFormat) -> Bits:
    """Return the bits of a payload in the order in which they are sent.

    Parameters
    ----------
    payload : int
        0 .. 2**payload_bits - 1.
    packet_format : PacketFormat

    Returns
    -------
    ndarray of uint8, shape (payload_bits,)

    Raises
    ------
    ValueError
        If the payload does not fit the format.

    Examples
    --------
    >>> payload_to_bits(0x25, PacketFormat())
    array([0, 0, 1, 0, 0, 1, 0, 1], dtype=uint8)
    """
    if not 0 <= payload < 2**packet_format.payload_bits:
        raise ValueError(
            f"payload={payload} does not fit payload_bits={packet_format.payload_bits}; "
            f"choose 0 .. {2**packet_format.payload_bits - 1}, or more bits"
        )
    return _number_to_bits(payload, packet_format.payload_bits, packet_format.bit_order)


def checksum(payload: int, packet_format: PacketFormat) -> int:
    """Return the checksum of a payload.

    Parameters
    ----------
    payload : int
        0 .. 2**payload_bits - 1.
    packet_format : PacketFormat

    Returns
    -------
    int
        0 .. 2**checksum_bits - 1.

    Examples
    --------
    >>> checksum(0x25, PacketFormat()), checksum(0x25, PacketFormat(checksum="crc3"))
    (3, 1)
    """
    payload = int(payload)  # numpy's small integers would overflow below
    if packet_format.checksum == "sum":
        return payload.bit_count() % (1 << packet_format.checksum_bits)
    remainder = payload << 3
    for shift in range(packet_format.payload_bits - 1, -1, -1):
        if remainder >> (shift + 3) & 1:
            remainder ^= CRC3_DIVISOR << shift
    return remainder ^ CRC3_FINAL_XOR


def encode_packet(payload: int, packet_format: PacketFormat) -> Bits:
    """Encode a payload as the LED states of one packet.

    Parameters
    ----------
    payload : int
        The ID, 0 .. 2**payload_bits - 1.
    packet_format : PacketFormat

    Returns
    -------
    ndarray of uint8, shape (2 * packet_bits,)
        LED state of each chip: 0 off, 1 on.

    Raises
    ------
    ValueError
        If the payload does not fit the format.

    Examples
    --------
    >>> "".join(map(str, encode_packet(0x25, PacketFormat())))
    '0000001010011010011001100101'
    """
    bits = payload_to_bits(payload, packet_format)
    check = _number_to_bits(checksum(payload, packet_format), packet_format.checksum_bits, packet_format.bit_order)
    start = np.zeros(2 * packet_format.start_bits, np.uint8)
    return np.concatenate([start, manchester_encode(np.concatenate([bits, check]), packet_format.manchester)])


def decode_data_bits(bits: npt.ArrayLike, packet_format: PacketFormat) -> tuple[int, bool]:
    """Decode the bits after the start to a payload, and check its checksum.

    Parameters
    ----------
    bits : array_like, shape (data_bits,)
        0 or 1, in the order in which they were sent.
    packet_format : PacketFormat

    Returns
    -------
    payload : int
    is_valid : bool
        True where the checksum fits the payload.

    Raises
    ------
    ValueError
        If the number of bits is wrong.

    Examples
    --------
    >>> decode_data_bits([0, 0, 1, 0, 0, 1, 0, 1, 0, 1, 1], PacketFormat())
    (37, True)
    """
    data = np.asarray(bits, np.uint8)
    if data.shape != (packet_format.data_bits,):
        raise ValueError(f"{data.shape} bits given; payload and checksum are {packet_format.data_bits}")
    payload = _bits_to_number(data[: packet_format.payload_bits], packet_format.bit_order)
    check = _bits_to_number(data[packet_format.payload_bits :], packet_format.bit_order)
    return payload, check == checksum(payload, packet_format)


def is_polarity_ambiguous(packet_format: PacketFormat) -> bool:
    """Return whether a packet that is decoded with the wrong Manchester convention still passes its checksum.

    The wrong convention inverts every bit. An inverted packet passes the sum where ``payload_bits + 1`` is a multiple
    of ``2**checksum_bits``, and the CRC-3 for every seventh width from 4 on. The answer is the same for all payloads.

    Parameters
    ----------
    packet_format : PacketFormat

    Returns
    -------
    bool

    Examples
    --------
    >>> [n for n in range(1, 24) if is_polarity_ambiguous(PacketFormat(payload_bits=n))]
    [7, 15, 23]
    >>> [n for n in range(1, 24) if is_polarity_ambiguous(PacketFormat(payload_bits=n, checksum="crc3"))]
    [4, 11, 18]
    """
    all_ones = (1 << packet_format.payload_bits) - 1
    inverted = (1 << packet_format.checksum_bits) - 1 - checksum(0, packet_format)
    return checksum(all_ones, packet_format) == inverted


def _number_to_bits(number: int, width: int, order: BitOrder) -> Bits:
    """Return the `width` bits of a number in the order in which they are sent."""
    shifts = np.arange(width) if order == "lsb" else np.arange(width)[::-1]
    return ((number >> shifts) & 1).astype(np.uint8)


def _bits_to_number(bits: Bits, order: BitOrder) -> int:
    """Return the number that bits make, which are given in the order in which they were sent."""
    sent = bits[::-1] if order == "lsb" else bits
    return int("".join(map(str, sent.tolist())), 2)
