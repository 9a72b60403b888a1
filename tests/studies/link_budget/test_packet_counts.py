"""Tests of the numbers of edges in a packet and of whole packets in a period."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.marker import PacketFormat, encode_packet
from bicode_studies.link_budget.packet_counts import count_rises, packets_per_period


@pytest.mark.parametrize("packet_format", [PacketFormat(), PacketFormat(payload_bits=5, checksum="crc3")])
def test_rises_are_counted_for_every_payload(packet_format: PacketFormat) -> None:
    rises = count_rises(packet_format)
    assert rises.size == 2**packet_format.payload_bits
    for payload, n in enumerate(rises):
        text = "".join(map(str, encode_packet(payload, packet_format)))
        assert text.count("01") == n
        assert n <= packet_format.data_bits


@given(st.floats(0.1, 9.9))
def test_whole_packets_of_a_period_are_those_of_a_fine_grid_of_phases(length_packets: float) -> None:
    shares = packets_per_period(length_packets)
    assert sum(share for _, share in shares) == pytest.approx(1.0)
    phases = (np.arange(4000) + 0.5) / 4000
    held = np.maximum(np.floor(length_packets - phases), 0)
    assert sum(k * share for k, share in shares) == pytest.approx(held.mean(), abs=2e-3)
