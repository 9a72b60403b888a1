"""The likeliest walk through a line code's states (Viterbi), and how sure each of its chips is.

A node's score is the log-likelihood of what was seen in a chip under the node's context;
the best walk has the largest sum. A chip's margin is how much the best walk loses when
that chip is forced to the other level: the sum of the walk's best halves on either side.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.soft_receiver.line_code import Nodes

Floats = npt.NDArray[np.float64]
IMPOSSIBLE = -1e300


def best_walk(scores: Floats, nodes: Nodes, first_place: int | None = None) -> tuple[npt.NDArray[np.int32], Floats]:
    """Log-likelihoods of each chip under each context in, shape (n, contexts); the best walk and margins out.

    Parameters
    ----------
    scores : ndarray, shape (n, contexts)
    nodes : Nodes
    first_place : int, optional
        Place in the frame of the first chip; None leaves it open.

    Returns
    -------
    walk : ndarray of int32, shape (n,)
        Node of each chip.
    margins : ndarray, shape (n,)
        Loss of forcing the chip to the other level; inf where the code allows no other.
    """
    ahead = np.full(nodes.context.size, 0.0)
    if first_place is not None:
        ahead[nodes.place != first_place] = IMPOSSIBLE
    forward = _forward(scores, nodes.context, nodes.before, ahead)
    backward = _backward(scores, nodes.context, nodes.before)
    walk = _trace(forward, nodes.before)
    both = forward + backward
    level = nodes.context & 1
    best_off = both[:, level == 0].max(axis=1, initial=IMPOSSIBLE)
    best_on = both[:, level == 1].max(axis=1, initial=IMPOSSIBLE)
    margins = np.abs(best_on - best_off)
    margins[margins > -IMPOSSIBLE / 2] = np.inf
    return walk, margins


@njit(cache=True)
def _forward(scores, context, before, ahead):  # type: ignore[no-untyped-def]
    """Best sum of a walk that ends in each node at each chip."""
    n, n_nodes = scores.shape[0], context.size
    sums = np.empty((n, n_nodes))
    for j in range(n_nodes):
        sums[0, j] = ahead[j] + scores[0, context[j]]
    for k in range(1, n):
        for j in range(n_nodes):
            best = IMPOSSIBLE
            for m in range(4):
                i = before[j, m]
                if i < 0:
                    break
                best = max(best, sums[k - 1, i])
            sums[k, j] = best + scores[k, context[j]]
    return sums


@njit(cache=True)
def _backward(scores, context, before):  # type: ignore[no-untyped-def]
    """Best sum of what comes behind each node at each chip."""
    n, n_nodes = scores.shape[0], context.size
    sums = np.zeros((n, n_nodes))
    for k in range(n - 2, -1, -1):
        for j in range(n_nodes):
            sums[k, j] = IMPOSSIBLE
        for j in range(n_nodes):
            behind = sums[k + 1, j] + scores[k + 1, context[j]]
            for m in range(4):
                i = before[j, m]
                if i < 0:
                    break
                sums[k, i] = max(sums[k, i], behind)
    return sums


@njit(cache=True)
def _trace(sums, before):  # type: ignore[no-untyped-def]
    """Sums of the best walks in, the best of all walks out."""
    n = sums.shape[0]
    walk = np.empty(n, np.int32)
    walk[n - 1] = np.argmax(sums[n - 1])
    for k in range(n - 1, 0, -1):
        best, who = -np.inf, 0
        for m in range(4):
            i = before[walk[k], m]
            if i < 0:
                break
            if sums[k - 1, i] > best:
                best, who = sums[k - 1, i], i
        walk[k - 1] = who
    return walk
