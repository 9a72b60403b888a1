"""Decode the older of the vendor's RAW formats: EVT3 (16-bit words) and EVT2 (32-bit words).

The upper four bits of a word tell its kind; `evt3_write` lists those of EVT3. Which time words are trusted is decided
in `evt_time`.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recordings.raw.evt_time import (
    ACCEPTED,
    BOTH_TRUSTED,
    HIGH_TRUSTED,
    UNDECIDED,
    UNUSED,
    check_time_low,
    read_time_high,
)
from bicode_lab.recordings.validate import (
    AT_X,
    AT_Y,
    BLANK,
    EVENTS,
    HIGH,
    KEPT,
    KIND,
    LAST,
    LENIENT,
    LOW,
    MARK,
    MARKS,
    MISTIMED,
    PASSED,
    POLARITY,
    T0,
    TRUSTED,
    UNKNOWN,
    UNPLACED,
    UNTIMED,
    ZEROS,
    Int,
    Ints,
    count_offence,
    validate_event,
)

VENDOR_KIND = 9
"""Words of this kind are in no definition of the formats. Some cameras send them, to pad their data for example."""

_BLANK_WORDS = 4
"""Zero words mean row 0; this many in a row are taken as a hole in the file."""


@njit(cache=True)
def _broken_rule(state: Ints, x: Int, y: Int) -> int:
    """Return the rule that an event breaks because its time or place is unknown, or -1."""
    if state[HIGH] < 0:
        return UNTIMED
    if x < 0 or y < 0:
        return UNPLACED
    return -1 if state[TRUSTED] == BOTH_TRUSTED else MISTIMED


@njit(cache=True)
def add_event(state: Ints, tally: Ints, out: Events, x: Int, y: Int, p: Int, t: Int, place: Int, word: Int) -> None:
    """Validate an event if its time and place are known; count the offence otherwise."""
    rule = _broken_rule(state, x, y)
    if rule < 0:
        validate_event(state, tally, out, x, y, p, t, place)
    else:
        count_offence(tally, rule, state[EVENTS], place, word)
        state[EVENTS] += 1


@njit(cache=True)
def add_trigger(state: Ints, tally: Ints, marks: Ints, t: Int, number: Int, level: Int, place: Int, word: Int) -> None:
    """Keep an external trigger if the time is known; count the offence otherwise."""
    if state[HIGH] < 0 or state[TRUSTED] != BOTH_TRUSTED:
        count_offence(tally, MARK, state[EVENTS], place, word)
        return
    mark = marks[state[MARKS]]
    mark[0], mark[1], mark[2] = t + state[T0], number, level
    state[MARKS] += 1


@njit(cache=True)
def _read_place(state: Ints, tally: Ints, out: Events, word: Int, place: int) -> None:
    """Read an EVT3 word that gives a row, an event, the base of a vector, or 12 or 8 pixels of a vector."""
    kind, value = word >> 12, word & 0xFFF
    t = (state[HIGH] << 12) | state[LOW]
    if kind == 0:
        state[AT_Y] = value & 0x7FF
    elif kind == 2:
        add_event(state, tally, out, value & 0x7FF, state[AT_Y], value >> 11, t, place, word)
    elif kind == 3:
        state[AT_X], state[POLARITY] = value & 0x7FF, value >> 11
    else:
        size = 12 if kind == 4 else 8
        for bit in range(size):
            if (value >> bit) & 1:
                x = state[AT_X] + bit if state[AT_X] >= 0 else np.int64(-1)
                add_event(state, tally, out, x, state[AT_Y], state[POLARITY], t, place, word)
        if state[AT_X] >= 0:
            state[AT_X] += size


@njit(cache=True)
def _read_time_low(words: Ints, i: int, state: Ints, final: bool) -> bool:
    """Use or ignore the TIME_LOW at `i`; return False where the words that decide have not been read yet."""
    answer = ACCEPTED
    if state[LENIENT]:
        answer = check_time_low(words, i, state[HIGH], state[LOW], final)
    if answer == UNDECIDED:
        return False
    if answer == ACCEPTED:
        state[LOW] = words[i] & 0xFFF
    if answer != UNUSED:
        state[TRUSTED] = BOTH_TRUSTED if answer == ACCEPTED else HIGH_TRUSTED
    return True


@njit(cache=True)
def _count_zeros(state: Ints, tally: Ints, word: Int, place: int) -> None:
    """Count successive zero words, and report them as blank once they are a hole in the file."""
    state[ZEROS] = state[ZEROS] + 1 if word == 0 else 0
    if state[ZEROS] == _BLANK_WORDS:
        for k in range(_BLANK_WORDS - 1, 0, -1):
            count_offence(tally, BLANK, state[EVENTS], place - 2 * k, 0)
    if state[ZEROS] >= _BLANK_WORDS:
        count_offence(tally, BLANK, state[EVENTS], place, 0)
        state[AT_Y] = -1


@njit(cache=True)
def decode_evt3(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the 16-bit words of an EVT3 file.

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        Words of the file, 0 .. 65535.
    place : int
        Byte at which the first word begins.
    final : bool
        True where the file ends after these words.
    state, tally : ndarray of int64
        See `validate.validate_event`; changed in place.
    out : ndarray of EVENT_DTYPE, shape (m,)
        Buffer for the good events, m >= 12. ``state[KEPT]`` must be 0; afterwards it is the number of events.
    marks : ndarray of int64, shape (k, 3)
        Buffer for external triggers (time [us], number of the input, level), k >= 1. ``state[MARKS]`` must be 0.

    Returns
    -------
    int
        How many words were used, 0 .. n. The others are to be given again in front of those that follow.
    """
    for i in range(words.size):
        word = words[i]
        kind = word >> 12
        if state[KEPT] + 12 > out.size or state[MARKS] == len(marks):
            return i
        if kind == 8:
            if not read_time_high(words, i, state, tally, 1 << 12, final, place + 2 * i):
                return i
        elif kind == 6 and state[TRUSTED] & HIGH_TRUSTED:
            if not _read_time_low(words, i, state, final):
                return i
        elif kind == 10:
            t = (state[HIGH] << 12) | state[LOW]
            add_trigger(state, tally, marks, t, (word >> 8) & 0xF, word & 1, place + 2 * i, word)
        elif kind == VENDOR_KIND:
            state[PASSED] += 1
        elif kind == 1 or 11 <= kind <= 13:
            count_offence(tally, UNKNOWN, state[EVENTS], place + 2 * i, word)
        elif kind == 0 or 2 <= kind <= 5:
            _read_place(state, tally, out, word, place + 2 * i)
        _count_zeros(state, tally, word, place + 2 * i)
        state[KIND] = kind
    return words.size


