"""Read npy files: one array with fields x, y, p and t, or of N rows and 4 columns."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError, damaged
from bicode_lab.recordings.tables.columns import Array, find_table, read_table


def read_npy_header(path: Path) -> Header:
    """Return the header of an npy file, after checking that it holds events.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    Header
        Its layout is a `Table`.

    Raises
    ------
    RecordingError
        If the file is damaged, or holds something else.
    """
    array = _opened(path)
    table = find_table({"events": (array.dtype, array.shape)})
    if table is None or (table.names and array.ndim != 1):
        found = f"{array.dtype} of shape {array.shape}"[:120]
        raise RecordingError(f"{path}: holds {found}; give fields x, y, p and t, or 4 columns")
    return Header(format="npy", layout=table)


def read_npy(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an npy file in pieces, in bounded memory.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0
    """
    array = _opened(path)
    yield from read_table(decoder, decoder.header.layout, len(array), lambda _, rows: np.array(array[rows]))


def _opened(path: Path) -> Array:
    """Return the array of an npy file, of which no more is read than is used."""
    try:
        return np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    except Exception as error:  # a damaged header can make numpy raise almost anything
        raise damaged(path, error) from None
