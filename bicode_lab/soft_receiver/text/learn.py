"""Learn from a whole recording what its light sends, from the best of many starts.

Every start is tried on the busiest `SHORT_CHIPS`, with few rounds. The `MOST_KEPT` likeliest go on over `TRIAL_CHIPS`,
with each way to weigh a bin. The likeliest of each way is then learned over the whole recording, from the rates that
the trial found, never from a guess again, while the clock is followed (`clock`, `runs`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.text.amounts import Amounts, Weighing, count_events, weigh
from bicode_lab.soft_receiver.text.clock import follow_clock
from bicode_lab.soft_receiver.text.edge_rates import Kernels, Learned, learn_rates
from bicode_lab.soft_receiver.text.runs import align_frames, align_runs
from bicode_lab.soft_receiver.text.starts import Start, find_starts, first_kernels

Floats = npt.NDArray[np.float64]

MEMORY = 4  # an edge makes events over three chips
SHORT_CHIPS, SHORT_ROUNDS = 1000, (2, 1)
TRIAL_CHIPS, TRIAL_ROUNDS = 3000, (2, 4)
MOST_KEPT = 3
WHOLE_ROUNDS = ((0, 2), (0, 2), (0, 2), (0, 1))  # between them, the clock is followed
AHEAD_CHIPS = 12  # a frame may have begun before the first event
SEARCH_CHIPS = 100  # from one place where the busiest chips may begin to the next


@dataclass(frozen=True, eq=False)
class LearnedText:
    """A light as it was learned from a whole recording.

    Parameters
    ----------
    learned : Learned
    amounts : ndarray, shape (chips, PHASES, 2)
    chips : ndarray, shape (n,)
        Chip number of each event, from the first chip of `amounts` on; those of neighbours may change places where a
        run or a frame was moved.
    """

    learned: Learned
    amounts: Amounts
    chips: Floats


def find_best_starts(nominal: Floats, is_on: npt.NDArray[np.bool_], line: LineCode) -> list[Start]:
    """Try all starts on few chips and keep the likeliest.

    Parameters
    ----------
    nominal : ndarray, shape (n,)
        Time of each event since the first one, in nominal chips.
    is_on : ndarray of bool, shape (n,)
    line : LineCode

    Returns
    -------
    list of Start
        The likeliest first.
    """
    tried = []
    for start in find_starts(nominal, is_on):
        amounts = _busiest(nominal, is_on, start, SHORT_CHIPS, "marks")
        learned = _learn(amounts, line, first_kernels(start, amounts, MEMORY - 1), SHORT_ROUNDS)
        tried.append((learned.gain, start))
    tried.sort(key=lambda one: -one[0])
    return [start for _, start in tried[:MOST_KEPT]]


def learn_text(
    nominal: Floats, is_on: npt.NDArray[np.bool_], line: LineCode, starts: list[Start], weighing: Weighing
) -> LearnedText:
    """Learn a light from the best of some starts.

    Parameters
    ----------
    nominal : ndarray, shape (n,)
        Time of each event since the first one, in nominal chips.
    is_on : ndarray of bool, shape (n,)
    line : LineCode
    starts : list of Start
        One or more.
    weighing : {"events", "marks"}

    Returns
    -------
    LearnedText
    """
    trials = []
    for start in starts:
        amounts = _busiest(nominal, is_on, start, TRIAL_CHIPS, weighing)
        trials.append((_learn(amounts, line, first_kernels(start, amounts, MEMORY - 1), TRIAL_ROUNDS), start))
    learned, best = max(trials, key=lambda trial: trial[0].gain)
    chips = nominal * (1 + best.rate) - best.shift + AHEAD_CHIPS
    for k, rounds in enumerate(WHOLE_ROUNDS):
        amounts = weigh(count_events(chips, is_on, 0, int(chips[-1]) + AHEAD_CHIPS), weighing)
        learned = _learn(amounts, line, learned.kernels, rounds, learned.rates)
        if k + 1 < len(WHOLE_ROUNDS):
            chips = _follow(chips, amounts, learned, line, k)
    return LearnedText(learned, amounts, chips)


def _learn(
    amounts: Amounts, line: LineCode, kernels: Kernels, rounds: tuple[int, int], rates: Floats | None = None
) -> Learned:
    """Learn rates along paths whose frames pass the check."""
    return learn_rates(amounts, build_nodes(line, MEMORY, True), MEMORY, kernels, rates=rates, rounds=rounds)


def _follow(chips: Floats, amounts: Amounts, learned: Learned, line: LineCode, turn: int) -> Floats:
    """Correct the chip numbers of the events: along the recording, run by run at first, and later frame by frame."""
    nodes = build_nodes(line, MEMORY, True)
    context = nodes.context[learned.path]
    begins = np.flatnonzero(nodes.place[learned.path] == 0)
    if turn > 0 and (np.diff(begins) != line.frame_chips).any():
        frame = np.clip(np.searchsorted(begins, chips, side="right") - 1, 0, None)
        return chips + align_frames(amounts, learned, context, begins, line.frame_chips)[frame]
    if turn == 0:
        bounds, move = align_runs(amounts, learned, nodes, line.frame_chips)
        if move.any():
            return chips + move[np.searchsorted(bounds[1:-1], chips, side="right")]
    middle, later = follow_clock(amounts, learned.rates, context).T
    return np.asarray(chips - np.interp(chips, middle, later), np.float64)


def _busiest(nominal: Floats, is_on: npt.NDArray[np.bool_], start: Start, n_chips: int, weighing: Weighing) -> Amounts:
    """Return the amounts of the chips, as many as are wanted, in which the light sends the most of the time."""
    n_all = int(nominal[-1]) + 2 * AHEAD_CHIPS
    first = -AHEAD_CHIPS
    if n_all > n_chips:
        pieces = np.bincount((nominal / SEARCH_CHIPS).astype(np.int64))
        busy = np.concatenate([[0], np.cumsum(pieces > 0.2 * np.median(pieces[pieces > 0]))])
        width = min(n_chips // SEARCH_CHIPS, pieces.size)
        first = int(np.argmax(busy[width:] - busy[:-width])) * SEARCH_CHIPS
    chips = nominal * (1 + start.rate) - start.shift
    low, high = np.searchsorted(chips, [first, first + n_chips])
    n = min(n_chips, n_all)
    return weigh(count_events(chips[low:high], is_on[low:high], first, n), weighing)
