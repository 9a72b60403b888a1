"""The most likely path through the states of a line code, over one frame, and where frames begin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import Floats
from bicode_lab.sequential.levels import MEMORY, Contexts
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import Nodes, build_nodes
from bicode_lab.soft_receiver.viterbi import IMPOSSIBLE

FIRST = MEMORY - 1  # a path begins at this chip of a frame, the first whose context the start fixes


def best_contexts(scores: Floats, line: LineCode) -> tuple[Contexts, float]:
    """Find the most likely path of one frame (Viterbi algorithm).

    Parameters
    ----------
    scores : ndarray, shape (frame_chips, contexts)
        Log-likelihood under each context of the chips from number `FIRST` of a frame on.
    line : LineCode

    Returns
    -------
    contexts : ndarray of int32, shape (frame_chips,)
        Context of each chip on the path.
    total : float
        Log-likelihood of the path.
    """
    nodes = build_nodes(line, MEMORY)
    contexts = np.empty(len(scores), np.int32)
    total: float = _best_path(scores, nodes.context, nodes.before, _initial(nodes), contexts)
    return contexts, total


def score_places(scores: Floats, line: LineCode) -> Floats:
    """Score every place at which a frame may begin.

    Parameters
    ----------
    scores : ndarray, shape (chips, contexts)
        Log-likelihood of each chip under each context. As many chips as a frame has are taken as a ring.
    line : LineCode

    Returns
    -------
    ndarray, shape (chips,) for a ring, else (chips - frame_chips - FIRST + 1,)
        Log-likelihood of the most likely path of a frame that begins at each chip, from its chip `FIRST` on, over as
        many chips as a frame has.
    """
    nodes, n = build_nodes(line, MEMORY), line.frame_chips
    count = n if scores.shape[0] == n else max(scores.shape[0] - n - FIRST + 1, 0)
    order = np.argsort(nodes.place, kind="stable")
    bounds = np.searchsorted(nodes.place[order], np.arange(n + 1))
    sums = np.empty(count)
    _best_sums(scores, nodes.context, nodes.before, _initial(nodes), order, bounds, n, sums)
    return sums


def _initial(nodes: Nodes) -> Floats:
    """Return the log-probability that a path begins in each node: at chip `FIRST` of a frame."""
    initial: npt.NDArray[np.float64] = np.where(nodes.place == FIRST, 0.0, IMPOSSIBLE)
    return initial


@njit(cache=True, nogil=True)
def _best_path(scores, context, before, initial, contexts):  # type: ignore[no-untyped-def]
    """Fill in the contexts along the most likely path; return its sum."""
    n, n_nodes = scores.shape[0], context.size
    came = np.full((n, n_nodes), -1, np.int32)
    old, new = np.empty(n_nodes), np.empty(n_nodes)
    for j in range(n_nodes):
        old[j] = initial[j] + scores[0, context[j]]
    for k in range(1, n):
        for j in range(n_nodes):
            best, source = IMPOSSIBLE, -1
            for m in range(before.shape[1]):
                i = before[j, m]
                if i < 0:
                    break
                if old[i] > best:
                    best, source = old[i], i
            came[k, j] = source
            new[j] = best + scores[k, context[j]]
        old, new = new, old
    node = int(np.argmax(old))
    total = old[node]
    for k in range(n - 1, -1, -1):
        contexts[k] = context[node]
        node = came[k, node]
    return total


@njit(cache=True, nogil=True)
def _best_sums(scores, context, before, initial, order, bounds, n_chips, sums):  # type: ignore[no-untyped-def]
    """Fill in the best path's sum for each chip that the frame may begin with."""
    n = scores.shape[0]
    old, new = np.empty(context.size), np.empty(context.size)
    for start in range(sums.size):
        place = FIRST
        row = (start + place) % n
        for j in range(context.size):
            old[j] = initial[j] + scores[row, context[j]]
        for k in range(1, n_chips):
            row = (start + FIRST + k) % n
            place = (place + 1) % n_chips
            for at in range(bounds[place], bounds[place + 1]):
                j = order[at]
                best = IMPOSSIBLE
                for m in range(before.shape[1]):
                    i = before[j, m]
                    if i < 0:
                        break
                    best = max(best, old[i])
                new[j] = best + scores[row, context[j]]
            old, new = new, old
        total = IMPOSSIBLE
        for at in range(bounds[place], bounds[place + 1]):
            total = max(total, old[order[at]])
        sums[start] = total