@njit(cache=True)
def low_bits(word: Int) -> Int:
    """Return the lower 6 bits of the time in an EVT2 event."""
    return (word >> 22) & 0x3F


@njit(cache=True)
def _is_ahead_of_next(words: Ints, i: int, low: Int) -> bool:
    """Return whether an EVT2 event is later than both events after it, which do not precede the previous one."""
    n = 0
    for j in range(i + 1, min(i + 3, words.size)):
        if words[j] >> 28 > 1:
            break
        if not low <= low_bits(words[j]) < low_bits(words[i]):
            return False
        n += 1
    return n > 0


@njit(cache=True)
def decode_evt2(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the 32-bit words of an EVT2 file.

    The upper 28 bits of the time come in words of their own (TIME_HIGH) and wrap at 34 bits (4.8 h).

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        Words of the file, 0 .. 2^32 - 1.
    place, final, state, tally, out, marks
        See `decode_evt3`; here m >= 1.

    Returns
    -------
    int
        How many words were used, 0 .. n.
    """
    for i in range(words.size):
        word = words[i]
        kind = word >> 28
        if state[KEPT] + 1 > out.size or state[MARKS] == len(marks):
            return i
        if word == 0 and i + 1 == words.size and not final:
            return i
        if kind == 8:
            if not read_time_high(words, i, state, tally, 1 << 28, final, place + 4 * i):
                return i
        elif word == 0 and (state[ZEROS] or (i + 1 < words.size and words[i + 1] == 0)):
            count_offence(tally, BLANK, state[EVENTS], place + 4 * i, 0)
        elif kind < 2:
            if state[LENIENT] and i + 2 >= words.size and not final:
                return i
            t = (state[HIGH] << 6) | low_bits(word)
            low = state[LAST] & 0x3F if state[LAST] >> 6 == state[HIGH] else 0
            if state[LENIENT] and _is_ahead_of_next(words, i, low):
                count_offence(tally, MISTIMED, state[EVENTS], place + 4 * i, word)
                state[EVENTS] += 1
            else:
                add_event(state, tally, out, (word >> 11) & 0x7FF, word & 0x7FF, kind, t, place + 4 * i, word)
        elif kind == 10:
            t = (state[HIGH] << 6) | low_bits(word)
            add_trigger(state, tally, marks, t, (word >> 8) & 0x1F, word & 1, place + 4 * i, word)
        elif kind == VENDOR_KIND:
            state[PASSED] += 1
        elif kind < 14:
            count_offence(tally, UNKNOWN, state[EVENTS], place + 4 * i, word)
        state[ZEROS] = word == 0
    return words.size
