"""Runs of letters and single letters whose clock begins anew after a pause."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.soft_receiver.line_code import UartLine
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.text.amounts import count_events
from bicode_lab.soft_receiver.text.edge_rates import Learned, edge_contexts, kernel_rates
from bicode_lab.soft_receiver.text.runs import align_frames, align_runs, find_runs
from bicode_lab.soft_receiver.uart import read_text

from .light import light_events
from .test_edge_rates import MEMORY, contexts_of, kernels_of
from .test_text_clock import times_of

LINE = UartLine(rate_hz=1000)
TRUTH = kernels_of(12, 9, background=0.002)
RATES = kernel_rates(TRUTH, edge_contexts(MEMORY))


def learned_of(path: np.ndarray) -> Learned:
    """Return what is known of a light whose rates are known."""
    return Learned(TRUTH, RATES, np.ones(2), 0.0, path.astype(np.int32))


def runs_of_letters(pauses: list[int], letters: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return levels, counts, and the first chip of each letter, of runs with pauses between them."""
    rng = np.random.default_rng(seed)
    parts, begins, at = [], [], 0
    for pause in pauses:
        parts.append(np.ones(pause, int))
        at += pause
        for value in rng.integers(33, 127, letters):
            parts.append(LINE.encode(int(value)).astype(int))
            begins.append(at)
            at += 11
    levels = np.concatenate([*parts, np.ones(8, int)])
    return levels, rng.poisson(RATES[contexts_of(levels)]), np.array(begins)


def test_runs_end_in_long_pauses_only() -> None:
    _, counts, _ = runs_of_letters([5, 40, 3, 60], 6)
    bounds = find_runs(counts.astype(np.float32), 11)
    assert bounds.size == 4
    assert bounds[0] == 0
    assert bounds[-1] == len(counts)
    assert abs(bounds[1] - (5 + 66 + 20)) < 5
    assert find_runs(np.zeros((50, 16, 2), np.float32), 11).tolist() == [0, 50]


@pytest.mark.parametrize("late", [0.25, -0.25, 0.5])
def test_a_run_that_begins_between_chips_is_moved_and_the_others_are_not(late: float) -> None:
    _, counts, _ = runs_of_letters([5, 40, 60], 8)
    chips, is_on = times_of(counts)
    second = (chips > 5 + 88 + 20) & (chips < 5 + 88 + 40 + 88 + 30)
    moved = count_events(chips + late * second, is_on, 0, len(counts)).astype(np.float32)
    _, move = align_runs(moved, learned_of(np.zeros(0)), build_nodes(LINE, MEMORY, True), 11)
    assert move[[0, 2]].tolist() == [0, 0]
    assert abs(move[1]) == 0.5 if late == 0.5 else move[1] == pytest.approx(-late)


def test_frames_are_moved_one_by_one_after_pauses_and_together_without() -> None:
    levels, counts, begins = runs_of_letters([5, 4, 4, 0, 0, 0], 1)
    chips, is_on = times_of(counts)
    late = np.where((chips > begins[1]) & (chips < begins[2]), 0.25, 0.0)
    late[(chips > begins[4]) & (chips < begins[4] + 11)] = 0.0625
    moved = count_events(chips + late, is_on, 0, len(counts)).astype(np.float32)
    context = contexts_of(levels).astype(np.int32)
    move = align_frames(moved, learned_of(np.zeros(0)), context, begins, 11)
    assert move[1] == pytest.approx(-0.25, abs=0.07)
    assert np.abs(move[[0, 2, 3]]).max() < 0.07
    assert align_frames(moved, learned_of(np.zeros(0)), context, begins[:0], 11).size == 0


def test_by_chance_no_run_of_a_faint_light_is_moved() -> None:
    levels, counts, _ = runs_of_letters([5, *[40] * 30], 1, seed=3)
    faint = np.random.default_rng(4).binomial(counts, 0.1).astype(np.float32)
    rates = RATES * 0.1
    learned = Learned(TRUTH, rates, np.ones(2), 0.0, np.zeros(0, np.int32))
    bounds, move = align_runs(faint, learned, build_nodes(LINE, MEMORY, True), 11)
    assert bounds.size > 15
    assert (move == 0).all()
    assert levels.size == len(counts)


def test_letters_with_pauses_of_any_length_are_read() -> None:
    rng = np.random.default_rng(1)
    text = "".join(map(chr, rng.integers(33, 127, 200)))
    parts, at_us = [], 5000.0
    for letter in text:
        chips = np.concatenate([np.ones(1, np.uint8), LINE.encode(ord(letter))])
        parts.append(light_events(chips, 1000.0, rng, phase_us=at_us, before=1, on_per_edge=20, off_per_edge=20))
        at_us += 11_000 + rng.choice([0.0, 0.0, 0.0, rng.uniform(0, 60_000)])
    events = np.concatenate(parts)
    reading = read_text(events[np.argsort(events["t"], kind="stable")], LINE)
    given = "".join(character.letter for character in reading.characters)
    assert len(given) == len(text)
    assert np.mean([a == b for a, b in zip(given, text, strict=True)]) > 0.985
