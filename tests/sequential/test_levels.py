"""Levels and their dispersion, against plain loops."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.sequential.fold import OFF, ON, PHASES, Folded
from bicode_lab.sequential.levels import (
    GUESS_CHIPS,
    GUESS_EVENTS,
    MEMORY,
    TAILS,
    chip_scores,
    estimate_levels,
    find_dispersion,
    guess_levels,
)
from bicode_lab.sequential.rivals import noise_score

N = 60


def counted(seed: int, levels: np.ndarray | None = None, times: int = 5, burst: int = 1):
    """Return Poisson counts of random chips, each seen `times` times, in bursts of `burst` events, and the contexts."""
    rng = np.random.default_rng(seed)
    contexts = rng.integers(0, 1 << MEMORY, N).astype(np.int32)
    mean = rng.uniform(0.1, 2, (1 << MEMORY, 2, PHASES)) if levels is None else levels
    each = burst * rng.poisson(mean[contexts][None] / burst, (times, N, 2, PHASES)).astype(float)
    exposure = np.full((N, 2, PHASES), float(times))
    return Folded(each.sum(axis=0), (each**2).sum(axis=0), exposure), contexts, mean, each


def test_levels_are_means_along_the_path_with_the_weight_of_the_guess() -> None:
    counts, contexts, guess, _ = counted(0)
    dispersion = np.array([1.5, 4.0])
    levels = estimate_levels(counts, contexts, guess, dispersion)
    for context in range(1 << MEMORY):
        for side in (ON, OFF):
            edge = np.mean([max(guess[c, side, phase] for c in range(1 << MEMORY)) for phase in range(PHASES)])
            weight = min(GUESS_EVENTS * dispersion[side] / edge, GUESS_CHIPS)
            for phase in range(PHASES):
                total, seen = guess[context, side, phase] * weight, weight
                for chip in np.flatnonzero(contexts == context):
                    total += counts.sums[chip, side, phase]
                    seen += counts.exposure[chip, side, phase]
                assert levels[context, side, phase] == pytest.approx(total / seen)


def test_dispersion_is_the_variance_over_the_mean() -> None:
    counts, contexts, levels, each = counted(1, burst=3)
    expected = []
    for side in (ON, OFF):
        misfit = total = 0.0
        for k in range(N):
            for phase in range(PHASES):
                mean = levels[contexts[k], side, phase]
                misfit += sum((each[i, k, side, phase] - mean) ** 2 for i in range(len(each)))
                total += mean * len(each)
        expected.append(max(1.0, misfit / total))
    assert find_dispersion(counts, levels, contexts) == pytest.approx(np.array(expected))


def test_dispersion_of_bursts_is_their_size() -> None:
    """There are 400 x 60 x 8 bins, so that a variance is known to about 2 %."""
    for burst in (1, 2, 5):
        counts, contexts, levels, _ = counted(2, times=400, burst=burst)
        assert find_dispersion(counts, levels, contexts) == pytest.approx(np.full(2, burst), rel=0.05)
    none = Folded(*np.zeros((3, N, 2, PHASES)))
    assert find_dispersion(none, levels, contexts).tolist() == [1, 1]


@pytest.mark.parametrize("side", [None, ON, OFF])
def test_scores_are_poisson_log_likelihoods_over_the_dispersion(side: int | None) -> None:
    counts, _, levels, _ = counted(3)
    dispersion = np.array([1.5, 4.0])
    expected = np.zeros((N, 1 << MEMORY))
    for k in range(N):
        for context in range(1 << MEMORY):
            for one in (ON, OFF) if side is None else (side,):
                mean = levels[context, one]
                terms = counts.sums[k, one] * np.log(mean) - counts.exposure[k, one] * mean
                expected[k, context] += terms.sum() / dispersion[one]
    assert chip_scores(counts, levels, dispersion, side) == pytest.approx(expected)


def test_noise_is_the_score_of_equal_levels() -> None:
    counts, _, _, _ = counted(4)
    rate = counts.mean_rate()
    equal = np.ones((1 << MEMORY, 2, PHASES)) * rate[None, :, None]
    dispersion = np.array([1.5, 4.0])
    assert noise_score(counts, dispersion) == pytest.approx(chip_scores(counts, equal, dispersion)[:, 0].sum())


@pytest.mark.parametrize("tail", TAILS)
def test_the_guess_has_the_pulse_at_the_edges_of_its_polarity(tail: float) -> None:
    """ON events come at rises, contexts 001 and 101; OFF events at falls, 110 and 010; the tail comes a chip later."""
    sums = np.zeros((28, 2, PHASES))
    sums[:, ON, 2] = 36.0
    sums[:, OFF, 5] = 18.0
    guess = guess_levels(Folded(sums, sums**2, np.full((28, 2, PHASES), 10.0)), tail)
    assert (guess > 0).all()
    total = guess.sum(axis=2)
    for side, edges, late, still in ((ON, (0b001, 0b101), (0b011,), (0, 2, 4, 6, 7)),
                                     (OFF, (0b110, 0b010), (0b100,), (0, 1, 3, 5, 7))):  # fmt: skip
        assert total[list(edges), side] == pytest.approx(total[edges[0], side])
        assert total[list(late), side] == pytest.approx(tail * total[edges[0], side], rel=0.3)
        assert total[list(still), side].max() < 0.02 * total[edges[0], side]
        assert guess[edges[0], side].argmax() == (2 if side == ON else 5)
    # 36 % of the chips have an edge, a tail follows 40 % of these, and all edges together make all events.
    assert 0.36 * total[1, ON] * (1 + 0.4 * tail) == pytest.approx(3.6, rel=0.1)
    assert 0.36 * total[6, OFF] * (1 + 0.4 * tail) == pytest.approx(1.8, rel=0.1)
