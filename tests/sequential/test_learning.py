"""Learning against a plain loop, and what it can and cannot find in noise and in long pulses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.sequential import repeated
from bicode_lab.sequential.fold import PHASES, Bins, Folded, find_clock, fold
from bicode_lab.sequential.judge import judge
from bicode_lab.sequential.learning import ROUNDS, learn
from bicode_lab.sequential.levels import TAILS, chip_scores, estimate_levels, find_dispersion, guess_levels
from bicode_lab.sequential.paths import best_contexts, score_places
from bicode_lab.sequential.reading import MIN_GAIN, Reading
from bicode_lab.sequential.repeated import MORE_STARTS, STARTS, read_repeated
from bicode_lab.soft_receiver.line_code import BicodeLine

from .light import ids, marker, receive, settings_of

LINE = BicodeLine(packet_format=PacketFormat())
FAST = PacketFormat(f_id_hz=4000, payload_bits=16)


def test_learning_is_path_and_levels_in_turn() -> None:
    rng = np.random.default_rng(0)
    n = LINE.frame_chips
    counts = rng.poisson(rng.uniform(0, 2, (3 * n, 2, PHASES))).astype(float)
    frames = Folded(counts, counts**2, np.ones_like(counts))
    guess = guess_levels(frames, 0.4)
    levels, dispersion = guess, np.ones(2)
    for learning in range(ROUNDS + 1):
        scores = chip_scores(frames, levels, dispersion if learning < ROUNDS else np.ones(2))
        each = [best_contexts(scores[k : k + n], LINE) for k in range(0, 3 * n, n)]
        contexts, total = np.concatenate([one for one, _ in each]), sum(score for _, score in each)
        dispersion = find_dispersion(frames, levels, contexts)
        if learning < ROUNDS:
            levels = estimate_levels(frames, contexts, guess, dispersion)
    learned = learn(frames, guess, LINE)
    assert learned.total == pytest.approx(total)
    assert learned.contexts.tolist() == contexts.tolist()
    assert learned.levels == pytest.approx(levels)
    assert learned.dispersion == pytest.approx(dispersion)


@pytest.mark.parametrize("events_per_bin", [0.02, 0.2, 2.0])
@pytest.mark.parametrize("n_frames", [1.3, 6.0])
def test_noise_gains_nothing_by_learning(events_per_bin: float, n_frames: float) -> None:
    """Of 40 recordings of noise with four tails each, none gains what a marker must gain."""
    n = int(n_frames * LINE.frame_chips * PHASES)
    for seed in range(40):
        counts = np.random.default_rng(seed).poisson(events_per_bin, (n, 2)).astype(float)
        bins = Bins((np.arange(n) + 0.5) / PHASES, counts)
        folded = fold(bins, find_clock(bins), LINE.frame_chips)
        for tail in TAILS:
            learned = learn(folded, guess_levels(folded, tail), LINE)
            places = score_places(chip_scores(folded, learned.levels, learned.dispersion), LINE)
            total = best_contexts(chip_scores(folded, learned.levels, learned.dispersion), LINE)[1]
            assert judge(learned, learned.contexts, total, places, 0, -np.inf).gain < MIN_GAIN


@pytest.mark.parametrize("tail_us", [0.0, 80.0, 160.0])
def test_pulses_longer_than_a_chip_are_read(tail_us: float) -> None:
    """A chip lasts 125 us; ON and OFF events come up to two chips late, with 30 events of an edge."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        value = int(rng.integers(1, 2**16))
        events = marker(value, FAST, 8 * 16_500, rng, tail_us=tail_us, latency_us=(120, 200), on=30, off=25)
        settings = settings_of(FAST, delta_t_whole_us=16_500, delta_t_2d_us=4000, delta_t_blinker_us=500)
        found = receive(events, settings)
        assert ids(found) == {value}
        assert sum(sighting.id == value for sighting in found) >= 7


def test_a_start_that_is_wrong_by_a_chip_is_left_again() -> None:
    """Whatever the delay between ON and OFF in whole chips, a marker is read from its counts."""
    rng = np.random.default_rng(5)
    for later in (-1, 0, 1, 2):
        counts = np.zeros((12 * LINE.frame_chips * PHASES, 2))
        chips = np.tile(LINE.encode(37), 12).astype(int)
        edges = np.diff(np.concatenate([[0], chips]))
        for side, new, delay in ((0, 1, 0), (1, -1, later)):
            at = (np.flatnonzero(edges == new) + 0.4 + delay) * PHASES
            at = at[(at >= 0) & (at < len(counts))].astype(int)
            counts[at, side] = rng.poisson(12, at.size)
        counts += rng.poisson(0.02, counts.shape)
        reading = read_repeated(Bins((np.arange(len(counts)) + 0.5) / PHASES, counts), LINE)
        assert reading.value == 37
        assert reading.doubt is None


@pytest.mark.parametrize(
    ("changes", "asked"),
    [({"guessed_gain": MIN_GAIN}, [STARTS]), ({"guessed_gain": MIN_GAIN - 1}, [STARTS, MORE_STARTS]),
     ({"guessed_gain": 0.0, "margin": 1.0}, [STARTS])],
)  # fmt: skip
def test_a_reading_that_only_learned_levels_explain_is_looked_for_from_more_places(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, float], asked: list[int]
) -> None:
    """A believed reading is replaced by the likeliest of the wider search, whatever that says."""
    sure = Reading(value=37, check=True, gain=90, rival=90, place=50, margin=40, n_frames=9)
    calls: list[int] = []

    def likeliest(bins: Bins, clock: object, line: object, n_starts: int) -> Reading:
        calls.append(n_starts)
        return replace(sure, value=36 + len(calls), **changes)

    monkeypatch.setattr(repeated, "_likeliest", likeliest)
    n = 3 * LINE.frame_chips * PHASES
    counts = np.random.default_rng(0).poisson(0.5, (n, 2)).astype(float)
    assert repeated.read_repeated(Bins((np.arange(n) + 0.5) / PHASES, counts), LINE).value == 36 + len(asked)
    assert calls == asked
