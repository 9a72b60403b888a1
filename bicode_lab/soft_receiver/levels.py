"""How likely each mark is in each part of a chip: learned from the data, without knowing what was sent.

A chip is divided into `PHASES` bins, and each bin holds an ON mark, an OFF mark or none. How probable each of the
three is depends on the *context* of the chip, which is the last few levels of the LED: after a rise there are ON marks,
early or late, in a burst or with a tail; after a fall there are OFF marks; while the level stays there are few. These
probabilities are what this package calls the levels (in the terms of hidden Markov models: the emission
probabilities).

They begin as a simple guess: marks of the polarity of an edge come somewhere in its chip. Then they are estimated
along the most likely path, several times (Viterbi training). So they include latency, jitter, the difference between
ON and OFF, tails that reach into the next chip, and noise. Where there are few chips, the guess keeps its weight.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.clock import Marks
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.viterbi import best_path

Floats = npt.NDArray[np.float64]
MarkCounts = npt.NDArray[np.float64]
"""How often each bin of each chip held no mark, an ON mark, an OFF mark; shape (chips, PHASES, 3)."""

PHASES = 16
FIRST_MEMORY = 2
NO_MARK, ON, OFF = 0, 1, 2
EDGE_FRACTION = 0.3  # of the chips begin with a rise, as many with a fall: between UART's 0.22 and Manchester's 0.36
STRAY = 0.005  # guess: how often a mark comes without an edge of its polarity, relative to marks with such an edge
LATE = 0.05  # guess: the same if the chip before had such an edge and the level has stayed since
GUESS_CHIPS = 24.0  # the guess has the weight of this many chips of each context


def count_marks(marks: Marks, chips: Floats, first: int, n_chips: int, *, fold_chips: int | None = None) -> MarkCounts:
    """Count the marks in each bin of each chip.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        See `clock.lead_marks`.
    chips : ndarray, shape (n,)
        Chip number of each mark, see `clock.find_chips`.
    first, n_chips : int
        Number of the first chip and how many chips are wanted.
    fold_chips : int, optional
        If given, chips whose numbers differ by a multiple of it are added up; `n_chips` must be equal to it.

    Returns
    -------
    ndarray, shape (n_chips, PHASES, 3)
        Number of bins with no mark, with an ON mark and with an OFF mark.

    Examples
    --------
    >>> counts = count_marks(np.array([1, 0, -1], np.int8), np.array([0.5, 1.5, 3.5]), 0, 2, fold_chips=2)
    >>> counts[0, 8].tolist(), counts[1, 8].tolist()
    ([0.0, 1.0, 0.0], [1.0, 0.0, 1.0])
    """
    place = np.floor((chips - first) * PHASES).astype(np.int64)
    if fold_chips is not None:
        place %= fold_chips * PHASES
    inside = (place >= 0) & (place < n_chips * PHASES)
    said = place[inside] * 3 + marks[inside] % 3  # -1 -> 2
    return np.bincount(said, minlength=n_chips * PHASES * 3).reshape(n_chips, PHASES, 3).astype(np.float64)


def guess_levels(counts: MarkCounts, memory: int) -> Floats:
    """Make a first guess of the levels.

    Only the mean numbers of ON marks and of OFF marks per chip are taken from the data.

    Parameters
    ----------
    counts : ndarray, shape (chips, PHASES, 3)
        See `count_marks`.
    memory : int
        Number of chips in a context.

    Returns
    -------
    ndarray, shape (2**memory, PHASES, 3)
        Probabilities 0 .. 1, which add up to 1 over the last axis.
    """
    levels = np.empty((1 << memory, PHASES, 3))
    n_bins = max(float(counts.sum()), 1.0)
    bump = np.hanning(PHASES + 2)[1:-1] + 0.1
    bump *= PHASES / bump.sum()
    for side in (ON, OFF):
        rate = (float(counts[..., side].sum()) + 0.5) / n_bins / EDGE_FRACTION
        for context in range(1 << memory):
            new = 1 if side == ON else 0
            before, last, now = (int((context >> back & 1) == new) for back in (2, 1, 0))
            is_late = memory > FIRST_MEMORY and not before and last and now
            shape = bump if not last and now else LATE if is_late else STRAY
            levels[context, :, side] = np.minimum(rate * shape, 0.45)
    levels[..., NO_MARK] = 1 - levels[..., ON] - levels[..., OFF]
    return levels


def log_likelihoods(counts: MarkCounts, levels: Floats) -> Floats:
    """Compute the log-likelihood of each chip under each context.

    Parameters
    ----------
    counts : ndarray, shape (chips, PHASES, 3)
        See `count_marks`.
    levels : ndarray, shape (contexts, PHASES, 3)
        Probabilities above 0.

    Returns
    -------
    ndarray, shape (chips, contexts)
    """
    flat: Floats = counts.reshape(counts.shape[0], -1) @ np.log(levels).reshape(levels.shape[0], -1).T
    return flat


def estimate_levels(counts: MarkCounts, context: npt.NDArray[np.int32], guess: Floats) -> Floats:
    """Estimate the levels along a path.

    Parameters
    ----------
    counts : ndarray, shape (chips, PHASES, 3)
        See `count_marks`.
    context : ndarray of int32, shape (chips,)
        Context of each chip on the path.
    guess : ndarray, shape (contexts, PHASES, 3)
        First guess, which counts like `GUESS_CHIPS` chips of each context.

    Returns
    -------
    ndarray, shape (contexts, PHASES, 3)
        Probabilities 0 .. 1, which add up to 1 over the last axis.
    """
    total = guess * GUESS_CHIPS
    np.add.at(total, context, counts)
    levels: Floats = total / total.sum(axis=2, keepdims=True)
    return levels


def learn_levels(counts: MarkCounts, line: LineCode, memory: int, n_rounds: int, *, checked: bool = False) -> Floats:
    """Learn the levels: find the most likely path and estimate the levels along it, in turn.

    The contexts begin with two chips, which is one edge, and grow by one chip after `n_rounds` rounds each. With large
    contexts from the start, the levels can learn to take one character for another.

    Parameters
    ----------
    counts : ndarray, shape (chips, PHASES, 3)
        See `count_marks`.
    line : LineCode
    memory : int
        Number of chips in a context at the end.
    n_rounds : int
        Rounds for each size of the contexts.
    checked : bool
        Whether the path may only contain frames that pass the check of the code.

    Returns
    -------
    ndarray, shape (2**memory, PHASES, 3)
        Probabilities 0 .. 1, which add up to 1 over the last axis.
    """
    guess = guess_levels(counts, FIRST_MEMORY)
    levels = guess
    for size in range(FIRST_MEMORY, memory + 1):
        if size > FIRST_MEMORY:  # the added chip makes no difference yet
            guess, levels = guess_levels(counts, size), np.concatenate([levels, levels])
        nodes = build_nodes(line, size, checked)
        for _ in range(n_rounds):
            path, _ = best_path(log_likelihoods(counts, levels), nodes)
            levels = estimate_levels(counts, nodes.context[path], guess)
    return levels
