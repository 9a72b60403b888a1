"""The transmitter's clock, followed along a path that was found.

Once the rates and the path are known, each block of chips says how far its events lie from where they are expected. The
deviations, smoothed, correct the chip numbers of the events. So the clock is followed where it drifts, and a clock that
was found in the first chips only is corrected over all of them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import solveh_banded

from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.text.amounts import Amounts

Floats = npt.NDArray[np.float64]

FOLLOW_CHIPS = 256  # length of a block: some hundred edges
MOST_BINS = 8  # half a chip
STIFFNESS = 200.0  # of the line through the deviations: it bends over some four blocks


def follow_clock(amounts: Amounts, rates: Floats, context: npt.NDArray[np.int32]) -> Floats:
    """Measure how much later than expected the events of each block come.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    rates : ndarray, shape (contexts, PHASES, 2)
    context : ndarray of int32, shape (chips,)
        Context of each chip on the path.

    Returns
    -------
    ndarray, shape (blocks, 2)
        Middle of each block [chips from the first], and how much later its events come [chips]; one row or more.
    """
    n = len(amounts)
    bounds = np.linspace(0, n, max(1, n // FOLLOW_CHIPS) + 1).astype(np.int64)
    moves = range(-MOST_BINS, MOST_BINS + 1)
    scores = np.stack([np.diff(score_moved(amounts, np.log(rates), context, bins)[bounds]) for bins in moves])
    at = np.argmax(scores, axis=0)
    inside = (at > 0) & (at < 2 * MOST_BINS)
    block = np.arange(at.size)
    here = np.clip(at, 1, 2 * MOST_BINS - 1)
    before, middle, after = scores[here - 1, block], scores[here, block], scores[here + 1, block]
    weight = np.where(inside, np.maximum(2 * middle - before - after, 0), 0)
    later = np.where(weight > 0, at - MOST_BINS - 0.5 * (before - after) / np.where(weight > 0, weight, 1), 0)
    if weight.any():
        weight = np.minimum(weight, 2 * np.median(weight[weight > 0]))
        later = _smooth(later, weight)
    return np.stack([(bounds[:-1] + bounds[1:]) / 2, later / PHASES], axis=1)


def score_moved(amounts: Amounts, weights: Floats, context: npt.NDArray[np.int32], bins: int) -> Floats:
    """Score a path whose events are taken to come later than expected.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    weights : ndarray, shape (contexts, PHASES, 2)
        Score of an amount of 1 in each bin of each context: the logarithm of the rates.
    context : ndarray of int32, shape (chips,)
        Context of each chip on the path.
    bins : int
        How much later the events come; below 0, earlier.

    Returns
    -------
    ndarray, shape (chips + 1,)
        Sum of the scores of all chips before each chip.
    """
    flat = amounts.reshape(-1, 2)
    expected = weights.astype(np.float32)[context].reshape(-1, 2)
    low, high = max(0, bins), len(flat) + min(0, bins)
    each = np.zeros(len(flat))
    each[low:high] = (flat[low:high] * expected[low - bins : high - bins]).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(each.reshape(-1, PHASES).sum(axis=1))])


def _smooth(values: Floats, weight: Floats) -> Floats:
    """Draw a line through values that bends little: the least sum of squared deviations and of squared bends."""
    n = values.size
    if n < 3:
        return np.full(n, float((values * weight).sum() / weight.sum()))
    bend = STIFFNESS * float(weight.mean())
    bands = np.zeros((3, n))
    bands[2] = weight + 1e-9 * weight.max()
    for k, part in enumerate((1.0, -2.0, 1.0)):
        for j, other in enumerate((1.0, -2.0, 1.0)):
            if j >= k:
                bands[2 - (j - k), j : n - 2 + j] += bend * part * other
    return np.asarray(solveh_banded(bands, weight * values), np.float64)
