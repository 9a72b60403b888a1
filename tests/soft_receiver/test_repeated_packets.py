"""Reading one packet from many repetitions of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.soft_receiver.levels import PHASES, guess_levels, log_likelihoods
from bicode_lab.soft_receiver.line_code import BicodeLine
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.places import MEMORY, roll_to_place, score_places
from bicode_lab.soft_receiver.repeated_packets import Reading, doubt, read_repeated_packets
from bicode_lab.soft_receiver.viterbi import best_path

from .light import light_events
from .test_clock import BIN_US, marks_of

LINE = BicodeLine(packet_format=PacketFormat())


def believed(reading: Reading) -> int | None:
    """Return the ID, or None if it is doubted."""
    return None if doubt(reading) else reading.value


@pytest.mark.parametrize("n_packets", [2.36, 71])
def test_any_payload_phase_and_clock_is_read(n_packets: float) -> None:
    rng = np.random.default_rng(0)
    for payload in (0, 1, 0x25, 0x80, 0xAA, 0xFF, *rng.integers(0, 256, 14)):
        skip = int(rng.integers(28))
        chips = np.tile(LINE.encode(int(payload)), 80)[skip : skip + int(n_packets * 28)]
        error_ppm = float(rng.uniform(-1000, 1000))
        events = light_events(
            chips, 500.0, rng, phase_us=float(rng.uniform(0, 500)), error_ppm=error_ppm, on_per_edge=4, off_per_edge=3
        )
        reading = read_repeated_packets(marks_of(events), BIN_US, LINE)
        assert believed(reading) == payload
        # The start is where the light's own lies, up to the latency.
        late = (reading.start_us - events["t"][0] + events["t"][0]) % (14_000 * (1 + error_ppm * 1e-6))
        start = (-skip * 500) % 14_000
        assert min(abs(late - start - shift) for shift in (0, 14_000, -14_000)) < 1000
        if n_packets > 10:
            assert reading.error_ppm == pytest.approx(error_ppm, abs=40)


def test_evidence_of_many_packets_reads_what_one_cannot() -> None:
    """There is about one event in ten edges, so that a packet holds two or three."""
    rng = np.random.default_rng(1)
    right = []
    for payload in rng.integers(0, 256, 20):
        events = light_events(
            np.tile(LINE.encode(int(payload)), 71), 500.0, rng, on_per_edge=0.12, off_per_edge=0.1, noise_hz=2
        )
        right.append(believed(read_repeated_packets(marks_of(events), BIN_US, LINE)) == payload)
    assert np.mean(right) >= 0.9


def test_chance_and_lamps_are_no_id() -> None:
    """Noise of any rate, and lamps that flicker at the chip rate and at half of it, give no ID in 700 tries."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        marks = np.zeros(1065, np.int8)
        marks[rng.integers(0, marks.size, rng.integers(1, 300))] = 1
        marks *= rng.choice(np.array([-1, 1], np.int8), marks.size)
        assert believed(read_repeated_packets(marks, BIN_US, LINE)) is None
    for period, _ in [(p, k) for p in (2, 4) for k in range(100)]:
        chips = np.tile(np.arange(period) < period // 2, 66 // period)
        mean = float(rng.uniform(0.3, 5))
        events = light_events(
            chips, 500.0, rng, phase_us=rng.uniform(0, 500), on_per_edge=mean, off_per_edge=mean * rng.uniform(0.5, 2)
        )
        assert believed(read_repeated_packets(marks_of(events), BIN_US, LINE)) is None
    for k in range(200):  # random Manchester bits: no start, no checksum
        chips = np.stack([bits := rng.integers(0, 2, 33), 1 - bits], axis=1).ravel()
        events = light_events(chips, 500.0, rng, phase_us=k, on_per_edge=3)
        assert believed(read_repeated_packets(marks_of(events), BIN_US, LINE)) is None


def test_a_wrong_checksum_is_the_last_word() -> None:
    chips = LINE.encode(0x25)
    chips[8:10] = chips[9:7:-1]  # one bit of the payload turned
    events = light_events(np.tile(chips, 20), 500.0, np.random.default_rng(3))
    reading = read_repeated_packets(marks_of(events), BIN_US, LINE)
    assert not reading.check
    assert doubt(reading) == "checksum"


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, None),
        ({"gain": 13.1}, None),
        ({"gain": 12.9}, "no_start"),
        ({"start_activity": 0.09}, None),
        ({"start_activity": 0.11}, "no_start"),
        ({"margin": 8.1}, None),
        ({"margin": 7.9}, "manchester"),
        ({"support": 0.86}, None),
        ({"support": 0.84}, "manchester"),
        ({"check": False}, "checksum"),
        ({"value": None}, "no_events"),
    ],
)
def test_a_reading_is_doubted_beyond_each_limit(changes: dict[str, object], reason: str | None) -> None:
    """Each limit by itself.

    Of 4949 readings of noise, of lamps and of chips drawn at random, one was believed. Without the limit of the gain
    it would have been 14 (6 with a limit of 6), without that of the margin 5, and without that of the start's activity
    48; the support alone decided none of them.
    """
    sure = Reading(37, check=True, gain=90.0, margin=40.0, support=0.99, start_activity=0.0)
    assert doubt(replace(sure, **changes)) == reason  # type: ignore[arg-type]


def test_nothing_says_nothing() -> None:
    assert doubt(read_repeated_packets(np.zeros(1000, np.int8), BIN_US, LINE)) == "no_events"
    one = np.zeros(1000, np.int8)
    one[500] = 1
    assert believed(read_repeated_packets(one, BIN_US, LINE)) is None


def test_every_place_is_scored_as_the_best_path_from_there() -> None:
    """The kernel that scores all places agrees with `best_path`, place by place."""
    rng = np.random.default_rng(4)
    counts = rng.integers(0, 3, (28, PHASES, 3)).astype(float)
    nodes = build_nodes(LINE, MEMORY)
    levels = guess_levels(counts, MEMORY)
    places = score_places(counts, levels, nodes)
    for place in range(0, places.size, 37):
        scores = log_likelihoods(roll_to_place(counts, place), levels)
        path, _ = best_path(scores, nodes, MEMORY - 1)
        assert places[place] == pytest.approx(scores[np.arange(28), nodes.context[path]].sum())
