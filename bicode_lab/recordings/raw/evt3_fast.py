"""Decode the ordinary words of an EVT3 file at the speed of memory.

`decode_plain` reads words for as long as nothing is wrong with them, and stops in front of the first word that needs
a closer look. `evt_read.decode_evt3`, which knows all rules and counts all offences, reads that word and some more.
Both keep the same state, so it makes no difference to the events or the errors which of the two has read a word.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.recordings.raw.evt_time import BOTH_TRUSTED, clock_step
from bicode_lab.recordings.validate import (
    AT_X,
    AT_Y,
    EVENTS,
    HEIGHT,
    HIGH,
    KEPT,
    KIND,
    LAST,
    LOW,
    POLARITY,
    T0,
    TRUSTED,
    WIDTH,
    ZEROS,
    Ints,
)

TURN = 1 << 12  # number of values of a TIME_HIGH
CLOSER, WAITS = -1, -2  # answers about a TIME_HIGH that is not plain
NO_WORD = 1 << 16
HOLE_WORDS = 4  # so many zero words in a row need a closer look


@njit(cache=True, nogil=True)
def decode_plain(words: npt.NDArray[np.uint16], state: Ints, out: Ints) -> tuple[int, bool]:
    """Decode EVT3 words up to the first that is not plain.

    Parameters
    ----------
    words : ndarray of uint16, shape (n,)
        Words of the file.
    state : ndarray of int64
        See `validate.validate_event`; changed in place.
    out : ndarray of int64, shape (m, 2)
        Buffer for the events as `events.words` shows them, m >= 12. ``state[KEPT]`` must be 0; afterwards it is the
        number of events.

    Returns
    -------
    used : int
        How many words were used, 0 .. n.
    waits : bool
        Whether the word after them is a TIME_HIGH that cannot be judged before there is another one.
    """
    if state[HIGH] < 0 or state[TRUSTED] != BOTH_TRUSTED:
        return 0, False
    used, waits, zeros = _decode(words, state, out)
    state[ZEROS] = zeros if not used or words[used - 1] == 0 else 0
    state[EVENTS] += state[KEPT]
    return used, waits


@njit(cache=True, nogil=True)
def _decode(words, state, out):  # type: ignore[no-untyped-def]
    """Decode plain words; return how many, whether the next one waits, and how many zero words came last.

    Words mostly come in the order TIME_LOW, ADDR_Y, ADDR_X, the first two now and then left out. So they are asked for
    in this order, which a processor foresees better than a choice between all kinds for each word.
    """
    width, height, t0 = state[WIDTH], state[HEIGHT], state[T0]
    high, low, x, y, polarity = state[HIGH], state[LOW], state[AT_X], state[AT_Y], state[POLARITY]
    last, zeros, kind = state[LAST], state[ZEROS], state[KIND]
    n, i, waits, room = 0, 0, False, out.shape[0] - 12
    t = (high << 12) | low
    while i < words.size:
        word = _word(words, i)
        now, value = word >> 12, word & 0xFFF
        if now == 6:
            low, t = value, (high << 12) | value
            kind, i = now, i + 1
            word = _word(words, i)
            now, value = word >> 12, word & 0xFFF
        if now == 0 and word != 0:
            y = value & 0x7FF
            kind, i = now, i + 1
            word = _word(words, i)
            now, value = word >> 12, word & 0xFFF
        if now == 2:
            column = value & 0x7FF
            if column >= width or y < 0 or y >= height or t < last or n > room:
                break
            out[n, 0], out[n, 1] = ((value >> 11) << 32) | (y << 16) | column, t + t0
            n, last = n + 1, t
        elif now == 4 or now == 5:
            size = 12 if now == 4 else 8
            if value:
                if x < 0 or y < 0 or y >= height or t < last or x + size > width or n > room:
                    break
                n, last = _add_vector(value, size, (polarity << 32) | (y << 16) | x, t + t0, out, n), t
            x += size if x >= 0 else 0
        elif now == 3:
            x, polarity = value & 0x7FF, value >> 11
        elif now == 8:
            step = _plain_step(words, i, high % TURN)
            waits = step == WAITS
            if step < 0:
                break
            if step:
                high, low, t = high + 1, np.int64(0), (high + 1) << 12
        elif word == 0:
            zeros = zeros + 1 if kind == 0 and (i == 0 or words[i - 1] == 0) else np.int64(1)
            if zeros >= HOLE_WORDS:
                zeros = np.int64(HOLE_WORDS - 1)
                break
            y = np.int64(0)
        elif now != 6:  # a TIME_LOW that follows another is left to the next turn
            break
        else:
            continue
        kind, i = now, i + 1
    state[HIGH], state[LOW], state[AT_X], state[AT_Y], state[POLARITY] = high, low, x, y, polarity
    state[LAST], state[KIND], state[KEPT] = last, kind, n
    return i, waits, zeros


@njit(cache=True, nogil=True)
def _add_vector(value, size, place, t, out, n):  # type: ignore[no-untyped-def]
    """Add the events of a vector whose first pixel has a place; return the number of events."""
    for bit in range(size):
        if (value >> bit) & 1:
            out[n, 0], out[n, 1] = place + bit, t
            n += 1
    return n


@njit(cache=True, nogil=True)
def _word(words, i):  # type: ignore[no-untyped-def]
    """Return a word, or one of no kind after the last."""
    return np.int64(words[i]) if i < words.size else np.int64(NO_WORD)


@njit(cache=True, nogil=True)
def _plain_step(words, i, high):  # type: ignore[no-untyped-def]
    """Return the step of the TIME_HIGH at `i`, 0 or 1; `WAITS` where the next one decides, `CLOSER` else."""
    step = clock_step(np.int64(words[i]) & 0xFFF, high, TURN)
    if step == 0:
        return 0
    for j in range(i + 1, words.size):
        if words[j] >> 12 == 8:
            later = clock_step(np.int64(words[j]) & 0xFFF, high, TURN)
            return 1 if step == 1 and later >= 1 else CLOSER
    return WAITS
