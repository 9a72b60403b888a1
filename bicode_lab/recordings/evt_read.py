"""The vendor's RAW formats read   16-bit (EVT3) or 32-bit (EVT2) words -> events

EVT3 time: TIME_HIGH is authoritative. A new one sets the low 12 bits to zero, a
TIME_LOW that steps back is no wrap, and TIME_HIGH itself wraps at 24 bits (16.78 s): a
step by more than half a turn goes the other way round. Real sensors send steps back: a
Gen4.1 one sends now and then a TIME_LOW up to 11 us ahead and corrects it in the next
word. No event comes between the two, so the events themselves never step back.

A TIME_HIGH that those after it contradict is damage. Reading leniently it is mended
where its neighbours say what it was, or else not believed, nor is such a TIME_LOW, and
the events under it are dropped: one flipped bit would otherwise carry the clock ahead
by up to a turn, and every event after it would seem to step back.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bicode_lab.events import Events
from bicode_lab.recordings.validate import (
    AT_X,
    AT_Y,
    BLANK,
    DOUBTFUL,
    EVENTS,
    HIGH,
    KEPT,
    KIND,
    LAST,
    LENIENT,
    LOW,
    MISTIMED,
    POLARITY,
    TRUSTED,
    UNKNOWN,
    UNPLACED,
    UNTIMED,
    ZEROS,
    Int,
    Ints,
    judge,
    note,
)

_WITNESSES = 5
"""So many later time words say whether one is to be believed."""
_NEAR_STEPS = 16
"""A time word that goes on no further than this from another speaks for it."""
_SMALL_STEP_US = 16
"""A TIME_LOW that goes no further needs one witness only."""
_BLANK_WORDS = 4
"""So many zero words in a row are no row numbers but a hole in the file."""
_NO, _YES, _IDLE, _MORE = range(
    4
)  # may a time word be believed; _IDLE: no event is under it, _MORE: cannot be seen yet
_BOTH = 3  # state[TRUSTED]: 1 where TIME_HIGH is believed, 2 where TIME_LOW is


@njit(cache=True)
def _step(value: Int, high: Int, turn: Int) -> Int:
    """From one time word to another, the short way round a clock of `turn` steps."""
    step = (value - high) % turn
    return step - turn if step >= turn // 2 else step


@njit(cache=True)
def _weigh_high(words: Ints, i: int, high: Int, turn: Int, final: bool) -> tuple[int, Int]:
    """Do the next time words agree that the clock went where the one at `i` says? Also, where it went if not."""
    first = high < 0
    value = words[i] % turn
    high = value if first else high
    step = _step(value, high, turn)
    witnesses, against = 0, 0
    nearest: Int = -1
    for j in range(i + 1, words.size):
        if words[j] // turn != 8:
            continue
        later = _step(words[j] % turn, high, turn)
        if witnesses == 0 and 0 <= step <= 1 and later >= step:
            return _YES, value
        if nearest < 0 and 0 <= later <= 2:
            nearest = later
        witnesses += 1
        if (later < step) if first else (0 <= later < step or step < 0 <= later):
            against += 1
        elif step <= later <= step + _NEAR_STEPS:  # two damaged words seldom agree
            against -= 1
        if witnesses == _WITNESSES:
            break
    if witnesses < _WITNESSES and not final:
        return _MORE, value
    if against <= 0 and (witnesses or step >= 0):
        return _YES, value
    if first or nearest < 0:
        return _NO, value
    return _YES, (high + nearest // 2) % turn  # the clock stands, or this word was the one between two others


@njit(cache=True)
def _believe_low(words: Ints, i: int, high: Int, low: Int, final: bool) -> int:
    """The same for a TIME_LOW, which speaks for the events up to the next time word."""
    value = words[i] & 0xFFF
    witnesses = 0
    against: Int = 0
    under = False
    pending: Int = -1
    for j in range(i + 1, words.size):
        kind, other = words[j] >> 12, words[j] & 0xFFF
        if kind == 2 or kind == 4 or kind == 5:
            under = True
            if pending < 0:
                continue
            if pending >= value >= low and value - low <= _SMALL_STEP_US and witnesses == 0:
                return _YES
            witnesses += 1
            against += (low <= pending < value) if value >= low else (pending >= low)
            pending = -1
            if witnesses == _WITNESSES:
                break
        elif kind == 6 and not under:
            return _IDLE
        elif kind == 8 and other != high & 0xFFF and not under:
            return _YES if value >= low else _IDLE  # if that one is true, it sets the low bits anew
        elif kind == 6:
            pending = other
        elif kind == 8 and other != high & 0xFFF:
            witnesses += 1
            against += value < low
            break
    else:
        if not final:
            return _MORE
    if witnesses == 0:
        return _YES if value >= low else _NO
    return _NO if 2 * against > witnesses else _YES


@njit(cache=True)
def _go_to(state: Ints, value: Int, turn: Int, believed: int) -> None:
    """Take a TIME_HIGH, or do not believe it."""
    if believed == _NO:
        state[TRUSTED] = 0
        return
    step = _step(value, state[HIGH], turn) if state[HIGH] >= 0 else value + 1
    state[TRUSTED] |= 1
    if step:
        state[HIGH] += step
        if state[HIGH] < 0:
            state[HIGH] += turn
        state[LOW], state[TRUSTED] = 0, _BOTH


@njit(cache=True)
def _take_high(words: Ints, i: int, state: Ints, tally: Ints, turn: int, final: bool, place: int) -> bool:
    """Take, mend or leave the TIME_HIGH at `i`; False where the words that tell are not read yet."""
    value = words[i] % turn
    believed, mended = _YES, value
    if state[HIGH] < 0 or value != state[HIGH] % turn:
        believed, mended = _weigh_high(words, i, state[HIGH], turn, final)
    if believed == _MORE:
        return False
    if believed == _NO or mended != value:
        note(tally, DOUBTFUL, state[EVENTS], place, words[i])
    if state[LENIENT]:
        _go_to(state, mended, turn, believed)
    else:
        _go_to(state, value, turn, _YES)
    return True


@njit(cache=True)
def _offence(state: Ints, x: Int, y: Int) -> int:
    """The rule an event breaks before it can be judged, or -1."""
    if state[HIGH] < 0:
        return UNTIMED
    if x < 0 or y < 0:
        return UNPLACED
    return -1 if state[TRUSTED] == _BOTH else MISTIMED


@njit(cache=True)
def _event(state: Ints, tally: Ints, out: Events, x: Int, y: Int, p: Int, t: Int, place: Int, word: Int) -> None:
    """One event, if its time and place are known."""
    rule = _offence(state, x, y)
    if rule < 0:
        judge(state, tally, out, x, y, p, t, place)
    else:
        note(tally, rule, state[EVENTS], place, word)
        state[EVENTS] += 1


@njit(cache=True)
def _place3(state: Ints, tally: Ints, out: Events, word: Int, where: int) -> None:
    """An EVT3 word that says where: a row, an event, a vector's base or 12 or 8 pixels of it."""
    kind, value = word >> 12, word & 0xFFF
    t = (state[HIGH] << 12) | state[LOW]
    if kind == 0:
        state[AT_Y] = value & 0x7FF
    elif kind == 2:
        _event(state, tally, out, value & 0x7FF, state[AT_Y], value >> 11, t, where, word)
    elif kind == 3:
        state[AT_X], state[POLARITY] = value & 0x7FF, value >> 11
    else:
        size = 12 if kind == 4 else 8
        for bit in range(size):
            if (value >> bit) & 1:
                x = state[AT_X] + bit if state[AT_X] >= 0 else np.int64(-1)
                _event(state, tally, out, x, state[AT_Y], state[POLARITY], t, where, word)
        if state[AT_X] >= 0:
            state[AT_X] += size


