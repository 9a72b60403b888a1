"""Read the ordinary lines of a text file at once: whole numbers with one separator between them, and nothing else."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.recordings.validate import Ints

MINUS, RETURN, NEWLINE, ZERO = 45, 13, 10, 48  # characters
MAX_DIGITS = 18  # numbers of more digits may not fit into 64 bits


@njit(cache=True, nogil=True)
def parse_plain(data: npt.NDArray[np.uint8], separator: int, columns: Ints, rows: Ints) -> tuple[int, int]:
    """Read lines up to the first that is not plain.

    Parameters
    ----------
    data : ndarray of uint8, shape (n,)
        Characters, from the start of a line on.
    separator : int
        The character between two numbers.
    columns : ndarray of int64, shape (4,)
        Numbers of the columns that hold x, y, p and t, counted from 0.
    rows : ndarray of int64, shape (m, 4)
        Buffer for x, y, p and t of each line.

    Returns
    -------
    n_rows : int
        How many lines were read.
    used : int
        How many characters they have.
    """
    place_of = np.full(columns.max() + 1, -1)
    for k in range(4):
        place_of[columns[k]] = k
    n = used = i = column = 0
    while i < data.size and n < rows.shape[0]:
        sign = 1
        if data[i] == MINUS:
            sign, i = -1, i + 1
        number, first = np.int64(0), i
        while i < data.size and 0 <= data[i] - ZERO <= 9:
            number = 10 * number + (data[i] - ZERO)
            i += 1
        if not 0 < i - first <= MAX_DIGITS or i == data.size:
            break
        if column < place_of.size and place_of[column] >= 0:
            rows[n, place_of[column]] = sign * number
        column += 1
        if data[i] == RETURN and i + 1 < data.size and data[i + 1] == NEWLINE:
            i += 1
        if data[i] == NEWLINE:
            if column < place_of.size:
                break
            n, used, column = n + 1, i + 1, 0
        elif data[i] != separator:
            break
        i += 1
    return n, used
