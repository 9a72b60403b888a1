"""The paper's receiver as a whole (Fig. 2): from a stream of events to sightings."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from blinker import blink, hot_pixels, noise, plate, square
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_lab.events import Events, make_events, merge, no_events, slice_time
from bicode_lab.marker import Board, LedWaveform, Marker, PacketFormat
from bicode_lab.recognition import ReceiverSettings, packet_rows, recognise, settings_for, to_table

SMALL = ReceiverSettings(width=320, height=240, detect_2d=False, latency_us=50)
PERIOD_US = 33_000


def far(payload: int = 0x25, seed: int = 0, end_us: int = 10 * PERIOD_US, **changes: float) -> Events:
    """Make the events of a marker 4 px wide with some noise; the first event is at 0."""
    rng = np.random.default_rng(seed)
    events = merge(
        blink(Marker(payload=payload, **changes), square(100, 80, 4), end_us, rng, probability=0.7),
        noise(320, 240, 0.003, 0, end_us, rng),
        make_events([0], [0], [1], [0]),
    )
    return slice_time(events, 0, end_us)


@given(payload=st.integers(0, 255), phase_us=st.floats(0, 14_000))
@settings(max_examples=25)
def test_every_period_of_a_marker_has_its_id(payload: int, phase_us: float) -> None:
    sightings = list(recognise(far(payload, phase_us=phase_us), SMALL))
    assert [s.t_us for s in sightings] == [k * PERIOD_US for k in range(10)]
    assert {s.id for s in sightings} == {payload}
    assert {s.track for s in sightings} == {1}
    assert {s.reason for s in sightings} == {None}
    assert {s.n_packets for s in sightings} <= {1, 2}


def test_packets_across_the_border_are_given_once_each() -> None:
    wave = LedWaveform(payload=0x25, phase_us=1234)
    sightings = list(recognise(far(phase_us=1234), SMALL))
    rows = list(packet_rows(sightings))
    starts = wave.packet_starts(0, 10 * PERIOD_US - 14_000)
    assert len(rows) == len(starts)
    assert all(row.checksum_ok and row.id == 0x25 and row.track == 1 for row in rows)
    late = np.array([row.t_us for row in rows]) - starts
    assert np.abs(late).max() <= 125  # half a bin of delta_t_ID
    assert any(s.border_packets for s in sightings)


@pytest.mark.parametrize("delta_t_id_us", [100, 250, 300, 333])
def test_bins_that_do_not_divide_the_period(delta_t_id_us: int) -> None:
    rows = list(packet_rows(recognise(far(), replace(SMALL, delta_t_id_us=delta_t_id_us))))
    starts = LedWaveform(payload=0x25).packet_starts(0, 10 * PERIOD_US - 14_000)
    assert {row.id for row in rows} == {0x25}
    assert len(rows) >= len(starts) - 1  # the first may seem to begin before the recording


def border_readings(edge: int, before: bool) -> list[int | None]:
    """Return the IDs of the packets across the first border, for a marker with an edge in the bin that lies across it.

    Bins of 333 us do not divide the period: bin 99 spans 32 967 .. 33 300 us, and the second period begins at 33 000.
    All events of an edge come 10 us after it, so those of the edge in that bin lie before the border, or after it.
    """
    packet = LedWaveform(payload=0x25, phase_us=0)
    edges_us = packet.steps(0, 14_000)[0][1:]
    at_us = 32_970 if before else 33_010
    times_us, levels = LedWaveform(payload=0x25, phase_us=at_us - edges_us[edge]).steps(0, 3 * PERIOD_US)
    x, y = square(100, 80, 4)
    n = times_us.size - 1
    events = make_events(np.tile(x, n), np.tile(y, n), np.repeat(levels[1:] > 0, 16), np.repeat(times_us[1:] + 10, 16))
    sightings = list(recognise(events, replace(SMALL, delta_t_id_us=333), t0_us=0))
    return [packet.payload for packet in sightings[1].border_packets if packet.checksum_ok]


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("edge", range(15))
def test_an_edge_in_the_bin_across_the_border_is_seen_on_either_side(edge: int, before: bool) -> None:
    """The two counts of that bin are added: its events of both periods belong to the packet."""
    assert border_readings(edge, before) == [0x25]


def test_the_two_parts_of_the_bin_across_the_border_are_added() -> None:
    """Of a packet's first ON edge all 16 events, 12, 4 or none lie in the first period, the others in the second.

    Its time is the centre of mass of the bin: were one part left out, or counted as a bin of its own, the edge would
    be gone or elsewhere.
    """
    packet = LedWaveform(payload=0x25, phase_us=0)
    first_us = packet.steps(0, 14_000)[0][1]
    starts: set[int] = set()
    for n_before in (16, 12, 4, 0):  # events before the border
        times_us, levels = LedWaveform(payload=0x25, phase_us=32_990 - first_us).steps(0, 3 * PERIOD_US)
        x, y = square(100, 80, 4)
        n = times_us.size - 1
        t = np.repeat(times_us[1:], 16).astype(int)
        later = np.tile(np.arange(16) >= n_before, n)  # in all edges, so that they are alike
        events = make_events(np.tile(x, n), np.tile(y, n), np.repeat(levels[1:] > 0, 16), t + np.where(later, 20, 0))
        events.sort(order="t")
        sightings = list(recognise(events, replace(SMALL, delta_t_id_us=333), t0_us=0))
        (found,) = sightings[1].border_packets
        assert found.payload == 0x25
        starts.add(found.edge_us)
    assert starts == {99 * 333 + 166}  # the middle of the bin


@given(borders=st.lists(st.integers(0, 40_000), max_size=8), shift=st.integers(0, 2**45))
@settings(max_examples=20)
def test_chunks_and_clock_do_not_matter(borders: list[int], shift: int) -> None:
    events = far(end_us=4 * PERIOD_US)
    whole = list(recognise(events, SMALL))
    moved = events.copy()
    moved["t"] += shift
    parts = list(recognise(iter(np.split(moved, sorted(min(b, events.size) for b in borders))), SMALL))
    assert [(s.t_us + shift, s.id, s.x, s.track) for s in whole] == [(s.t_us, s.id, s.x, s.track) for s in parts]
    assert [p.start_us + shift for s in whole for p in s.packets] == [p.start_us for s in parts for p in s.packets]


def test_given_events_are_not_written_to() -> None:
    events = far(end_us=2 * PERIOD_US)
    events.setflags(write=False)
    assert [s.id for s in recognise(events, SMALL)] == [0x25, 0x25]


def test_several_markers_at_once_keep_their_ids_and_tracks() -> None:
    rng = np.random.default_rng(1)
    places = {11: (20, 20), 22: (100, 20), 33: (200, 60), 44: (30, 150), 55: (250, 200)}
    events = merge(
        *(
            blink(Marker(payload=payload, phase_us=700.0 * payload), square(*corner, 4 + payload // 11), 990_000, rng)
            for payload, corner in places.items()
        ),
        hot_pixels(30, 320, 240, 134.0, 990_000, rng),
    )
    table = to_table(recognise(slice_time(events, 0, 990_000), SMALL))
    read = table.dropna(subset="id")
    assert read.groupby("track").id.nunique().tolist() == [1] * 5
    assert (read.groupby("id").size() >= 29).all()
    for payload, (x, y) in places.items():
        assert read[read.id == payload][["x", "y"]].drop_duplicates().to_numpy().tolist() == [[x, y]]


def test_a_near_marker_has_pose_and_id_in_one_row() -> None:
    rng = np.random.default_rng(2)
    marker = Marker(payload=200, board=Board(aruco_id=9))
    events = blink(marker, plate(marker, 90, 50, 84), 2 * PERIOD_US, rng)
    sightings = list(recognise(slice_time(events, 0, 2 * PERIOD_US), replace(SMALL, detect_2d=True)))
    assert {(s.id, s.marker_2d_id) for s in sightings} == {(200, 9)}
    for s in sightings:
        assert s.corners is not None
        assert s.rvec is not None
        assert s.tvec is not None
        assert s.tvec[2] == pytest.approx(0.05 * 1646.09 / 84, rel=0.03)
        assert (s.x, s.y, s.w, s.h) == (90, 50, 84, 84)


def test_two_ids_in_one_period_are_a_conflict() -> None:
    rng = np.random.default_rng(3)
    first = blink(Marker(payload=1), square(50, 50, 6), 14_600, rng)
    second = blink(Marker(payload=2), square(50, 50, 6), PERIOD_US, rng, start_us=14_600)
    (sighting,) = recognise(slice_time(merge(first, second), 0, PERIOD_US), SMALL, t0_us=0)
    assert (sighting.id, sighting.reason, sighting.n_packets) == (None, "conflict", 2)


@pytest.mark.parametrize("payload", [0, 0x25, 255])
@pytest.mark.parametrize("convention", ["ieee", "thomas"])
def test_auto_finds_the_convention(convention: str, payload: int) -> None:
    events = far(payload, packet_format=PacketFormat(manchester=convention))
    assert {s.id for s in recognise(events, replace(SMALL, manchester="auto"))} == {payload}
    other = "thomas" if convention == "ieee" else "ieee"
    if payload:
        assert {s.reason for s in recognise(events, replace(SMALL, manchester=other))} == {"checksum"}


@pytest.mark.parametrize("f_id_hz", [250.0, 500.0, 2000.0])
def test_other_bit_rates(f_id_hz: float) -> None:
    f = PacketFormat(f_id_hz=f_id_hz)
    s = settings_for(f, width=320, height=240, detect_2d=False)
    events = blink(
        Marker(packet_format=f), square(50, 50, 5), 5 * s.delta_t_whole_us, np.random.default_rng(4), spread=0.3
    )
    ids = [sighting.id for sighting in recognise(slice_time(events, 0, 5 * s.delta_t_whole_us), s, t0_us=0)]
    assert ids == [0x25] * 5


@pytest.mark.parametrize("rule", ["blink", "sum", "last", "any"])
def test_every_region_rule_reads_a_near_marker(rule: str) -> None:
    """The test marker makes 1.9 events per edge and pixel for both polarities, so even the sum is seldom 0."""
    events = blink(Marker(), square(50, 50, 20), 3 * PERIOD_US, np.random.default_rng(5))
    s = replace(SMALL, frame_rule_blinker=rule)
    assert {x.id for x in recognise(slice_time(events, 0, 3 * PERIOD_US), s, t0_us=0)} == {0x25}


def test_hours_of_quiet_between_events() -> None:
    later_us = 9 * 3600 * 10**6 // PERIOD_US * PERIOD_US
    events, again = far(end_us=3 * PERIOD_US), far(end_us=3 * PERIOD_US)
    again["t"] += later_us
    sightings = list(recognise([events, again], SMALL))
    assert [s.t_us for s in sightings] == [*range(0, 3 * PERIOD_US, PERIOD_US), *range(later_us, later_us + 3 * PERIOD_US, PERIOD_US)]  # fmt: skip # noqa: E501
    assert {s.id for s in sightings} == {0x25}
    assert {s.track for s in sightings} == {1, 2}


def test_a_stream_is_read_as_it_comes() -> None:
    taken = []

    def chunks() -> Iterator[Events]:
        for k in range(10):
            taken.append(k)
            yield slice_time(events, k * PERIOD_US, (k + 1) * PERIOD_US)

    events = far()
    stream = recognise(chunks(), SMALL)
    next(stream)
    assert taken == [0, 1]


def test_no_events_no_rows() -> None:
    assert list(recognise(no_events(), SMALL)) == []
    assert list(recognise([], SMALL)) == []
    table = to_table([])
    assert len(table) == 0
    assert table.dtypes["id"] == "Int64"


def test_noise_alone_has_no_rows() -> None:
    rng = np.random.default_rng(6)
    events = merge(noise(320, 240, 1.0, 0, 330_000, rng), hot_pixels(40, 320, 240, 134.0, 330_000, rng))
    assert list(recognise(events, SMALL)) == []
