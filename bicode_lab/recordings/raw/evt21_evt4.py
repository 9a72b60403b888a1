"""Decode the newer of the vendor's RAW formats: EVT2.1 (64-bit words) and EVT4 (32-bit words).

Both tell in one go which of 32 neighbouring columns fired. The upper half of an EVT2.1 word is laid out as an EVT2
word, and its lower half has one bit for each column. An EVT4 word of kind 12 or 13 is followed by a word with these
bits. Both have TIME_HIGH words with the upper 28 bits of the time, and 6 lower bits in each other word.

Facts: docs.prophesee.ai, "Encoding formats", and the public headers of OpenEB (``evt21_event_types.h``,
``evt4_event_types.h``).
"""

from __future__ import annotations

import numpy as np

from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recordings.raw.evt_read import VENDOR_KIND, add_event, add_trigger, low_bits
from bicode_lab.recordings.raw.evt_time import read_time_high
from bicode_lab.recordings.validate import (
    BLANK,
    EVENTS,
    HIGH,
    KEPT,
    MARKS,
    PASSED,
    UNKNOWN,
    ZEROS,
    Int,
    Ints,
    count_offence,
)

_COLUMNS = 32  # of one vector


@njit(cache=True)
def _add_vector(state: Ints, tally: Ints, out: Events, word: Int, bits: Int, p: Int, place: Int) -> None:
    """Validate the events of a vector: one for each bit that is set, from the column of `word` on."""
    t = (state[HIGH] << 6) | low_bits(word)
    for column in range(_COLUMNS):
        if (bits >> column) & 1:
            add_event(state, tally, out, ((word >> 11) & 0x7FF) + column, word & 0x7FF, p, t, place, word)


@njit(cache=True)
def decode_evt21(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the 64-bit words of an EVT2.1 file.

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        Words of the file, the half with the kind uppermost.
    place, final, state, tally, out, marks
        See `evt_read.decode_evt3`; here m >= 32.

    Returns
    -------
    int
        How many words were used, 0 .. n.
    """
    upper = (words >> 32) & 0xFFFFFFFF
    for i in range(words.size):
        word = upper[i]
        kind = word >> 28
        if state[KEPT] + _COLUMNS > out.size or state[MARKS] == len(marks):
            return i
        blank = words[i] == 0
        if blank and i + 1 == words.size and not final:
            return i
        if kind == 8:
            if not read_time_high(upper, i, state, tally, 1 << 28, final, place + 8 * i):
                return i
        elif blank and (state[ZEROS] or (i + 1 < words.size and words[i + 1] == 0)):
            count_offence(tally, BLANK, state[EVENTS], place + 8 * i, 0)
        elif kind < 2:
            _add_vector(state, tally, out, word, words[i] & 0xFFFFFFFF, kind, place + 8 * i)
        elif kind == 10:
            t = (state[HIGH] << 6) | low_bits(word)
            add_trigger(state, tally, marks, t, (word >> 8) & 0x1F, word & 1, place + 8 * i, word)
        elif kind == VENDOR_KIND:
            state[PASSED] += 1
        elif kind < 14:
            count_offence(tally, UNKNOWN, state[EVENTS], place + 8 * i, word)
        state[ZEROS] = blank
    return words.size


@njit(cache=True)
def _as_evt2_times(words: Ints) -> Ints:
    """Return the TIME_HIGH words of EVT4 as those of EVT2, and 0 for all other words, bits of a vector included."""
    times = np.zeros(words.size, np.int64)
    is_bits = False
    for i in range(words.size):
        kind = words[i] >> 28
        if is_bits:
            is_bits = False
        elif kind == 14:
            times[i] = 0x80000000 | (words[i] & 0xFFFFFFF)
        else:
            is_bits = kind == 12 or kind == 13
    return times


@njit(cache=True)
def decode_evt4(words: Ints, place: int, final: bool, state: Ints, tally: Ints, out: Events, marks: Ints) -> int:
    """Decode the 32-bit words of an EVT4 file.

    Parameters
    ----------
    words : ndarray of int64, shape (n,)
        Words of the file, 0 .. 2^32 - 1.
    place, final, state, tally, out, marks
        See `evt_read.decode_evt3`; here m >= 32.

    Returns
    -------
    int
        How many words were used, 0 .. n.
    """
    times = _as_evt2_times(words)
    i = 0
    while i < words.size:
        word = words[i]
        kind = word >> 28
        if state[KEPT] + _COLUMNS > out.size or state[MARKS] == len(marks):
            return i
        if kind == 14:
            if not read_time_high(times, i, state, tally, 1 << 28, final, place + 4 * i):
                return i
        elif kind == 12 or kind == 13:
            if i + 1 == words.size:
                return i
            _add_vector(state, tally, out, word, words[i + 1], kind & 1, place + 4 * i)
            i += 1
        elif kind == 10 or kind == 11:
            _add_vector(state, tally, out, word, 1, kind & 1, place + 4 * i)
        elif kind == 9:
            t = (state[HIGH] << 6) | low_bits(word)
            add_trigger(state, tally, marks, t, (word >> 8) & 0x1F, word & 1, place + 4 * i, word)
        elif word == 0:
            count_offence(tally, BLANK, state[EVENTS], place + 4 * i, 0)
        elif kind < 6 or kind == 8:
            count_offence(tally, UNKNOWN, state[EVENTS], place + 4 * i, word)
        i += 1
    return words.size