@njit(cache=True)
def _count_zeros(state: Ints, tally: Ints, word: Int, where: int) -> None:
    """Zero words are row 0, but many in a row are a hole in the file."""
    state[ZEROS] = state[ZEROS] + 1 if word == 0 else 0
    if state[ZEROS] == _BLANK_WORDS:
        for k in range(_BLANK_WORDS - 1, 0, -1):
            note(tally, BLANK, state[EVENTS], where - 2 * k, 0)
    if state[ZEROS] >= _BLANK_WORDS:
        note(tally, BLANK, state[EVENTS], where, 0)
        state[AT_Y] = -1


@njit(cache=True)
def decode_evt3(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events) -> int:
    """EVT3 words, the first at byte `place`, in; good events in `out`, and how many words were used out."""
    for i in range(words.size):
        word = words[i]
        kind, value = word >> 12, word & 0xFFF
        if state[KEPT] + 12 > out.size:
            return i
        if kind == 8:
            if not _take_high(words, i, state, tally, 1 << 12, final, place + 2 * i):
                return i
        elif kind == 6 and state[TRUSTED] & 1:
            believed = _YES
            if state[LENIENT]:
                believed = _believe_low(words, i, state[HIGH], state[LOW], final)
            if believed == _MORE:
                return i
            if believed == _YES:
                state[LOW] = value
            if believed != _IDLE:
                state[TRUSTED] = _BOTH if believed == _YES else 1
        elif kind == 1 or kind == 9 or 11 <= kind <= 13:
            note(tally, UNKNOWN, state[EVENTS], place + 2 * i, word)
        elif kind == 0 or 2 <= kind <= 5:
            _place3(state, tally, out, word, place + 2 * i)
        _count_zeros(state, tally, word, place + 2 * i)
        state[KIND] = kind
    return words.size


