"""Read a text of UART characters, such as a public LED beacon sends, from the events of one light.

The most likely path is found over all chips of the recording at once, with levels that are learned from it. The parity
takes part, because a character of odd parity is never sent. What the light says without this help is kept beside it:
`parity_ok` is the parity on the path that does not know the check.

A recording may begin and end within a frame, so the first and the last character are returned only if their parity is
right without the help of the check.

Where in a chip the edges lie is decided by the levels that explain the most. This is tried on the first `TRIAL_CHIPS`
chips of the recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.soft_receiver.clock import Marks, find_chips, lead_marks
from bicode_lab.soft_receiver.levels import PHASES, Floats, MarkCounts, count_marks, learn_levels, log_likelihoods
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.viterbi import best_path, path_score

MEMORY = 3
ROUNDS = 4
TRIAL_CHIPS = 4000
MIN_FRACTION = 0.1  # of the ON marks, and of the OFF marks, of a usual frame
TRIAL_STEP_BINS = 2  # from one place of the edges that is tried to the next


@dataclass(frozen=True)
class UartCharacter:
    """One frame of a text.

    Parameters
    ----------
    t_us : int
        Start of its start chip, in the time of the recording [us].
    letter : str
        One character, code 0 .. 127.
    parity_ok : bool
        Whether the parity holds on the path that does not know the check.
    """

    t_us: int
    letter: str
    parity_ok: bool


def read_uart(events: Events, line: LineCode) -> list[UartCharacter]:
    """Read the characters that a light sends.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region; x and y are not used.
    line : LineCode
        A code whose frames are characters, such as `UartLine`.

    Returns
    -------
    list of UartCharacter
        In the order of time.

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
    counts = count_marks(marks, chips - shift, first, int(chips[-1]) + 2 - first)
    checked = build_nodes(line, MEMORY, True)
    levels = learn_levels(counts, line, MEMORY, ROUNDS, checked=True)
    scores = log_likelihoods(counts, levels)
    path, _ = best_path(scores, checked)
    free = build_nodes(line, MEMORY)
    free_path, _ = best_path(scores, free)
    sent, free_sent = checked.context[path] & 1, free.context[free_path] & 1
    characters = []
    for k in _whole_frames(counts, np.flatnonzero(checked.place[path] == 0), line.frame_chips):
        frame = slice(k, k + line.frame_chips)
        value, _ = line.decode(sent[frame])
        _, parity_ok = line.decode(free_sent[frame])
        t_us = t0_us + float(np.interp(first + k + shift, chips, (np.arange(chips.size) + 0.5) * bin_us))
        characters.append(UartCharacter(round(t_us), chr(value), parity_ok))
    last = len(characters) - 1
    return [character for i, character in enumerate(characters) if 0 < i < last or character.parity_ok]


def _marks(events: Events, bin_us: float) -> Marks:
    """Return the mark of each bin of `bin_us` [us], from the first event on."""
    t = events["t"] - events["t"][0]
    number = (t / bin_us).astype(np.int64)
    n = int(number[-1]) + 1
    is_on = events["p"] > 0
    return lead_marks(np.bincount(number[is_on], minlength=n), np.bincount(number[~is_on], minlength=n))


def _find_shift(marks: Marks, chips: Floats, line: LineCode) -> float:
    """Find how far after the whole chip numbers the edges lie [chips]."""
    n = min(TRIAL_CHIPS, int(chips[-1]) + 1)
    nodes = build_nodes(line, MEMORY, True)
    best, found = -np.inf, 0.0
    for phase in range(0, PHASES, TRIAL_STEP_BINS):
        counts = count_marks(marks, chips - phase / PHASES, 0, n)
        levels = learn_levels(counts, line, MEMORY, ROUNDS, checked=True)
        scores = log_likelihoods(counts, levels)
        path, _ = best_path(scores, nodes)
        total = path_score(scores, nodes.context[path])
        if total > best:
            best, found = total, phase / PHASES
    return found


def _whole_frames(counts: MarkCounts, begins: npt.NDArray[np.int64], length: int) -> npt.NDArray[np.int64]:
    """Keep the frames, given by their first chips, that hold both a fall and a rise.

    Every frame has one of each: its start, and its stop at the latest. Where the light stops for good, the marks of one
    polarity are missing, or all marks but some noise.
    """
    begins = begins[begins + length <= counts.shape[0]]
    if not begins.size:
        return begins
    total = np.concatenate([np.zeros((1, 2)), counts[..., 1:].sum(axis=1).cumsum(axis=0)])
    said = total[begins + length] - total[begins]
    enough = (said >= MIN_FRACTION * np.median(said, axis=0)).all(axis=1) & (said > 0).all(axis=1)
    whole: npt.NDArray[np.int64] = begins[enough]
    return whole
