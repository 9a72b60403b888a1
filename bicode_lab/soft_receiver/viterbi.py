"""The most likely path through the states of a line code (Viterbi algorithm), and how sure each of its chips is.

Each node has a score in each chip: the log-likelihood of the marks of that chip under the context of the node. The
best path has the largest sum of scores. The margin of a chip is the difference between the best path and the best of
those that have the other LED level in that chip.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.soft_receiver.nodes import Nodes

Floats = npt.NDArray[np.float64]
IMPOSSIBLE = -1e300
BLOCK_CHIPS = 16_384  # the sums of one block of a few hundred nodes take some 40 MB
OVERLAP_CHIPS = 256  # paths of all ends have met within some frames


def best_path(scores: Floats, nodes: Nodes, first_place: int | None = None) -> tuple[npt.NDArray[np.int32], Floats]:
    """Find the most likely path and the margin of each of its chips.

    Parameters
    ----------
    scores : ndarray, shape (n, contexts)
        Log-likelihood of each chip under each context.
    nodes : Nodes
        The nodes of the line code, see `nodes.build_nodes`.
    first_place : int, optional
        Place in the frame of the first chip; None allows every place.

    Returns
    -------
    path : ndarray of int32, shape (n,)
        Node of each chip.
    margins : ndarray, shape (n,)
        Log-likelihood that is lost if the chip has the other level, 0 or more; inf if the code allows no other level.
    """
    initial = np.full(nodes.context.size, 0.0)
    if first_place is not None:
        initial[nodes.place != first_place] = IMPOSSIBLE
    forward = _forward(scores, nodes.context, nodes.before, initial)
    backward = _backward(scores, nodes.context, nodes.before)
    path = _trace(forward, nodes.before)
    both = forward + backward
    level = nodes.context & 1
    best_off = both[:, level == 0].max(axis=1, initial=IMPOSSIBLE)
    best_on = both[:, level == 1].max(axis=1, initial=IMPOSSIBLE)
    margins = np.abs(best_on - best_off)
    margins[margins > -IMPOSSIBLE / 2] = np.inf
    return path, margins


def likeliest_path(scores: Floats, nodes: Nodes) -> npt.NDArray[np.int32]:
    """Find the most likely path, block by block, without its margins.

    Parameters
    ----------
    scores : ndarray, shape (n, contexts)
        Log-likelihood of each chip under each context.
    nodes : Nodes
        The nodes of the line code, see `nodes.build_nodes`.

    Returns
    -------
    ndarray of int32, shape (n,)
        Node of each chip.
    """
    path = np.empty(len(scores), np.int32)
    for begin, end, low, high in _blocks(len(scores)):
        forward = _forward(scores[low:high], nodes.context, nodes.before, np.zeros(nodes.context.size))
        path[begin:end] = _trace(forward, nodes.before)[begin - low : end - low]
    return path


def likeliest_path_with_margins(scores: Floats, nodes: Nodes) -> tuple[npt.NDArray[np.int32], Floats]:
    """Find the most likely path and the margins of its chips as `best_path` does, block by block.

    Parameters
    ----------
    scores : ndarray, shape (n, contexts)
        Log-likelihood of each chip under each context.
    nodes : Nodes
        The nodes of the line code, see `nodes.build_nodes`.

    Returns
    -------
    path : ndarray of int32, shape (n,)
    margins : ndarray, shape (n,)
    """
    path, margins = np.empty(len(scores), np.int32), np.empty(len(scores))
    for begin, end, low, high in _blocks(len(scores)):
        part, part_margins = best_path(scores[low:high], nodes)
        path[begin:end], margins[begin:end] = part[begin - low : end - low], part_margins[begin - low : end - low]
    return path, margins


def _blocks(n: int) -> list[tuple[int, int, int, int]]:
    """List the blocks of `BLOCK_CHIPS`: begin and end, and the same with the overlap on both sides."""
    begins = range(0, n, BLOCK_CHIPS)
    ends = [min(begin + BLOCK_CHIPS, n) for begin in begins]
    return [(b, e, max(b - OVERLAP_CHIPS, 0), min(e + OVERLAP_CHIPS, n)) for b, e in zip(begins, ends, strict=True)]


def path_score(scores: Floats, context: npt.NDArray[np.int32]) -> float:
    """Return the sum of the scores along a path.

    Parameters
    ----------
    scores : ndarray, shape (n, contexts)
        Log-likelihood of each chip under each context.
    context : ndarray of int32, shape (n,)
        Context of each chip on the path.

    Returns
    -------
    float

    Examples
    --------
    >>> path_score(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([1, 0], np.int32))
    5.0
    """
    return float(scores[np.arange(context.size), context].sum())


@njit(cache=True)
def _forward(scores, context, before, initial):  # type: ignore[no-untyped-def]
    """Return the best sum of a path that ends in each node at each chip."""
    n, n_nodes = scores.shape[0], context.size
    sums = np.empty((n, n_nodes))
    for j in range(n_nodes):
        sums[0, j] = initial[j] + scores[0, context[j]]
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
    """Return the best sum of what can follow each node at each chip."""
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
    """Follow the best path back from its last node."""
    n = sums.shape[0]
    path = np.empty(n, np.int32)
    path[n - 1] = np.argmax(sums[n - 1])
    for k in range(n - 1, 0, -1):
        best, node = -np.inf, 0
        for m in range(4):
            i = before[path[k], m]
            if i < 0:
                break
            if sums[k - 1, i] > best:
                best, node = sums[k - 1, i], i
        path[k - 1] = node
    return path
