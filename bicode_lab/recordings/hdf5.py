"""Events in columns of an HDF5 file: group `events` with x, y, p, t (us), its attributes width and height.

The columns grow with the chunks that come and are compressed with gzip, which every
HDF5 library reads; checksums lie over data and structure.
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
    """A path and checked chunks in time order in; an HDF5 file of four columns out."""
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
    """A path in, the size out, after it was seen that the file holds four columns of whole numbers."""
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
    """A path in, its good events in pieces out, in bounded memory."""
    start, size = 0, 1
    while start < size:
        with _opened(path) as file:
            group = file["events"] if isinstance(file.get("events"), h5py.Group) else file
            size = group["t"].size
            columns = [group[name][start : start + _PIECE_EVENTS] for name in "xypt"]
        piece = decoder.filter((columns[0], columns[1], columns[2], columns[3]))
        if decoder.lenient or not decoder.tally.any():  # strictly, the first offence ends it; the rest is counted
            yield piece
        start += _PIECE_EVENTS
    decoder.complain()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A path in, the open file out, with its damage in words."""
    try:
        with h5py.File(path, "r") as file:
            yield file
    except RecordingError:
        raise
    except Exception as error:  # a damaged structure can make h5py raise almost anything
        words = " ".join(str(error).split())[:100]
        raise RecordingError(f"{path}: damaged or cut short ({words}); write or copy it again") from None