@njit(cache=True)
def _low2(word: Int) -> Int:
    """The lower 6 bits of the time in an EVT2 event."""
    return (word >> 22) & 0x3F


@njit(cache=True)
def _alone_ahead(words: Ints, i: int, low: Int) -> bool:
    """Is this EVT2 event ahead of both that follow it, though they are not before the last one?"""
    n = 0
    for j in range(i + 1, min(i + 3, words.size)):
        if words[j] >> 28 > 1:
            break
        if not low <= _low2(words[j]) < _low2(words[i]):
            return False
        n += 1
    return n > 0


@njit(cache=True)
def decode_evt2(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events) -> int:
    """The same for EVT2: the upper 28 bits of the time come in words of their own and wrap at 34 bits."""
    for i in range(words.size):
        word = words[i]
        kind = word >> 28
        if state[KEPT] + 1 > out.size or (word == 0 and i + 1 == words.size and not final):
            return i
        if kind == 8:
            if not _take_high(words, i, state, tally, 1 << 28, final, place + 4 * i):
                return i
        elif word == 0 and (state[ZEROS] or (i + 1 < words.size and words[i + 1] == 0)):
            note(tally, BLANK, state[EVENTS], place + 4 * i, 0)
        elif kind < 2:
            if state[LENIENT] and i + 2 >= words.size and not final:
                return i
            t = (state[HIGH] << 6) | _low2(word)
            if state[LENIENT] and _alone_ahead(words, i, state[LAST] & 0x3F if state[LAST] >> 6 == state[HIGH] else 0):
                note(tally, MISTIMED, state[EVENTS], place + 4 * i, word)
                state[EVENTS] += 1
            else:
                _event(state, tally, out, (word >> 11) & 0x7FF, word & 0x7FF, kind, t, place + 4 * i, word)
        elif kind != 10 and kind < 14:
            note(tally, UNKNOWN, state[EVENTS], place + 4 * i, word)
        state[ZEROS] = word == 0
    return words.size
