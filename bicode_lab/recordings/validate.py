"""The rules that every event of a file must keep, and the tally of those that break one.

Each offence is counted under one rule, and the position of the first offence against each rule is kept. In strict
reading the first offence is raised as an error. In lenient reading the good events are passed on and the tally says
what was dropped.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recordings.formats import RecordingError

# Rows of a tally, one for each rule: first events that break it, then words, lines and bytes that hold no event.
UNTIMED, UNPLACED, X, Y, P, BACKWARDS, MISTIMED, UNKNOWN, BLANK, LINE, CUT, VECTOR, REST, DOUBTFUL, NUMBER, MARK = (
    range(16)
)
# Columns of a tally: how often, and of the first offence the event's number (from 0), its byte or line, and a value.
COUNT, EVENT, PLACE, VALUE = range(4)

# Entries of a reader's state: the limits it checks against, and where decoding stopped in the previous block.
# HIGH (upper bits of the time), AT_X and AT_Y are -1 until a word sets them; ZEROS counts successive zero words.
# ANY_ORDER is set where `time_order` judges the times afterwards; MARKS counts external triggers in their buffer;
# PASSED counts words of a vendor's own kind, which are passed over.
EVENTS, LAST, KEPT, WIDTH, HEIGHT, T0, LENIENT, HIGH, LOW, AT_X, AT_Y, POLARITY, KIND, ZEROS, TRUSTED = range(15)
ANY_ORDER, MARKS, PASSED = range(15, 18)

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
    REST: "packets that cannot be read, or the rest of the file",
    NUMBER: "events with a value that is no whole number",
    MARK: "external triggers without a known time",
}

_BAD_WORDS = {
    DOUBTFUL: "time words are contradicted by those after them",
    UNKNOWN: "words have no known kind",
    BLANK: "words are blank (all zero)",
    MARK: "external triggers have no time word before them",
}

LENIENT_HINT = "or read the good events with lenient=True (--lenient)"
"""The way out that ends every error message which lenient reading avoids."""

MAX_TIME_US = 1 << 60
"""Times beyond this (36,000 years) are taken as damaged; sums of them would leave 64 bits."""


@njit(cache=True)
def count_offence(tally: Ints, rule: Int, event: Int, place: Int, value: Int) -> None:
    """Count one offence in the tally, and keep the details of the first one against its rule.

    Parameters
    ----------
    tally : ndarray of int64, shape (16, 4)
        Made by `new_tally`; changed in place.
    rule : int
        Row of the tally.
    event : int
        Number of events before the offence.
    place : int
        Byte or line at which it occurs.
    value : int
        The word or number that breaks the rule.
    """
    if tally[rule, COUNT] == 0:
        tally[rule, EVENT], tally[rule, PLACE], tally[rule, VALUE] = event, place, value
    tally[rule, COUNT] += 1


@njit(cache=True)
def validate_event(state: Ints, tally: Ints, out: Events, x: Int, y: Int, p: Int, t: Int, place: Int) -> None:
    """Append an event to `out` if it keeps the rules; count the offence otherwise.

    Parameters
    ----------
    state : ndarray of int64, shape (18,)
        Made by `new_state`; changed in place. ``state[KEPT]`` is the number of events in `out`.
    tally : ndarray of int64, shape (16, 4)
        Made by `new_tally`; changed in place.
    out : ndarray of EVENT_DTYPE, shape (n,)
        Buffer for good events.
    x, y, p, t : int
        Column and row [px], polarity, and time before ``state[T0]`` is added [us].
    place : int
        Byte or line of the event in the file.
    """
    event = state[EVENTS]
    state[EVENTS] += 1
    if x < 0 or x >= state[WIDTH]:
        count_offence(tally, X, event, place, x)
    elif y < 0 or y >= state[HEIGHT]:
        count_offence(tally, Y, event, place, y)
    elif p != 0 and p != 1:
        count_offence(tally, P, event, place, p)
    elif t < state[LAST] and not state[ANY_ORDER]:
        count_offence(tally, BACKWARDS, event, place, state[LAST] - t)
    else:
        state[LAST] = t
        good = out[state[KEPT]]
        good.x, good.y, good.p, good.t = x, y, p, t + state[T0]
        state[KEPT] += 1


@njit(cache=True)
def validate_rows(rows: Ints, place: int, state: Ints, tally: Ints, out: Events) -> None:
    """Validate the events of a table.

    Parameters
    ----------
    rows : ndarray of int64, shape (n, 4)
        x, y, p, t of each event.
    place : int
        Line of the first row, or number of its event.
    state, tally, out : ndarray
        See `validate_event`.
    """
    for i in range(rows.shape[0]):
        x, y, p, t = rows[i]
        validate_event(state, tally, out, x, y, p, t, place + i)


@njit(cache=True, nogil=True)
def take_good(columns: tuple[Ints, Ints, Ints, Ints], state: Ints, out: Ints) -> bool:
    """Take over events that all keep the rules.

    Parameters
    ----------
    columns : tuple of four ndarrays of integers, shape (n,)
        x, y, p and t [us].
    state : ndarray of int64
        See `validate_event`; changed in place if all events are good.
    out : ndarray of int64, shape (n, 2)
        The events as `events.words` shows them.

    Returns
    -------
    bool
        False if an event breaks a rule, or has a polarity of -1; then `validate_rows` is to count the offences.
    """
    x, y, p, t = columns
    width, height, t0, last = state[WIDTH], state[HEIGHT], state[T0], state[LAST]
    for i in range(t.size):
        column, row, polarity, time = np.int64(x[i]), np.int64(y[i]), np.int64(p[i]), t[i]
        if not (0 <= column < width and 0 <= row < height and 0 <= polarity <= 1):
            return False
        if time < last or not -MAX_TIME_US < time < MAX_TIME_US:
            return False
        out[i, 0], out[i, 1] = polarity << 32 | row << 16 | column, time + t0
        last = time
    state[LAST] = last
    state[EVENTS] += t.size
    return True


def new_state(width: int, height: int, t0_us: int = 0, lenient: bool = False) -> Ints:
    """Make the state of a reader that has not read anything yet.

    Parameters
    ----------
    width, height : int
        Sensor size [px].
    t0_us : int
        Time to add to every event [us].
    lenient : bool
        Whether damaged time words are mended or dropped.

    Returns
    -------
    ndarray of int64, shape (18,)
    """
    state: Ints = np.zeros(18, np.int64)
    state[LAST] = np.iinfo(np.int64).min
    state[[HIGH, AT_X, AT_Y]] = -1
    state[[WIDTH, HEIGHT, T0, LENIENT, TRUSTED]] = width, height, t0_us, lenient, 3
    return state


def new_tally() -> Ints:
    """Return a tally without any offence: zeros of int64, shape (16, 4)."""
    return np.zeros((len(_DROPPED), 4), np.int64)


def dropped_counts(tally: Ints) -> dict[str, int]:
    """Return what was dropped as counts by cause; causes that did not occur are left out.

    Parameters
    ----------
    tally : ndarray of int64, shape (16, 4)
        Made by `new_tally`.

    Returns
    -------
    dict of str to int
    """
    counts: dict[str, int] = {}
    for rule, cause in _DROPPED.items():
        if tally[rule, COUNT]:
            counts[cause] = counts.get(cause, 0) + int(tally[rule, COUNT])
    return counts


def raise_first_offence(path: Path, state: Ints, tally: Ints, place_unit: str) -> None:
    """Raise an error for the offence that comes first in the file; do nothing if there is none.

    Parameters
    ----------
    path : Path
        The file that was read.
    state, tally : ndarray
        See `validate_event`.
    place_unit : str
        What a place counts: "byte" or "line"; empty where places are not known.

    Raises
    ------
    RecordingError
        With the number of offences against the rule so far and the place of the first.
    """
    rules = [rule for rule in range(len(tally)) if tally[rule, COUNT]]
    if not rules:
        return
    rule = min(rules, key=lambda r: (int(tally[r, EVENT]), int(tally[r, PLACE])))
    count, event, place, value = (int(number) for number in tally[rule])
    n, (width, height) = int(state[EVENTS]), (int(state[WIDTH]), int(state[HEIGHT]))
    if rule in (CUT, VECTOR):
        what = "inside a vector of events" if rule == VECTOR else f"{count} of the bytes of an event"
        raise RecordingError(f"{path}: cut short at byte {place:,}: {what}; copy it again, {LENIENT_HINT}")
    where = f" at {place_unit} {place:,}" if place_unit else ""
    if rule in _BAD_WORDS:
        first = f"the first is{where} ({value:#x}, after {event:,} events)"
        raise RecordingError(f"{path}: {count:,} {_BAD_WORDS[rule]}; {first}; copy it again, {LENIENT_HINT}")
    size = "check width and height, or export the file again"
    what, found, way_out = {
        UNTIMED: ("no time word before them", f"word {value:#x}", "export the file again"),
        UNPLACED: ("no row or column word before them", f"word {value:#x}", "export the file again"),
        X: (f"x outside the {width} px wide sensor", f"x = {value}", size),
        Y: (f"y outside the {height} px high sensor", f"y = {value}", size),
        P: ("a polarity that is neither 0 nor 1", f"p = {value}", "store OFF as 0 and ON as 1"),
        BACKWARDS: ("a time before the event ahead of it", f"{value:,} us back", "sort the events by time"),
        MISTIMED: ("a time far from those before and after it", f"t = {value}", "copy it again"),
        NUMBER: ("a value that is no whole number", f"in {'xypt'[value % 4]}", "export the file again"),
    }[rule]
    message = f"{count:,} of {n:,} events have {what}; the first is number {event:,}{where} ({found}); {way_out}"
    raise RecordingError(f"{path}: {message}, {LENIENT_HINT}")
