"""Decode and validate the events of DAT and Event Stream (ES) files.

faery reads these formats, too, but reports little of what is wrong with a file: it holds a backward time at the
previous value, drops the end of a cut event, and stops at a bad coordinate without saying where.
"""

from __future__ import annotations

from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recordings.validate import (
    BLANK,
    EVENTS,
    HEIGHT,
    HIGH,
    KEPT,
    LOW,
    MISTIMED,
    ZEROS,
    Int,
    Ints,
    count_offence,
    validate_event,
)

FAR_US = 1 << 22
"""A time that is further than this (4.2 s) from both its neighbours, which are near each other, is damaged."""


@njit(cache=True)
def _clock_distance(a: Int, b: Int) -> Int:
    """Return how far two readings of a 32-bit clock lie apart, the shorter way round [us]."""
    distance = (a - b) & 0xFFFFFFFF
    return min(distance, (1 << 32) - distance)


@njit(cache=True)
def _is_far_off(words: Ints, i: int, state: Ints) -> bool:
    """Return whether the time of an event is far from both its neighbours, which are near each other."""
    if state[EVENTS] == 0 or i + 1 == words.size:
        return False
    here, after, before = words[i] & 0xFFFFFFFF, words[i + 1] & 0xFFFFFFFF, state[LOW]
    if _clock_distance(before, after) > FAR_US:
        return False
    return bool(min(_clock_distance(here, before), _clock_distance(here, after)) > FAR_US)


@njit(cache=True)
def decode_dat(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the 64-bit words of a DAT file.

    A word holds 32 bits of time, 14 of x, 14 of y and 4 of polarity, from the lowest bit up. The time wraps after
    2^32 us (71.6 min).

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        Words of the file.
    place : int
        Byte at which the first word begins.
    final : bool
        True where the file ends after these words.
    state, tally : ndarray of int64
        See `validate.validate_event`; changed in place.
    out : ndarray of EVENT_DTYPE, shape (m,)
        Buffer for the good events, m >= 1.
    marks : ndarray
        Not used: these formats hold no external triggers.

    Returns
    -------
    int
        How many words were used, 0 .. n. The others are to be given again in front of those that follow.
    """
    for i in range(words.size):
        word = words[i]
        if state[KEPT] == out.size or (i + 1 == words.size and not final):
            return i
        low = word & 0xFFFFFFFF
        if word == 0 and (state[ZEROS] or (i + 1 < words.size and words[i + 1] == 0)):
            count_offence(tally, BLANK, state[EVENTS], place + 8 * i, 0)
            state[EVENTS] += 1
        elif _is_far_off(words, i, state):
            count_offence(tally, MISTIMED, state[EVENTS], place + 8 * i, low)
            state[EVENTS] += 1
        else:
            if state[LOW] - low > 1 << 31:
                state[HIGH] += 1
            state[LOW] = low
            x, y, p = (word >> 32) & 0x3FFF, (word >> 46) & 0x3FFF, (word >> 60) & 0xF
            validate_event(state, tally, out, x, y, p, ((state[HIGH] + 1) << 32) + low, place + 8 * i)
        state[ZEROS] = word == 0
    return words.size


@njit(cache=True)
def _five_zeros(data: Ints, i: int) -> bool:
    """Return whether the five bytes from `i` on are all zero."""
    return i + 5 <= data.size and not data[i : i + 5].any()


@njit(cache=True)
def _decode_es(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, atis: bool) -> int:
    """Decode Event Stream bytes: 5 per event, with times as steps; single bytes only lengthen the step."""
    i = 0
    while i < data.size:
        if state[KEPT] == out.size:
            return i
        first = data[i]
        if (first >= 0xFC) if atis else (first >= 0xFE):
            state[LOW] += (first & 3) * 63 if atis else (127 if first == 0xFE else 0)
            i += 1
            continue
        if i + 5 > data.size or (not final and i + 10 > data.size):
            break
        state[LOW] += first >> 2 if atis else first >> 1
        zeros = _five_zeros(data, i)
        if zeros and (state[ZEROS] or _five_zeros(data, i + 5)):
            count_offence(tally, BLANK, state[EVENTS], place + i, 0)
            state[EVENTS] += 1
        elif not (atis and first & 1):  # exposure measurements are not contrast events
            x = data[i + 1] | data[i + 2] << 8
            y = state[HEIGHT] - 1 - (data[i + 3] | data[i + 4] << 8)  # rows are counted from the bottom
            p = (first >> 1) & 1 if atis else first & 1
            validate_event(state, tally, out, x, y, p, state[LOW], place + i)
        state[ZEROS] = zeros
        i += 5
    return i


@njit(cache=True)
def decode_es(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the bytes of an Event Stream of type DVS.

    Parameters
    ----------
    data : ndarray of int64, shape (n,)
        Bytes of the file, 0 .. 255.
    place, final, state, tally, out, marks
        See `decode_dat`.

    Returns
    -------
    int
        How many bytes were used, 0 .. n.
    """
    return _decode_es(data, place, final, state, tally, out, False)


@njit(cache=True)
def decode_atis(data: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the bytes of an Event Stream of type ATIS; its exposure measurements are left out.

    Parameters
    ----------
    data, place, final, state, tally, out, marks
        See `decode_es`.

    Returns
    -------
    int
        How many bytes were used, 0 .. n.
    """
    return _decode_es(data, place, final, state, tally, out, True)
