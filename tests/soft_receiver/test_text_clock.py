"""Where the learning of a text begins, and how its clock is followed."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.text.amounts import OFF, ON, count_events
from bicode_lab.soft_receiver.text.clock import FOLLOW_CHIPS, follow_clock
from bicode_lab.soft_receiver.text.edge_rates import edge_contexts, kernel_rates
from bicode_lab.soft_receiver.text.starts import LEAD_CHIPS, Start, find_starts, first_kernels

from .test_edge_rates import MEMORY, contexts_of, kernels_of, light


def times_of(counts: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return chip numbers and sides of the events of counts, in order."""
    rng = np.random.default_rng(seed)
    chip, phase, side = np.nonzero(counts)
    n = counts[chip, phase, side]
    at = np.repeat(chip + phase / PHASES, n) + rng.uniform(0, 1 / PHASES, n.sum())
    order = np.argsort(at)
    return at[order], np.repeat(side == ON, n)[order]


@pytest.mark.parametrize("ppm", [-1000.0, -337.0, 0.0, 60.0, 1000.0])
@pytest.mark.parametrize("off_bin", [8, 20, 27])
def test_one_of_the_starts_has_the_clock_and_the_order(ppm: float, off_bin: int) -> None:
    _, counts = light(4, kernels_of(8, 5, off_bin=off_bin), 300)
    chips, is_on = times_of(counts)
    starts = find_starts((chips - chips[0]) / (1 + ppm * 1e-6), is_on)
    order = (off_bin - 14) / PHASES
    near = [s for s in starts if abs(s.middle[OFF] - s.middle[ON] - order) < 0.06 and abs(s.rate * 1e6 - ppm) < 30]
    assert len(near) == 1
    start = near[0]
    assert min(start.middle) == pytest.approx(LEAD_CHIPS)
    found = (16.5 / PHASES - start.middle[ON] - chips[0] - start.shift) % 1  # the ON events lie in bins 14 to 18
    assert min(found, 1 - found) < 0.06
    assert len(starts) <= 3


def test_where_no_line_tells_a_phase_all_phases_are_tried() -> None:
    rng = np.random.default_rng(5)
    chips = np.sort(rng.uniform(0, 3000, 900))
    starts = find_starts(chips, rng.random(900) < 0.5)
    assert len(starts) >= 16
    assert any(start.rate == 0 for start in starts)
    assert find_starts(np.array([0.0, 1.0, 2.0]), np.ones(3, bool))


def test_first_kernels_have_the_events_of_an_edge() -> None:
    truth = kernels_of(8, 4)
    levels, counts = light(6, truth)
    start = Start(0.0, 0.0, (16.5 / PHASES, 22.5 / PHASES), (0.1, 0.1))
    kernels = first_kernels(start, counts.astype(np.float32), MEMORY - 1)
    assert kernels.edge.sum(axis=(1, 2)) == pytest.approx([8, 4], rel=0.3)
    assert np.argmax(kernels.edge[ON]) == 16
    half_idle = np.concatenate([counts, np.zeros_like(counts)]).astype(np.float32)
    again = first_kernels(start, half_idle, MEMORY - 1)
    assert again.edge.sum() == pytest.approx(kernels.edge.sum(), rel=0.1)
    assert levels.size == len(counts)


@pytest.mark.parametrize("late", [-0.2, 0.0, 0.15])
def test_the_clock_is_followed_where_it_drifts(late: float) -> None:
    truth = kernels_of(8, 5)
    levels, counts = light(7, truth, 400)
    chips, is_on = times_of(counts)
    drift = late + 0.2 * np.sin(np.pi * chips / levels.size)
    moved = count_events(chips + drift, is_on, 0, levels.size).astype(np.float32)
    rates = kernel_rates(truth, edge_contexts(MEMORY))
    middle, later = follow_clock(moved, rates, contexts_of(levels).astype(np.int32)).T
    assert middle.size == levels.size // FOLLOW_CHIPS
    expected = late + 0.2 * np.sin(np.pi * middle / levels.size)
    assert np.abs(later - expected).max() < 0.07
    quiet = follow_clock(np.zeros_like(moved), rates, contexts_of(levels).astype(np.int32))
    assert (quiet[:, 1] == 0).all()
