"""Decode the ordinary words of a DAT file at the speed of memory, as `evt3_fast` does for EVT3."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.recordings.raw.dat_es import FAR_US
from bicode_lab.recordings.validate import EVENTS, HEIGHT, HIGH, KEPT, LAST, LOW, T0, WIDTH, ZEROS, Ints


@njit(cache=True, nogil=True)
def decode_plain(words: npt.NDArray[np.uint64], state: Ints, out: Ints) -> tuple[int, bool]:
    """Decode DAT words up to the first that is not plain.

    Parameters
    ----------
    words : ndarray of uint64, shape (n,)
        Words of the file.
    state, out : ndarray of int64
        See `evt3_fast.decode_plain`.

    Returns
    -------
    used : int
        How many words were used, 0 .. n - 1: whether a word is plain may depend on the one after it.
    waits : bool
        Whether the word after them is the last one.
    """
    if state[EVENTS] == 0:
        return 0, False
    width, height, t0, last, before = state[WIDTH], state[HEIGHT], state[T0], state[LAST], state[LOW]
    turn = (state[HIGH] + 1) << 32
    n = 0
    for i in range(min(words.size - 1, out.shape[0])):
        word = np.int64(words[i])
        low, x, y, p = word & 0xFFFFFFFF, (word >> 32) & 0x3FFF, (word >> 46) & 0x3FFF, (word >> 60) & 0xF
        t = turn + low
        if word == 0 or p > 1 or x >= width or y >= height or t < last or not 0 <= low - before <= FAR_US:
            break
        out[n, 0], out[n, 1] = (p << 32) | (y << 16) | x, t + t0
        n += 1
        last, before = t, low
    state[LAST], state[LOW], state[KEPT] = last, before, n
    state[EVENTS] += n
    if n:
        state[ZEROS] = 0
    return n, n == words.size - 1
