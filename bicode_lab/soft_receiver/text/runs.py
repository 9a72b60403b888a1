"""Find the phase of each run of letters, where a light rests between them for any time, not for whole chips.

A run ends where the light rests for a frame or more. All runs are read with the chips moved by quarters of a chip,
and a run is moved if this makes its likeliest path likelier by more than chance would. Frames that were found are then
moved by a few bins, those that follow each other without a pause nearly alike.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.nodes import Nodes
from bicode_lab.soft_receiver.text.amounts import Amounts
from bicode_lab.soft_receiver.text.clock import score_moved
from bicode_lab.soft_receiver.text.edge_rates import Learned, rate_scores
from bicode_lab.soft_receiver.viterbi import likeliest_path

Floats = npt.NDArray[np.float64]

QUIET = 0.25  # of what a usual frame holds
STEP_BINS = 4
MOST_BINS = 6  # that a frame is moved
MOVE_COST = 3.0  # of the log-likelihood, for each bin that a frame is moved more than the frame before
PAUSE_COST = 7.0  # the most that this costs after a pause
MIN_GAIN = 8.0  # of the log-likelihood of a run, to move it: 3 other phases are tried


def find_runs(amounts: Amounts, frame_chips: int) -> npt.NDArray[np.int64]:
    """Find the bounds of the runs of letters.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    frame_chips : int
        Chips of a letter.

    Returns
    -------
    ndarray of int64, shape (runs + 1,)
        The first chip of each run and the end of the last one; a pause is cut in its middle.

    Examples
    --------
    >>> amounts = np.zeros((100, 16, 2), np.float32)
    >>> amounts[10:40] = amounts[70:90] = 1
    >>> find_runs(amounts, 11).tolist()
    [0, 55, 100]
    """
    each = amounts.sum(axis=(1, 2), dtype=np.float64)
    total = np.concatenate([[0.0], np.cumsum(each)])
    at = np.arange(each.size)
    low, high = np.maximum(at - frame_chips // 2, 0), np.minimum(at + frame_chips // 2 + 1, each.size)
    around = (total[high] - total[low]) / (high - low)
    busy = around > 0
    if not busy.any():
        return np.array([0, each.size], np.int64)
    quiet = around <= QUIET * np.median(around[busy])
    turns = np.diff(np.concatenate([[0], quiet.astype(np.int64), [0]]))
    begins, ends = np.flatnonzero(turns == 1), np.flatnonzero(turns == -1)
    inner = (begins > 0) & (ends < each.size)
    return np.concatenate([[0], (begins[inner] + ends[inner]) // 2, [each.size]]).astype(np.int64)


def align_runs(
    amounts: Amounts, learned: Learned, nodes: Nodes, frame_chips: int
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Find how far the events of each run are to be moved.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    learned : Learned
    nodes : Nodes
        Those of the line code.
    frame_chips : int
        Chips of a letter.

    Returns
    -------
    bounds : ndarray of int64, shape (runs + 1,)
        See `find_runs`.
    move : ndarray, shape (runs,)
        To be added to the chip numbers of the events of each run, -0.5 .. 0.5 [chips].
    """
    bounds = find_runs(amounts, frame_chips)
    if bounds.size < 3:
        return bounds, np.zeros(bounds.size - 1)
    flat = amounts.reshape(-1, 2)
    moves = np.arange(-PHASES // 2, PHASES // 2, STEP_BINS)
    scores = np.empty((moves.size, bounds.size - 1))
    for k, bins in enumerate(moves):
        moved = rate_scores(np.roll(flat, bins, axis=0).reshape(amounts.shape), learned.rates, learned.dispersion)
        path = likeliest_path(moved, nodes)
        each = moved[np.arange(len(path)), nodes.context[path]]
        scores[k] = np.add.reduceat(each, bounds[:-1])
    here = scores[int(np.flatnonzero(moves == 0)[0])]
    best = np.argmax(scores, axis=0)
    gain = scores[best, np.arange(best.size)] - here
    return bounds, np.where(gain > MIN_GAIN, moves[best] / PHASES, 0.0)


def align_frames(
    amounts: Amounts, learned: Learned, context: npt.NDArray[np.int32], begins: npt.NDArray[np.int64], frame_chips: int
) -> Floats:
    """Find how far the events of each frame are to be moved.

    Parameters
    ----------
    amounts : ndarray, shape (chips, PHASES, 2)
    learned : Learned
    context : ndarray of int32, shape (chips,)
        Context of each chip on the path.
    begins : ndarray of int64, shape (frames,)
        First chips of the frames.
    frame_chips : int
        Chips of a frame.

    Returns
    -------
    ndarray, shape (frames,)
        To be added to the chip numbers of the events of each frame [chips].
    """
    moves = np.arange(-MOST_BINS, MOST_BINS + 1)
    weights = np.log(learned.rates) / learned.dispersion
    ends = np.minimum(begins + frame_chips, len(amounts))
    sums = [score_moved(amounts, weights, context, int(bins)) for bins in moves]
    scores = np.stack([total[ends] - total[begins] for total in sums], axis=1)
    steady = MOVE_COST * np.abs(moves[:, None] - moves)
    after_pause = np.minimum(steady, PAUSE_COST)
    best, ahead = scores[:1].copy(), np.zeros(scores.shape, np.int64)
    for k in range(1, len(begins)):
        reached = best[-1][:, None] - (steady if begins[k] - begins[k - 1] == frame_chips else after_pause)
        ahead[k] = np.argmax(reached, axis=0)
        best = (reached.max(axis=0) + scores[k])[None]
    place = np.zeros(len(begins), np.int64)
    if len(begins):
        place[-1] = np.argmax(best[-1])
    for k in range(len(begins) - 1, 0, -1):
        place[k - 1] = ahead[k, place[k]]
    return np.asarray(-moves[place] / PHASES, np.float64)
