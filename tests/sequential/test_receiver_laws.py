"""Whatever a marker sends is read, wherever and whenever it is sent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.events import copy_events
from bicode_lab.marker import PacketFormat

from .light import PERIOD_US, ids, marker, merge, noise, receive, settings_of

PAPER = PacketFormat()


@pytest.fixture(scope="module")
def scene():
    """The events of a marker amid noise, and what is seen in them."""
    rng = np.random.default_rng(0)
    events = merge(marker(37, PAPER, 5 * PERIOD_US, rng, skip_chips=11, on=9), noise(3000, 5 * PERIOD_US, rng))
    return events, receive(events, settings_of())


@pytest.mark.parametrize("shift_us", [1, 123_457, -50_021, 10**15])
def test_a_shift_in_time_changes_times_only(scene, shift_us: int) -> None:
    events, seen = scene
    later = copy_events(events)
    later["t"] += shift_us
    for one, other in zip(seen, receive(later, settings_of(), shift_us), strict=True):
        assert other.t_us == one.t_us + shift_us
        assert [p.start_us for p in other.packets] == [p.start_us + shift_us for p in one.packets]
        assert (other.id, other.margin, other.x, other.track) == (one.id, one.margin, one.x, one.track)


@pytest.mark.parametrize(("right", "down"), [(4, 8), (28, -12), (-12, 16)])
def test_a_shift_in_place_changes_places_only(right: int, down: int) -> None:
    rng = np.random.default_rng(1)
    events = marker(200, PAPER, 3 * PERIOD_US, rng)
    moved = copy_events(events)
    moved["x"] = moved["x"].astype(int) + right
    moved["y"] = moved["y"].astype(int) + down
    seen = receive(events, settings_of())
    assert ids(seen) == {200}
    for one, other in zip(seen, receive(moved, settings_of()), strict=True):
        assert (other.x, other.y, other.w, other.h) == (one.x + right, one.y + down, one.w, one.h)
        assert (other.id, other.margin, other.packets) == (one.id, one.margin, one.packets)


def test_packets_are_where_they_were_sent() -> None:
    """A packet begins up to a chip after its first edge would: the latency, and a share of a chip from the folding."""
    rng = np.random.default_rng(2)
    events = marker(37, PAPER, 8 * PERIOD_US, rng, start_us=3000)
    seen = receive(events, settings_of())
    begins = [packet.start_us for each in seen for packet in (*each.border_packets, *each.packets)]
    late = (np.array(begins) - 3000) % 14_000
    late = np.where(late > 7000, late - 14_000, late)
    assert (np.abs(late) < 500).all()
    assert len(set(np.round(np.array(begins) / 14_000))) == len(begins) >= 16


@pytest.mark.parametrize("seed", range(20))
def test_any_packet_is_read(seed: int) -> None:
    """Width, rate, check, convention, bit order, start, phase, clock, strength and background are drawn."""
    rng = np.random.default_rng(seed)
    width = (1, 2, 3, 5, 8, 12, 13, 16, 24, 32)[seed % 10]
    packet_format = PacketFormat(
        payload_bits=width,
        checksum=("sum", "crc3")[seed // 10],
        manchester=("ieee", "thomas")[seed % 2],
        bit_order=("msb", "lsb")[int(rng.integers(2))],
        f_id_hz=float(np.exp(rng.uniform(np.log(250), np.log(3000)))),
    )
    # A value whose bits alternate or are all alike is believed late; a test of its own is about these.
    payload = int(rng.integers(2**width)) if width > 5 else min(2, 2**width - 1)
    period_us = max(PERIOD_US, int(3 * packet_format.packet_us))
    settings = settings_of(packet_format, delta_t_whole_us=period_us)
    strength = float(np.exp(rng.uniform(np.log(5), np.log(400))))
    events = merge(
        marker(
            payload, packet_format, 4 * period_us, rng, skip_chips=int(rng.integers(packet_format.packet_bits)),
            error_ppm=float(rng.uniform(-1000, 1000)), on=strength, off=strength * float(rng.uniform(0.4, 1.6)),
            start_us=float(rng.uniform(0, 500)), jitter_us=float(rng.uniform(0.05, 0.3)) * packet_format.chip_us,
        ),
        noise(2000, 4 * period_us, rng),
    )  # fmt: skip
    seen = receive(events, settings)
    assert ids(seen) == {payload}
    assert [each.id for each in seen if each.t_us == 3 * period_us] == [payload]
    assert len({each.track for each in seen if each.id is not None}) == 1


@pytest.mark.parametrize("payload", [0, 1, 0x55, 0x80, 0xAA, 0xFF])
def test_values_that_look_like_a_lamp_are_read_after_a_while(payload: int) -> None:
    events = marker(payload, PAPER, 8 * PERIOD_US, np.random.default_rng(payload))
    seen = receive(events, settings_of())
    assert ids(seen) == {payload}
    assert seen[-1].id == payload


def test_few_events_of_each_edge_are_read_from_many_periods() -> None:
    """An event at each edge: 20 in a period, of which five say little; after two seconds there are 1500."""
    events = marker(37, PAPER, 40 * PERIOD_US, np.random.default_rng(4), on=1, off=1, radius_px=1.5)
    seen = receive(events, settings_of())
    assert ids(seen) == {37}
    first = next(each for each in seen if each.id is not None)
    assert first.t_us < 20 * PERIOD_US
    assert seen[-1].id == 37


@pytest.mark.parametrize(("on", "off"), [(1.0, 0.2), (0.2, 1.0)])
def test_one_polarity_may_be_stronger(on: float, off: float) -> None:
    events = marker(37, PAPER, 6 * PERIOD_US, np.random.default_rng(5), on=40 * on, off=40 * off)
    assert ids(receive(events, settings_of())) == {37}


def test_the_wrong_convention_is_not_read() -> None:
    rng = np.random.default_rng(6)
    for payload in rng.integers(1, 255, 4):
        thomas = marker(int(payload), replace(PAPER, manchester="thomas"), 5 * PERIOD_US, rng)
        assert not ids(receive(thomas, settings_of()))
        assert ids(receive(thomas, settings_of(manchester="auto"))) == {payload}


def test_evidence_grows_and_margin_with_it() -> None:
    seen = receive(marker(37, PAPER, 12 * PERIOD_US, np.random.default_rng(7), on=3, off=3), settings_of())
    read = [each for each in seen if each.id is not None]
    assert read[-1].evidence_periods > read[0].evidence_periods >= 1
    assert read[-1].margin > 3 * read[0].margin >= 24
