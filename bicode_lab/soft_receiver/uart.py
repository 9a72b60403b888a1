"""A stream that never repeats, as a beacon's text: letter after letter.   events -> letters

The walk goes over all chips of the recording at once, under levels learned from it; the code's
check takes part, since a letter of odd parity was never sent. What the light said
without that help is kept beside it: `parity_ok` is the parity of the walk that does not know it.
A recording may begin and end inside a frame: the first and the last letter are given out
only where their parity was right without help.

Which levels explain the most chooses where in a chip the edges lie. This is tried on the
recording's first `TRIAL_CHIPS`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.soft_receiver.clock import Marks, find_chips, lead_marks
from bicode_lab.soft_receiver.levels import PHASES, Floats, Tally, learn_levels, scores_of, tally
from bicode_lab.soft_receiver.line_code import LineCode, nodes_of
from bicode_lab.soft_receiver.viterbi import best_walk

MEMORY = 3
ROUNDS = 4
TRIAL_CHIPS = 4000
LEAST_SHARE = 0.1  # of a usual frame's ON and of its OFF marks
TRIAL_PHASES = 2  # bins from one place of the edges tried to the next


@dataclass(frozen=True)
class UartCharacter:
    """One frame of text.

    Parameters
    ----------
    t_us : int
        Start of its start chip [us], the recording's own clock.
    letter : str
        One character, code 0 .. 127.
    parity_ok : bool
        Whether the parity held before it was used.
    """

    t_us: int
    letter: str
    parity_ok: bool


def read_uart(events: Events, line: LineCode) -> list[UartCharacter]:
    """The events of one light and its line code in, every letter in the order of time out.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Of one region; x and y are not looked at.
    line : LineCode
        One whose frames are letters, as `UartLine`.

    Examples
    --------
    >>> from bicode_lab.soft_receiver.line_code import UartLine
    >>> from bicode_lab.events import no_events
    >>> read_uart(no_events(), UartLine(rate_hz=504))
    []
    """
    if not events.size:
        return []
    bin_us = line.chip_us / PHASES
    t0_us = int(events["t"][0])
    marks = _marks(events, bin_us)
    chips, _, _ = find_chips(marks, bin_us, line.chip_us)
    shift = _find_shift(marks, chips, line)
    first = -line.frame_chips
    counts = tally(marks, chips - shift, first, int(chips[-1]) + 2 - first)
    checked = nodes_of(line, MEMORY, True)
    shares = learn_levels(counts, line, MEMORY, ROUNDS, checked=True)
    scores = scores_of(counts, shares)
    walk, _ = best_walk(scores, checked)
    free = nodes_of(line, MEMORY)
    free_walk, _ = best_walk(scores, free)
    levels, free_levels = checked.context[walk] & 1, free.context[free_walk] & 1
    letters = []
    for k in _whole_frames(counts, np.flatnonzero(checked.place[walk] == 0), line.frame_chips):
        frame = slice(k, k + line.frame_chips)
        value, _ = line.decode(levels[frame])
        _, parity_ok = line.decode(free_levels[frame])
        t_us = t0_us + float(np.interp(first + k + shift, chips, (np.arange(chips.size) + 0.5) * bin_us))
        letters.append(UartCharacter(round(t_us), chr(value), parity_ok))
    last = len(letters) - 1
    return [letter for i, letter in enumerate(letters) if 0 < i < last or letter.parity_ok]


def _marks(events: Events, bin_us: float) -> Marks:
    """Events in, what each bin of `bin_us` from the first event on says out."""
    t = events["t"] - events["t"][0]
    number = (t / bin_us).astype(np.int64)
    n = int(number[-1]) + 1
    is_on = events["p"] > 0
    return lead_marks(np.bincount(number[is_on], minlength=n), np.bincount(number[~is_on], minlength=n))


def _find_shift(marks: Marks, chips: Floats, line: LineCode) -> float:
    """Marks and chip numbers in; how far behind the whole numbers the edges lie [chips] out."""
    n = min(TRIAL_CHIPS, int(chips[-1]) + 1)
    nodes = nodes_of(line, MEMORY, True)
    best, found = -np.inf, 0.0
    for phase in range(0, PHASES, TRIAL_PHASES):
        counts = tally(marks, chips - phase / PHASES, 0, n)
        shares = learn_levels(counts, line, MEMORY, ROUNDS, checked=True)
        scores = scores_of(counts, shares)
        walk, _ = best_walk(scores, nodes)
        total = float(scores[np.arange(n), nodes.context[walk]].sum())
        if total > best:
            best, found = total, phase / PHASES
    return found


def _whole_frames(counts: Tally, begins: npt.NDArray[np.int64], length: int) -> npt.NDArray[np.int64]:
    """First chips of frames in, those that hold both a fall and a rise out.

    Every frame has one of each: its start, and its stop at the latest. Where the light stops for good,
    marks of one side are missing, or all but some noise.
    """
    begins = begins[begins + length <= counts.shape[0]]
    if not begins.size:
        return begins
    total = np.concatenate([np.zeros((1, 2)), counts[..., 1:].sum(axis=1).cumsum(axis=0)])
    said = total[begins + length] - total[begins]
    whole: npt.NDArray[np.int64] = begins[
        (said >= LEAST_SHARE * np.median(said, axis=0)).all(axis=1) & (said > 0).all(axis=1)
    ]
    return whole
