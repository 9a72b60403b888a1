"""What an edge makes: counted, weighed and learned."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.line_code import UartLine
from bicode_lab.soft_receiver.nodes import build_free_nodes, build_nodes
from bicode_lab.soft_receiver.text.amounts import OFF, ON, count_events, usual_count, weigh
from bicode_lab.soft_receiver.text.edge_rates import (
    Kernels,
    dispersion_of,
    edge_contexts,
    kernel_rates,
    learn_rates,
    rate_scores,
)

MEMORY = 4


def kernels_of(on: float, off: float, *, on_bin: int = 14, off_bin: int = 20, background: float = 0.01) -> Kernels:
    """Return kernels of five bins each."""
    edge = np.full((2, (MEMORY - 1) * PHASES), 1e-6)
    edge[ON, on_bin : on_bin + 5] = on / 5
    edge[OFF, off_bin : off_bin + 5] = off / 5
    return Kernels(edge.reshape(2, MEMORY - 1, PHASES), np.full(2, background))


def contexts_of(levels: np.ndarray) -> np.ndarray:
    """Return the context of each chip; the light is on before the first."""
    n = levels.size
    return sum(np.concatenate([np.ones(back, int), levels[: n - back]]) << back for back in range(MEMORY))


def light(seed: int, truth: Kernels, n_letters: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Return levels of random letters and Poisson counts of them."""
    rng = np.random.default_rng(seed)
    line = UartLine(rate_hz=1000)
    levels = np.concatenate([line.encode(int(v)) for v in rng.integers(0, 128, n_letters)]).astype(int)
    return levels, rng.poisson(kernel_rates(truth, edge_contexts(MEMORY))[contexts_of(levels)])


def test_every_event_is_counted_once_in_its_bin() -> None:
    rng = np.random.default_rng(0)
    chips, is_on = rng.uniform(-2, 30, 4000), rng.random(4000) < 0.4
    counts = count_events(chips, is_on, 3, 20)
    inside = (chips >= 3) & (chips < 23)
    assert counts.sum() == inside.sum()
    assert counts[..., ON].sum() == (inside & is_on).sum()
    k = int(np.flatnonzero(inside)[0])
    assert counts[int(chips[k]) - 3, int(chips[k] % 1 * PHASES), OFF if not is_on[k] else ON] >= 1


def test_a_stray_event_is_a_small_part_of_a_mark_beside_strong_edges_and_a_whole_one_beside_faint_ones() -> None:
    counts = np.zeros((1200, PHASES, 2), int)
    counts[::2, 3, ON], counts[1::2, 3, OFF], counts[5, 9, ON] = 40, 30, 1
    marks = weigh(counts, "marks")
    assert marks[5, 9, ON] == pytest.approx(1 / 20)
    assert (marks[::2, 3, ON] == 1).all()
    assert weigh(np.minimum(counts, 1), "marks")[5, 9, ON] == 1
    assert (weigh(counts, "events") == counts).all()
    counts[7, 9, ON] = 5000
    assert weigh(counts, "events")[7, 9, ON] < 200  # a flash is no more than some edges
    assert usual_count(counts[:40]) == 5000
    assert usual_count(counts) == 40


def test_scores_are_the_poisson_log_likelihood_over_the_dispersion() -> None:
    rng = np.random.default_rng(1)
    amounts = rng.poisson(0.3, (7, PHASES, 2)).astype(np.float32)
    rates, spread = rng.uniform(0.01, 2, (8, PHASES, 2)), np.array([1.5, 4.0])
    expected = [[((a * np.log(r) - r) / spread).sum() for r in rates] for a in amounts]
    assert rate_scores(amounts, rates, spread) == pytest.approx(np.array(expected), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize(("on", "off", "off_bin"), [(6.0, 3.0, 20), (3.0, 8.0, 6), (30.0, 20.0, 30)])
def test_kernels_and_text_are_learned_from_a_wide_guess(on: float, off: float, off_bin: int) -> None:
    truth = kernels_of(on, off, off_bin=off_bin)
    levels, counts = light(2, truth)
    at = (np.arange((MEMORY - 1) * PHASES) + 0.5) / PHASES
    shapes = [np.exp(-0.5 * ((at - middle / PHASES) / 0.3) ** 2) for middle in (16.5, off_bin + 2.5)]
    guess = Kernels(np.stack([s / s.sum() * 5 for s in shapes]).reshape(2, MEMORY - 1, PHASES), np.full(2, 0.02))
    nodes = build_nodes(UartLine(rate_hz=1000), MEMORY, True)
    found = learn_rates(counts.astype(np.float32), nodes, MEMORY, guess, rounds=(3, 2))
    assert np.mean((nodes.context[found.path] & 1) == levels) > 0.985
    assert found.kernels.edge.sum(axis=(1, 2)) == pytest.approx([on, off], rel=0.1)
    assert found.kernels.edge[OFF].ravel()[off_bin : off_bin + 5].sum() > 0.9 * off
    assert found.kernels.background == pytest.approx([0.01, 0.01], abs=0.006)
    assert found.dispersion == pytest.approx([1, 1], abs=0.25)
    assert found.gain > 100 * on


def test_more_variance_than_poisson_is_dispersion() -> None:
    rng = np.random.default_rng(3)
    expected = np.full((4000, PHASES, 2), 0.5)
    assert dispersion_of(rng.poisson(expected), expected) == pytest.approx([1, 1], abs=0.2)
    assert dispersion_of(7 * rng.poisson(expected / 7), expected) == pytest.approx([7, 7], rel=0.15)
    whole = np.zeros_like(expected)  # ten events that come together, in one of the bins
    whole[np.arange(4000), rng.integers(0, PHASES, 4000)] = 10
    together = dispersion_of(whole, np.full_like(expected, 10 / PHASES))
    assert (together > 8).all()
    wide = np.repeat(20.0 * rng.integers(0, 2, (4000, 1, 2)), PHASES, axis=1) / PHASES  # varies as a whole
    assert (dispersion_of(wide, np.full_like(wide, wide.mean())) > 8).all()


def test_free_nodes_allow_every_level_after_every_other() -> None:
    nodes = build_free_nodes(3)
    for c in range(8):
        ahead = {int(b) for b in nodes.before[c] if b >= 0}
        assert ahead == {b for b in range(8) if (b << 1 & 7) == (c & 6)}
