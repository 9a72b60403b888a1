"""The most likely path through the states of a line code, over one frame, and where frames begin."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import Floats
from bicode_lab.sequential.levels import MEMORY, Contexts
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_nodes
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
    contexts = np.empty(len(scores), np.int32)
    total: float = best_path(scores, *stages(line), contexts)
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
    n = line.frame_chips
    count = n if scores.shape[0] == n else max(scores.shape[0] - n - FIRST + 1, 0)
    sums = np.empty(count)
    _best_sums(scores, *stages(line), sums)
    return sums


@cache
def stages(line: LineCode) -> tuple[Contexts, npt.NDArray[np.int32], npt.NDArray[np.int64]]:
    """Return the nodes of a line code in the order of their places in the frame.

    Parameters
    ----------
    line : LineCode

    Returns
    -------
    context : ndarray of int32, shape (n,)
        Context of each node.
    before : ndarray of int32, shape (n, 4)
        Nodes that may come before each node, by their numbers in this order; -1 where there are fewer than four.
    bounds : ndarray of int64, shape (frame_chips + 1,)
        Number of the first node of each place, and the number of nodes.
    """
    nodes = build_nodes(line, MEMORY)
    order = np.argsort(nodes.place, kind="stable")
    number = np.empty(order.size + 1, np.int32)
    number[order], number[-1] = np.arange(order.size), -1
    bounds = np.searchsorted(nodes.place[order], np.arange(line.frame_chips + 1))
    return nodes.context[order], number[nodes.before[order]], bounds


@njit(cache=True, nogil=True)
def best_path(scores, context, before, bounds, contexts):  # type: ignore[no-untyped-def]
    """Fill in the contexts along the most likely path through the nodes of `stages`; return its sum."""
    n = bounds.size - 1
    came = np.empty((n, context.size), np.int32)
    sums = np.empty(context.size)
    place = FIRST
    for j in range(bounds[place], bounds[place + 1]):
        sums[j] = scores[0, context[j]]
    for k in range(1, n):
        place = (FIRST + k) % n
        for j in range(bounds[place], bounds[place + 1]):
            best, source = IMPOSSIBLE, -1
            for m in range(before.shape[1]):
                i = before[j, m]
                if i < 0:
                    break
                if sums[i] > best:
                    best, source = sums[i], i
            came[k, j] = source
            sums[j] = best + scores[k, context[j]]
    node = bounds[place]
    for j in range(bounds[place] + 1, bounds[place + 1]):
        if sums[j] > sums[node]:
            node = j
    total = sums[node]
    for k in range(n - 1, -1, -1):
        contexts[k] = context[node]
        node = came[k, node]
    return total


@njit(cache=True, nogil=True)
def _best_sums(scores, context, before, bounds, places):  # type: ignore[no-untyped-def]
    """Fill in the best path's sum for each chip that the frame may begin with."""
    n, n_rows = bounds.size - 1, scores.shape[0]
    sums = np.empty(context.size)
    for start in range(places.size):
        place = FIRST
        row = (start + FIRST) % n_rows
        for j in range(bounds[place], bounds[place + 1]):
            sums[j] = scores[row, context[j]]
        for k in range(1, n):
            place, row = (FIRST + k) % n, (start + FIRST + k) % n_rows
            for j in range(bounds[place], bounds[place + 1]):
                best = sums[before[j, 0]]
                for m in range(1, before.shape[1]):
                    i = before[j, m]
                    if i < 0:
                        break
                    best = max(best, sums[i])
                sums[j] = best + scores[row, context[j]]
        total = IMPOSSIBLE
        for j in range(bounds[place], bounds[place + 1]):
            total = max(total, sums[j])
        places[start] = total
