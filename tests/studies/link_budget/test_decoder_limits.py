"""Tests of the decoder's limits: theory predicts what trials give."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binomtest

from bicode_lab.marker import PacketFormat, encode_packet
from bicode_studies.link_budget.decoder_limits import Channel, measure, rate_table, read_bits, read_packets, send
from bicode_studies.link_budget.decoder_theory import edge_missed, predict
from bicode_studies.statistics import wilson

FORMAT = PacketFormat()
BIN_US = 250


def test_a_stream_holds_its_packets_and_its_events_in_their_places() -> None:
    stream = send(20, FORMAT, Channel(events_per_edge=7.0, spread_us=1e-3), BIN_US, seed=3)
    assert np.array_equal(stream.chips, np.concatenate([encode_packet(int(p), FORMAT) for p in stream.payloads]))
    change = np.diff(np.concatenate([[0], stream.chips, [0]]).astype(int))
    for counts, side in ((stream.n_on, 1), (stream.n_off, -1)):
        edges_us = np.flatnonzero(change == side) * FORMAT.chip_us
        bins = ((edges_us + stream.phase_us) // BIN_US).astype(int)
        assert set(np.flatnonzero(counts)) <= set(bins)
        assert abs(counts.sum() - 7.0 * edges_us.size) < 4 * np.sqrt(7.0 * edges_us.size)


def test_strays_come_at_their_rate_without_any_edge() -> None:
    stream = send(200, FORMAT, Channel(events_per_edge=0.0, stray_hz=500.0), BIN_US, seed=0)
    seconds = stream.n_on.size * BIN_US * 1e-6
    for counts in (stream.n_on, stream.n_off):
        assert abs(counts.sum() - 500 * seconds) < 4 * np.sqrt(500 * seconds)


@pytest.mark.parametrize("gate", [0.0, 0.2])
def test_many_events_read_all_and_none_read_nothing(gate: float) -> None:
    rich = send(40, FORMAT, Channel(events_per_edge=80.0, spread_us=30.0), BIN_US, seed=1)
    assert read_bits(rich, FORMAT, BIN_US, gate) == {"right": 40 * 11, "unread": 0, "wrong": 0}
    assert read_packets(rich, FORMAT, BIN_US, gate) == {"right": 40, "unread": 0, "wrong": 0, "caught": 0}
    empty = send(4, FORMAT, Channel(events_per_edge=0.0), BIN_US, seed=1)
    assert read_bits(empty, FORMAT, BIN_US, gate)["right"] == 0
    assert read_packets(empty, FORMAT, BIN_US, gate)["right"] == 0


@pytest.mark.parametrize("gate", [0.0, 0.2])
@pytest.mark.parametrize("events_per_edge", [2.0, 4.0, 7.0])
def test_theory_is_what_a_trial_gives(events_per_edge: float, gate: float) -> None:
    """Packets pass an exact binomial test at 1 in 10,000; bits of one packet depend on each other: twice the width."""
    channel = Channel(events_per_edge=events_per_edge, spread_us=30.0)
    got = measure([channel], FORMAT, packets=1000, delta_t_id_us=BIN_US, gate=gate, seed=5).iloc[0]
    expected = predict(channel, FORMAT, BIN_US, gate)
    assert binomtest(int(got.packets_right), int(got.packets), expected["packets"]).pvalue > 1e-4
    share = expected["bits"]
    assert abs(got.bits_right / got.bits - share) < 8 * np.sqrt(share * (1 - share) / got.bits)


def missed(events_per_edge: float, gate: float) -> float:
    share, weights = edge_missed(Channel(events_per_edge=events_per_edge), BIN_US, gate, edges=40)
    assert np.allclose(weights.sum(0), 1)
    return float((share * weights).sum(0).mean())


def test_an_edge_is_missed_less_with_more_events_and_more_with_a_gate() -> None:
    without = [missed(n, 0.0) for n in (0.0, 1.0, 3.0, 9.0)]
    assert without == pytest.approx(np.exp([0.0, -1.0, -3.0, -9.0]))
    assert missed(9.0, 0.5) > missed(9.0, 0.2) > without[-1]


def test_no_packet_is_counted_twice_in_a_poor_channel() -> None:
    for seed in range(20):
        stream = send(10, FORMAT, Channel(events_per_edge=4.0, stray_hz=1500.0), BIN_US, seed)
        counts = read_packets(stream, FORMAT, BIN_US, gate=0.2)
        assert min(counts.values()) >= 0
        assert sum(counts.values()) == 10


@pytest.mark.parametrize("values", [{"events_per_edge": -1.0}, {"events_per_edge": 1.0, "spread_us": 0.0}])
def test_a_channel_that_cannot_be_says_so(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="choose"):
        Channel(**values)


def test_rates_have_their_shares_and_wilson_intervals() -> None:
    table = rate_table([3, 10, 0], [10, 10, 10])
    assert table["rate"].tolist() == [0.3, 1.0, 0.0]
    for right, (_, low, high) in zip((3, 10, 0), table.to_numpy(), strict=True):
        assert (low, high) == pytest.approx(wilson(right, 10), abs=1e-3)
