"""Where a frame begins in marks that are folded to the length of one frame.

The frame may begin at any bin of the fold: as many places as a frame has chips, times the bins of a chip. Each place
is scored by the most likely path of a frame that begins there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.soft_receiver.levels import PHASES, MarkCounts, log_likelihoods
from bicode_lab.soft_receiver.nodes import Nodes
from bicode_lab.soft_receiver.viterbi import IMPOSSIBLE

Floats = npt.NDArray[np.float64]
MEMORY = 3  # chips of a context; a path begins at chip MEMORY - 1 of the frame, the first whose context the start fixes


def roll_to_place(counts: MarkCounts, place: int) -> MarkCounts:
    """Roll folded counts so that they begin with chip number MEMORY - 1 of a frame.

    Parameters
    ----------
    counts : ndarray, shape (frame_chips, PHASES, 3)
        Folded counts, see `levels.count_marks`.
    place : int
        Bin of the fold at which the frame begins.

    Returns
    -------
    ndarray, shape (frame_chips, PHASES, 3)
    """
    flat = counts.reshape(-1, 3)
    return np.roll(flat, -place - (MEMORY - 1) * PHASES, axis=0).reshape(counts.shape)


def score_places(counts: MarkCounts, levels: Floats, nodes: Nodes) -> Floats:
    """Score every place at which a frame may begin.

    Parameters
    ----------
    counts : ndarray, shape (frame_chips, PHASES, 3)
        Folded counts, see `levels.count_marks`.
    levels : ndarray, shape (contexts, PHASES, 3)
        Probabilities of the marks, see `levels.guess_levels`.
    nodes : Nodes

    Returns
    -------
    ndarray, shape (frame_chips * PHASES,)
        Log-likelihood of the most likely path of a frame that begins at each bin.
    """
    n = counts.shape[0]
    flat = counts.reshape(-1, 3)
    rolled = np.stack([np.roll(flat, -phase, axis=0).reshape(counts.shape) for phase in range(PHASES)])
    scores = log_likelihoods(rolled.reshape(n * PHASES, PHASES, 3), levels).reshape(PHASES, n, -1)
    initial = np.where(nodes.place == MEMORY - 1, 0.0, IMPOSSIBLE)
    sums = _best_sums(scores, nodes.context, nodes.before, initial, nodes.place, MEMORY - 1)
    return np.asarray(sums, np.float64).T.ravel()


@njit(cache=True)
def _best_sums(scores, context, before, initial, places, first):  # type: ignore[no-untyped-def]
    """Return the best path's sum for each phase of the grid and each chip that the frame may begin with."""
    n_phases, n, _ = scores.shape
    n_nodes = context.size
    sums = np.empty((n_phases, n))
    order = np.argsort(places)
    bounds = np.searchsorted(places[order], np.arange(n + 1))
    old, new = np.empty(n_nodes), np.empty(n_nodes)
    for phase in range(n_phases):
        for start in range(n):
            row = (start + first) % n
            for j in range(n_nodes):
                old[j] = initial[j] + scores[phase, row, context[j]]
            place = first
            for k in range(1, n):
                row = (start + first + k) % n
                place = (place + 1) % n
                for at in range(bounds[place], bounds[place + 1]):
                    j = order[at]
                    best = IMPOSSIBLE
                    for m in range(4):
                        i = before[j, m]
                        if i < 0:
                            break
                        best = max(best, old[i])
                    new[j] = best + scores[phase, row, context[j]]
                old, new = new, old
            total = IMPOSSIBLE
            for at in range(bounds[place], bounds[place + 1]):
                total = max(total, old[order[at]])
            sums[phase, start] = total
    return sums
