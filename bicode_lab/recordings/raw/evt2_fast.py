"""Decode the ordinary words of an EVT2 file at the speed of memory, as `evt3_fast` does for EVT3."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.recordings.raw.evt_time import BOTH_TRUSTED, clock_step
from bicode_lab.recordings.validate import EVENTS, HEIGHT, HIGH, KEPT, LAST, LOW, T0, TRUSTED, WIDTH, ZEROS, Ints

TURN = 1 << 28  # number of values of a TIME_HIGH
NONE = -TURN


@njit(cache=True, nogil=True)
def decode_plain(words: npt.NDArray[np.uint32], state: Ints, out: Ints) -> tuple[int, bool]:
    """Decode EVT2 words up to the first that is not plain.

    Parameters
    ----------
    words : ndarray of uint32, shape (n,)
        Words of the file.
    state, out : ndarray of int64
        See `evt3_fast.decode_plain`.

    Returns
    -------
    used : int
        How many words were used, 0 .. n.
    waits : bool
        Whether the word after them is a TIME_HIGH that cannot be judged before there is another one.
    """
    width, height, t0 = state[WIDTH], state[HEIGHT], state[T0]
    high, low, last = state[HIGH], state[LOW], state[LAST]
    if high < 0 or state[TRUSTED] != BOTH_TRUSTED:
        return 0, False
    n, used, waits = 0, words.size, False
    for i in range(words.size):
        word = np.int64(words[i])
        kind = word >> 28
        if kind < 2:
            x, y = (word >> 11) & 0x7FF, word & 0x7FF
            t = (high << 6) | ((word >> 22) & 0x3F)
            if word == 0 or x >= width or y >= height or t < last or n == out.shape[0]:
                used = i
                break
            out[n, 0], out[n, 1] = (kind << 32) | (y << 16) | x, t + t0
            n += 1
            last = t
        elif kind == 8:
            step = clock_step(word & (TURN - 1), high % TURN, TURN)
            if step:
                later = _next_high(words, i, high % TURN)
                waits = later == NONE
                if step != 1 or later < 1:
                    used = i
                    break
                high += 1
                low = np.int64(0)
        else:
            used = i
            break
    state[HIGH], state[LOW], state[LAST], state[KEPT] = high, low, last, n
    if used:
        state[ZEROS] = 0
    state[EVENTS] += n
    return used, waits


@njit(cache=True, nogil=True)
def _next_high(words, i, high):  # type: ignore[no-untyped-def]
    """Return the step from a value to the next TIME_HIGH after word `i`; `NONE` where there is none."""
    for j in range(i + 1, words.size):
        if words[j] >> 28 == 8:
            return clock_step(np.int64(words[j]) & (TURN - 1), high, TURN)
    return np.int64(NONE)
