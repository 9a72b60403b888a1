"""Errors of a packet that its checksum does not detect: all of them are tried, none is drawn at random."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from bicode_lab.marker import PacketFormat
from bicode_lab.marker.packet import checksum


def undetected_flips(packet_format: PacketFormat, flips: int) -> float:
    """Return the share of errors with a given number of flipped bits that pass the checksum.

    All payloads and all places of the flipped bits in payload and checksum are tried.

    Parameters
    ----------
    packet_format : PacketFormat
    flips : int
        Number of flipped bits, 1 .. `packet_format.data_bits`.

    Returns
    -------
    float
        0 .. 1.

    Raises
    ------
    ValueError
        If `flips` is out of range.

    Examples
    --------
    >>> paper, crc = PacketFormat(), PacketFormat(checksum="crc3")
    >>> [round(undetected_flips(paper, flips), 2) for flips in (1, 2, 3)]
    [0.0, 0.33, 0.05]
    >>> [round(undetected_flips(crc, flips), 2) for flips in (1, 2, 3)]
    [0.0, 0.07, 0.16]
    """
    return _passed(packet_format, [sum(1 << bit for bit in bits) for bits in _places(packet_format, flips)])


def undetected_swaps(packet_format: PacketFormat) -> float:
    """Return the share of swaps of two neighbouring, different bits that pass the checksum.

    Parameters
    ----------
    packet_format : PacketFormat

    Returns
    -------
    float
        0 .. 1, over all payloads and all such pairs of bits.

    Examples
    --------
    >>> round(undetected_swaps(PacketFormat()), 2), undetected_swaps(PacketFormat(checksum="crc3"))
    (0.68, 0.0)
    """
    width = packet_format.data_bits
    swapped = passed = 0
    for payload in range(2**packet_format.payload_bits):
        word = payload << packet_format.checksum_bits | checksum(payload, packet_format)
        for low in range(width - 1):
            if (word >> low & 1) != (word >> low + 1 & 1):
                swapped += 1
                passed += _holds(word ^ 0b11 << low, packet_format)
    return passed / swapped


def _places(packet_format: PacketFormat, flips: int) -> Iterable[tuple[int, ...]]:
    """Return all choices of that many data bits."""
    if not 1 <= flips <= packet_format.data_bits:
        raise ValueError(
            f"flips={flips} is not in 1 .. {packet_format.data_bits}, the number of bits after the start; choose one "
            "of these"
        )
    return combinations(range(packet_format.data_bits), flips)


def _passed(packet_format: PacketFormat, masks: list[int]) -> float:
    """Return the share of masks of flipped bits that pass the checksum, over all payloads."""
    payloads = range(2**packet_format.payload_bits)
    words = [payload << packet_format.checksum_bits | checksum(payload, packet_format) for payload in payloads]
    return sum(_holds(word ^ mask, packet_format) for word in words for mask in masks) / (len(words) * len(masks))


def _holds(word: int, packet_format: PacketFormat) -> bool:
    """Return whether the checksum of these data bits is right."""
    payload, check = word >> packet_format.checksum_bits, word & ((1 << packet_format.checksum_bits) - 1)
    return checksum(payload, packet_format) == check
