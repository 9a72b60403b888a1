"""Learn the levels of frames along their most likely paths (Viterbi training)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import Floats, Folded
from bicode_lab.sequential.levels import Contexts, chip_scores, disperse, estimate, score
from bicode_lab.sequential.paths import best_contexts, best_path, stages
from bicode_lab.soft_receiver.line_code import LineCode

ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Learned:
    """Levels that were learned from frames.

    Parameters
    ----------
    frames : Folded
        The frames one after the other, each from its chip `paths.FIRST` on.
    guess, levels : ndarray, shape (2**MEMORY, 2, PHASES)
        Levels before and after learning.
    contexts : ndarray of int32, shape (chips,)
        Most likely path through all frames.
    dispersion : ndarray, shape (2,)
        Along this path.
    total : float
        Log-likelihood of the path, without the dispersion [nat].
    """

    frames: Folded
    guess: Floats
    levels: Floats
    contexts: Contexts
    dispersion: Floats
    total: float

    def path(self, number: int, line: LineCode) -> tuple[Contexts, float]:
        """Find the most likely path of one frame.

        Parameters
        ----------
        number : int
            Number of the frame, 0 or more.
        line : LineCode

        Returns
        -------
        contexts : ndarray of int32, shape (frame_chips,)
        total : float
            Log-likelihood, divided by the dispersion [nat].
        """
        frame = self.frames.part(number * line.frame_chips, line.frame_chips)
        return best_contexts(chip_scores(frame, self.levels, self.dispersion), line)


def learn(frames: Folded, guess: Floats, line: LineCode) -> Learned:
    """Find the most likely path and estimate the levels along it, in turn (Viterbi training).

    Parameters
    ----------
    frames : Folded
        Frames one after the other, each from its chip `paths.FIRST` on.
    guess : ndarray, shape (2**MEMORY, 2, PHASES)
    line : LineCode

    Returns
    -------
    Learned
    """
    levels, dispersion = np.empty_like(guess), np.empty(2)
    contexts = np.empty(frames.sums.shape[0], np.int32)
    total: float = _learn(
        frames.sums, frames.squares, frames.exposure, guess, *stages(line), contexts, levels, dispersion
    )
    return Learned(frames, guess, levels, contexts, dispersion, total)


@njit(cache=True, nogil=True)
def _learn(sums, squares, exposure, guess, context, before, bounds, contexts, levels, dispersion):  # type: ignore[no-untyped-def]
    """Fill in path, levels and dispersion of frames; return the log-likelihood of the path."""
    n = bounds.size - 1
    scores = np.empty((contexts.size, guess.shape[0]))
    levels[:] = guess
    dispersion[:] = 1.0
    for learning in range(ROUNDS + 1):
        is_last = learning == ROUNDS
        score(sums, exposure, levels, np.ones(2) if is_last else 1 / dispersion, scores)
        total = 0.0
        for k in range(0, contexts.size, n):
            total += best_path(scores[k : k + n], context, before, bounds, contexts[k : k + n])
        disperse(sums, squares, exposure, levels, contexts, dispersion)
        if not is_last:
            estimate(sums, exposure, contexts, guess, dispersion, levels)
    return total
