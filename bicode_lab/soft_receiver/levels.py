"""What a chip looks like, learned from the data.   marks, chips -> log-likelihoods -> better levels

A chip is cut into `PHASES` bins, and each bin says ON, OFF or nothing. How often it says what
depends on the last levels of the LED, the chip's *context*: behind a rise come ON marks, sooner or
later, in a burst or with a tail; behind a fall OFF marks; behind a steady level little. These shares are
the levels. They begin as a plain guess (marks of an edge's polarity come somewhere in its chip) and
are then counted along the likeliest walk, again and again: latency, jitter, the
difference of ON and OFF, tails that reach into the next chip and noise are all in them.
No truth is needed. Where there are few chips, the guess keeps its weight.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.clock import Marks
from bicode_lab.soft_receiver.line_code import LineCode, nodes_of
from bicode_lab.soft_receiver.viterbi import best_walk

Floats = npt.NDArray[np.float64]
Tally = npt.NDArray[np.float64]
"""How often each bin of each chip said nothing, ON, OFF; shape (chips, PHASES, 3)."""

PHASES = 16
FIRST_MEMORY = 2
NOTHING, ON, OFF = 0, 1, 2
EDGE_SHARE = 0.3  # of chips begin with a rise, as many with a fall: between UART's 0.22 and Manchester's 0.36
STRAY = 0.005  # guess: a mark that no edge of its chip explains, over one that one does
LATE = 0.05  # guess: the same where the chip before had such an edge and the level has held since
GUESS_CHIPS = 24.0  # the guess counts like so many chips of each context


def tally(marks: Marks, chips: Floats, first: int, n_chips: int, *, period: int | None = None) -> Tally:
    """Marks and the chip number of each in; how often each bin of each chip said what out.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        See `clock.lead_marks`.
    chips : ndarray, shape (n,)
        See `clock.find_chips`.
    first, n_chips : int
        The chips wanted.
    period : int, optional
        Fold: chips that are so far apart are one, `n_chips` of it are given.

    Returns
    -------
    ndarray, shape (n_chips, PHASES, 3)

    Examples
    --------
    >>> t = tally(np.array([1, 0, -1], np.int8), np.array([0.5, 1.5, 3.5]), 0, 2, period=2)
    >>> t[0, 8].tolist(), t[1, 8].tolist()
    ([0.0, 1.0, 0.0], [1.0, 0.0, 1.0])
    """
    place = np.floor((chips - first) * PHASES).astype(np.int64)
    if period is not None:
        place %= period * PHASES
    inside = (place >= 0) & (place < n_chips * PHASES)
    said = place[inside] * 3 + marks[inside] % 3  # -1 -> 2
    return np.bincount(said, minlength=n_chips * PHASES * 3).reshape(n_chips, PHASES, 3).astype(np.float64)


def guess_levels(counts: Tally, memory: int) -> Floats:
    """A tally in, a first guess of the levels out, shape (contexts, PHASES, 3): shares that add up to 1.

    Only the mean number of ON and of OFF marks a chip are taken from the data.
    """
    shares = np.empty((1 << memory, PHASES, 3))
    seen = max(float(counts.sum()), 1.0)
    bump = np.hanning(PHASES + 2)[1:-1] + 0.1
    bump *= PHASES / bump.sum()
    for side in (ON, OFF):
        rate = (float(counts[..., side].sum()) + 0.5) / seen / EDGE_SHARE
        for context in range(1 << memory):
            new = 1 if side == ON else 0
            before, last, now = (int((context >> back & 1) == new) for back in (2, 1, 0))
            is_late = memory > FIRST_MEMORY and not before and last and now
            share = bump if not last and now else LATE if is_late else STRAY
            shares[context, :, side] = np.minimum(rate * share, 0.45)
    shares[..., NOTHING] = 1 - shares[..., ON] - shares[..., OFF]
    return shares


def scores_of(counts: Tally, shares: Floats) -> Floats:
    """A tally and levels in, the log-likelihood of each chip under each context out, shape (chips, contexts)."""
    flat: Floats = counts.reshape(counts.shape[0], -1) @ np.log(shares).reshape(shares.shape[0], -1).T
    return flat


def count_levels(counts: Tally, context: npt.NDArray[np.int32], guess: Floats) -> Floats:
    """A tally, each chip's context and the guess in, the levels counted along it out, shape (contexts, PHASES, 3)."""
    total = guess * GUESS_CHIPS
    np.add.at(total, context, counts)
    shares: Floats = total / total.sum(axis=2, keepdims=True)
    return shares


def learn_levels(counts: Tally, line: LineCode, memory: int, n_rounds: int, *, checked: bool = False) -> Floats:
    """A tally in, levels of `memory` chips learned in rounds of walking and counting out.

    Begins with a memory of two chips, an edge, and gives it one more when those are learned: with many
    contexts from the start, the levels can learn to call one letter another.
    """
    guess = guess_levels(counts, FIRST_MEMORY)
    shares = guess
    for size in range(FIRST_MEMORY, memory + 1):
        if size > FIRST_MEMORY:  # what comes before makes no difference yet
            guess, shares = guess_levels(counts, size), np.concatenate([shares, shares])
        nodes = nodes_of(line, size, checked)
        for _ in range(n_rounds):
            walk, _ = best_walk(scores_of(counts, shares), nodes)
            shares = count_levels(counts, nodes.context[walk], guess)
    return shares
