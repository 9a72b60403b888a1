"""Does an event keep the rules?   one event after the other -> the good ones, and a tally of the others

Each offence is counted under one rule, with the place of the first of its kind. Reading
strictly, the first is raised as an error; leniently, the good events go on and the tally
becomes the counts of what was dropped.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.events import Events
from bicode_lab.recordings.formats import RecordingError

# New numbers go to the end: numba keeps a compiled kernel while the text of its own file is the same, not of this.
# Rows of a tally: events that break a rule, then words, lines and bytes that hold no event.
UNTIMED, UNPLACED, X, Y, P, BACKWARDS, MISTIMED, UNKNOWN, BLANK, LINE, CUT, VECTOR, REST, DOUBTFUL = range(14)
COUNT, EVENT, PLACE, VALUE = range(4)  # its columns; events are counted from 0, lines from 1

# A reader's memory between blocks: what it judges with, and where EVT, DAT and ES words left off.
# HIGH, AT_X and AT_Y are -1 until a word tells; ZEROS counts zero words in a row.
EVENTS, LAST, KEPT, WIDTH, HEIGHT, T0, LENIENT, HIGH, LOW, AT_X, AT_Y, POLARITY, KIND, ZEROS, TRUSTED = range(15)

Ints = npt.NDArray[np.int64]
Int = int | np.int64

_DROPPED = {
    UNTIMED: "events before the first time word",
    UNPLACED: "events without a row or column",
    X: "events outside the sensor",
    Y: "events outside the sensor",
    P: "events of no polarity",
    BACKWARDS: "events that step back in time",
    MISTIMED: "events with a damaged time",
    DOUBTFUL: "time words that those after them contradict",
    UNKNOWN: "words of no known kind",
    BLANK: "words of zeros",
    LINE: "lines that hold no event",
    CUT: "bytes at the cut end",
    VECTOR: "vector of events cut at the end",
    REST: "unreadable rest of the file",
}

_BAD_WORDS = {
    DOUBTFUL: "time words are contradicted by those after them",
    UNKNOWN: "words have no known kind",
    BLANK: "words are blank (all zero)",
}

LENIENTLY = "or read the good events with lenient=True (--lenient)"


@njit(cache=True)
def note(tally: Ints, rule: Int, event: Int, place: Int, value: Int) -> None:
    """Count one offence, and remember the first of its kind."""
    if tally[rule, COUNT] == 0:
        tally[rule, EVENT], tally[rule, PLACE], tally[rule, VALUE] = event, place, value
    tally[rule, COUNT] += 1


@njit(cache=True)
def judge(state: Ints, tally: Ints, out: Events, x: Int, y: Int, p: Int, t: Int, place: Int) -> None:
    """One event against the rules; a good one goes to `out`. `place` is its byte or line."""
    event = state[EVENTS]
    state[EVENTS] += 1
    if x < 0 or x >= state[WIDTH]:
        note(tally, X, event, place, x)
    elif y < 0 or y >= state[HEIGHT]:
        note(tally, Y, event, place, y)
    elif p != 0 and p != 1:
        note(tally, P, event, place, p)
    elif t < state[LAST]:
        note(tally, BACKWARDS, event, place, state[LAST] - t)
    else:
        state[LAST] = t
        good = out[state[KEPT]]
        good.x, good.y, good.p, good.t = x, y, p, t + state[T0]
        state[KEPT] += 1


@njit(cache=True)
def judge_columns(columns: Ints, place: int, state: Ints, tally: Ints, out: Events) -> None:
    """Rows of x, y, p, t."""
    for i in range(columns.shape[0]):
        x, y, p, t = columns[i]
        judge(state, tally, out, x, y, p, t, place + i)


def new_state(width: int, height: int, t0_us: int = 0, lenient: bool = False) -> Ints:
    """What a reader knows before the first word."""
    state: Ints = np.zeros(15, np.int64)
    state[LAST] = np.iinfo(np.int64).min
    state[[HIGH, AT_X, AT_Y]] = -1
    state[[WIDTH, HEIGHT, T0, LENIENT, TRUSTED]] = width, height, t0_us, lenient, 3
    return state


def new_tally() -> Ints:
    """A tally without an offence."""
    return np.zeros((len(_DROPPED), 4), np.int64)


def dropped(tally: Ints) -> dict[str, int]:
    """A tally in, what was dropped out: cause -> count, without the causes that never came."""
    counts: dict[str, int] = {}
    for rule, cause in _DROPPED.items():
        if tally[rule, COUNT]:
            counts[cause] = counts.get(cause, 0) + int(tally[rule, COUNT])
    return counts


def complain(path: Path, state: Ints, tally: Ints, place_is: str) -> None:
    """Raise the offence that comes first in the file, if there is one.

    Raises
    ------
    RecordingError
        With the count of offenders so far and the place of the first.
    """
    rules = [rule for rule in range(len(tally)) if tally[rule, COUNT]]
    if not rules:
        return
    rule = min(rules, key=lambda r: (int(tally[r, EVENT]), int(tally[r, PLACE])))
    count, event, place, value = (int(number) for number in tally[rule])
    n, (width, height) = int(state[EVENTS]), (int(state[WIDTH]), int(state[HEIGHT]))
    if rule in (CUT, VECTOR):
        what = "inside a vector of events" if rule == VECTOR else f"{count} of the bytes of an event"
        raise RecordingError(f"{path}: cut short at byte {place:,}: {what}; copy it again, {LENIENTLY}")
    where = f" at {place_is} {place:,}" if place_is else ""
    if rule in _BAD_WORDS:
        first = f"the first is{where} ({value:#x}, after {event:,} events)"
        raise RecordingError(f"{path}: {count:,} {_BAD_WORDS[rule]}; {first}; copy it again, {LENIENTLY}")
    size = "check width and height, or export the file again"
    what, found, way_out = {
        UNTIMED: ("no time word before them", f"word {value:#x}", "export the file again"),
        UNPLACED: ("no row or column word before them", f"word {value:#x}", "export the file again"),
        X: (f"x outside the {width} px wide sensor", f"x = {value}", size),
        Y: (f"y outside the {height} px high sensor", f"y = {value}", size),
        P: ("a polarity that is neither 0 nor 1", f"p = {value}", "store OFF as 0 and ON as 1"),
        BACKWARDS: ("a time before the event ahead of it", f"{value:,} us back", "sort the events by time"),
    }[rule]
    message = f"{count:,} of {n:,} events have {what}; the first is number {event:,}{where} ({found}); {way_out}"
    raise RecordingError(f"{path}: {message}, {LENIENTLY}")
