"""Tests of the errors that a checksum does not detect."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.marker.packet import checksum
from bicode_studies.link_budget.checksum_errors import undetected_flips, undetected_swaps


@pytest.mark.parametrize("kind", ["sum", "crc3"])
@pytest.mark.parametrize("flips", [1, 2, 3, 4, 5])
def test_undetected_errors_are_the_distances_between_packets(kind: str, flips: int) -> None:
    """An error passes if it turns one valid word into another: count pairs of words by their distance."""
    packet_format = PacketFormat(checksum=kind)  # type: ignore[arg-type]
    words = np.array([payload << 3 | checksum(payload, packet_format) for payload in range(256)])
    distances = np.array([[int(a ^ b).bit_count() for b in words] for a in words])
    tried = 256 * len(list(itertools.combinations(range(11), flips)))
    assert undetected_flips(packet_format, flips) == pytest.approx((distances == flips).sum() / tried)


def test_the_shares_the_lesson_names() -> None:
    paper, crc = PacketFormat(), PacketFormat(checksum="crc3")
    assert [round(100 * undetected_flips(paper, flips)) for flips in (1, 2, 3)] == [0, 33, 5]
    assert [round(100 * undetected_flips(crc, flips)) for flips in (1, 2, 3)] == [0, 7, 16]


def test_swaps_inside_the_payload_always_pass_the_sum_and_never_the_crc() -> None:
    assert undetected_swaps(PacketFormat(checksum="crc3")) == 0
    wide = undetected_swaps(PacketFormat(payload_bits=12, checksum="sum"))
    assert wide > undetected_swaps(PacketFormat()) > 7 / 10 * 0.9  # seven of the ten neighbour pairs lie in the payload


@pytest.mark.parametrize("flips", [0, 12])
def test_a_number_of_flips_that_cannot_be_says_so(flips: int) -> None:
    with pytest.raises(ValueError, match=r"1 \.\. 11"):
        undetected_flips(PacketFormat(), flips)
