"""Read and write HDF5 files with events in columns: group ``events`` with the data sets x, y, p and t [us].

The attributes ``width`` and ``height`` of the group hold the sensor size. The columns grow chunk by chunk. They are
compressed with gzip, which every HDF5 library reads, and have checksums.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bicode_lab.events import Events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError

_PIECE_EVENTS = 1 << 18
_CHUNK_EVENTS = 1 << 16
_COLUMNS = {"x": "<u2", "y": "<u2", "p": "u1", "t": "<i8"}


def write_hdf5(path: Path, chunks: Iterator[Events], width: int, height: int) -> None:
    """Write events to an HDF5 file, chunk by chunk.

    Parameters
    ----------
    path : Path
        The file to write; a file of that name is replaced.
    chunks : iterator of ndarray of EVENT_DTYPE, shape (n,)
        Valid events in the order of time.
    width, height : int
        Sensor size [px].
    """
    with h5py.File(path, "w", libver=("v110", "v110")) as file:
        group = file.create_group("events")
        group.attrs["width"], group.attrs["height"] = np.int64(width), np.int64(height)
        columns = {
            name: group.create_dataset(
                name,
                (0,),
                kind,
                maxshape=(None,),
                chunks=(_CHUNK_EVENTS,),
                compression=1,
                shuffle=True,
                fletcher32=True,
            )
            for name, kind in _COLUMNS.items()
        }
        columns["t"].attrs["unit"] = "us"
        n = 0
        for chunk in chunks:
            for name, column in columns.items():
                column.resize(n + chunk.size, axis=0)
                column[n:] = chunk[name]
            n += chunk.size


def read_hdf5_header(path: Path) -> Header:
    """Return the header of an HDF5 file, after checking that it holds four columns of integers.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    Header

    Raises
    ------
    RecordingError
        If the file is damaged, a column is missing or of another kind, or the size is not made of integers.
    """
    with _opened(path) as file:
        group = file["events"] if isinstance(file.get("events"), h5py.Group) else file
        columns = {name: column for name in "xypt" if isinstance(column := group.get(name), h5py.Dataset)}
        if missing := [name for name in "xypt" if name not in columns]:
            has = ", ".join(sorted(group))[:100] or "nothing"
            raise RecordingError(f"{path}: columns missing: {', '.join(missing)} (found: {has}); give x, y, p, t")
        for name, column in columns.items():
            if column.dtype.kind not in "iub" or column.ndim != 1:
                found = f"{column.dtype} of shape {column.shape}"
                raise RecordingError(
                    f"{path}: column {name} is {found}; store whole numbers (t in us) in one dimension"
                )
        sizes = [column.size for column in columns.values()]
        if len(set(sizes)) > 1:
            raise RecordingError(f"{path}: columns x, y, p, t have {sizes} entries; give one of each per event")
        width, height = (group.attrs.get(side) for side in ("width", "height"))
    if width is None or height is None:
        return Header(format="HDF5")
    if not all(isinstance(side, np.integer) for side in (width, height)):
        raise RecordingError(f"{path}: width and height are not whole numbers; store one integer each [px]")
    return Header(format="HDF5", size_px=(int(width), int(height)))


def read_hdf5_pieces(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an HDF5 file in pieces, in bounded memory.

    Parameters
    ----------
    path : Path
        The file to read.
    decoder : Decoder
        It validates the events.

    Yields
    ------
    ndarray of EVENT_DTYPE, shape (n,), n >= 0

    Raises
    ------
    RecordingError
        If the file is damaged, or in strict reading at the first offence.
    """
    start, size = 0, 1
    while start < size:
        with _opened(path) as file:
            group = file["events"] if isinstance(file.get("events"), h5py.Group) else file
            size = group["t"].size
            columns = [group[name][start : start + _PIECE_EVENTS] for name in "xypt"]
        piece = decoder.filter((columns[0], columns[1], columns[2], columns[3]))
        if decoder.lenient or not decoder.tally.any():  # in strict reading the rest is only counted
            yield piece
        start += _PIECE_EVENTS
    decoder.raise_offence()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file, and raise RecordingError where it is damaged."""
    try:
        with h5py.File(path, "r") as file:
            yield file
    except RecordingError:
        raise
    except Exception as error:  # a damaged structure can make h5py raise almost anything
        words = " ".join(str(error).split())[:100]
        raise RecordingError(f"{path}: damaged or cut short ({words}); write or copy it again") from None
