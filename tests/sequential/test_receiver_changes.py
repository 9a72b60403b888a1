"""Markers that come, go, move and change what they send."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.events import make_events, merge, slice_time
from bicode_lab.marker import PacketFormat

from .light import PERIOD_US, ids, in_a_row, marker, noise, receive, settings_of

PAPER = PacketFormat()


def test_a_marker_that_appears_in_the_middle_of_a_period_is_read_in_the_next() -> None:
    rng = np.random.default_rng(0)
    start_us = 3.5 * PERIOD_US
    events = merge(marker(37, PAPER, 7 * PERIOD_US, rng, start_us=start_us), noise(2000, 7 * PERIOD_US, rng))
    read = [each for each in receive(events, settings_of()) if each.id is not None]
    assert {each.id for each in read} == {37}
    assert start_us - PERIOD_US < read[0].t_us <= 4 * PERIOD_US


@pytest.mark.parametrize("noise_per_s", [0, 5000])
def test_the_id_stops_within_two_periods_of_a_marker_that_leaves(noise_per_s: float) -> None:
    rng = np.random.default_rng(1)
    events = merge(marker(37, PAPER, 6 * PERIOD_US, rng), noise(noise_per_s, 15 * PERIOD_US, rng))
    read = [each.t_us for each in receive(events, settings_of()) if each.id is not None]
    assert 5 * PERIOD_US <= read[-1] <= 8 * PERIOD_US


def test_payloads_that_change_from_packet_to_packet_are_read_one_by_one() -> None:
    rng = np.random.default_rng(2)
    sent = [int(value) for value in rng.choice([37, 90, 200, 14, 73, 158, 99], 40)]
    events = marker(sent, PAPER, 12 * PERIOD_US, rng)
    seen = receive(events, settings_of())
    packets = {round(p.start_us / 14_000): p.payload for each in seen for p in (*each.border_packets, *each.packets)}
    assert len(packets) >= 24  # of 28 whole packets
    assert all(sent[k] == payload for k, payload in packets.items())
    assert not [each for each in seen if each.id is not None and len({p.payload for p in each.packets}) > 1]


def test_a_payload_that_changes_once_is_read_before_and_after() -> None:
    rng = np.random.default_rng(3)
    events = merge(marker(37, PAPER, 8 * 14_000 * 2, rng), marker(90, PAPER, 500_000, rng, start_us=8 * 14_000 * 2))
    seen = receive(events, settings_of())
    assert in_a_row([each.id for each in seen if each.id is not None]) == [37, 90]
    change = next(each.t_us for each in seen if each.id == 90)
    assert change <= 8 * 14_000 * 2 + 2 * PERIOD_US
    assert {each.track for each in seen} == {1}


@pytest.mark.parametrize("left_us", [1, 200, 2000, 9000, 20_000, 32_000])
@pytest.mark.parametrize("seed", range(2))
def test_a_last_period_that_is_cut_short_makes_one_row_of_the_same_track(left_us: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole = marker(37, PAPER, 10 * PERIOD_US, rng, skip_chips=3 * seed, radius_px=6, on=90, off=60)
    seen = receive(slice_time(whole, 0, 6 * PERIOD_US + left_us), settings_of())
    assert {each.track for each in seen} == {1}
    assert len({each.t_us for each in seen}) == len(seen)
    assert ids(seen) == {37}


def test_a_plate_that_moves_keeps_its_track() -> None:
    """300 px/s are 10 px in a period, the width of the light and more."""
    events = marker(37, PAPER, 8 * PERIOD_US, np.random.default_rng(4), centre=(8, 30), velocity_px_per_s=300)
    seen = receive(events, settings_of())
    assert {each.track for each in seen} == {1}
    assert [each.id for each in seen] == [37] * len(seen)
    assert len(seen) >= 7
    assert seen[-1].x - seen[0].x > 50


def test_clutter_on_the_marker_does_not_change_its_id() -> None:
    """There are 33 bursts of 60 events in a third of a second, each 3 ms long."""
    rng = np.random.default_rng(5)
    begins = np.repeat(rng.uniform(0, 10 * PERIOD_US, 33), 60)
    t = begins + rng.uniform(0, 3000, begins.size)
    clutter = make_events(rng.integers(32, 48, t.size), rng.integers(22, 38, t.size), rng.integers(0, 2, t.size), t)
    events = merge(marker(37, PAPER, 10 * PERIOD_US, rng), clutter, noise(5000, 10 * PERIOD_US, rng))
    seen = receive(events, settings_of())
    assert ids(seen) == {37}
    assert sum(each.id == 37 for each in seen) >= 8


def test_two_markers_are_two_tracks() -> None:
    rng = np.random.default_rng(6)
    events = merge(
        marker(37, PAPER, 6 * PERIOD_US, rng, centre=(20, 30)),
        marker(90, PAPER, 6 * PERIOD_US, rng, centre=(70, 30), skip_chips=9, error_ppm=300),
    )
    seen = receive(events, settings_of())
    assert {each.id for each in seen if each.x < 40} == {37}
    assert {each.id for each in seen if each.x >= 40} == {90}
    assert len({each.track for each in seen}) == 2
