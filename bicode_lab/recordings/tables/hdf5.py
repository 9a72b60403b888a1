"""Read HDF5 files with events, however they are laid out, and write this project's own layout.

Its own: group ``events`` with the data sets x, y, p and t [us], and the attributes ``width`` and ``height`` of the
group. The columns grow chunk by chunk; they are compressed with gzip, which every HDF5 library reads, and have
checksums. Other layouts are found by the names of their data sets, in any group: x, y, p, t (DSEC, M3ED), xs, ys, ts,
ps, one data set with such fields (the vendor's ``CD/events``), one of N rows and 4 columns (MVSEC, v2e).
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
from bicode_lab.recordings.formats import Header, RecordingError, damaged
from bicode_lab.recordings.tables.columns import Array, Table, check_kind, check_sizes, read_table
from bicode_lab.recordings.tables.ecf import read_ecf_rows
from bicode_lab.recordings.tables.hdf5_layout import Place, check_filters, check_stored, find_place, is_ecf

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

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with path.open("w+b", buffering=0) as raw:
        sink = _Sink(raw)
        _write(sink, chunks, width, height)
        if sink.error is not None:
            raise sink.error


class _Sink:
    """A file that keeps an error to itself: the HDF5 library does not survive a write that fails.

    Parameters
    ----------
    raw : file
        Open for reading and writing, without a buffer.

    Attributes
    ----------
    error : OSError or None
        The first error of a write; what comes after it is not written.
    """

    def __init__(self, raw: Any) -> None:
        self._raw = raw
        self.error: OSError | None = None
        self.seek, self.tell, self.flush, self.read = raw.seek, raw.tell, raw.flush, raw.read

    def write(self, data: Any) -> int:
        """Write some bytes, and return how many there were."""
        rest = memoryview(data).cast("B")
        size = rest.nbytes
        try:
            while self.error is None and rest.nbytes:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self.error = error
        return size

    def readinto(self, data: Any) -> int:
        """Read bytes that were written; zeros in the place of those that could not be."""
        part = memoryview(data).cast("B")
        n = self._raw.readinto(part)
        part[n:] = bytes(part.nbytes - n)
        return part.nbytes

    def truncate(self, size: int | None = None) -> int:
        """Set the length of the file."""
        try:
            return int(self._raw.truncate(size))
        except OSError as error:
            self.error = self.error or error
            return size or 0


def _write(sink: _Sink, chunks: Iterator[Events], width: int, height: int) -> None:
    """Write events until there are no more, or until the disk takes no more."""
    with h5py.File(sink, "w", libver=("v110", "v110")) as file:
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
            if sink.error is not None:
                return


def read_hdf5_header(path: Path) -> Header:
    """Return the header of an HDF5 file, after checking that events are in it and can be unpacked.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    Header
        Its layout is a `Place`.

    Raises
    ------
    RecordingError
        If the file is damaged or open elsewhere, columns are missing or of another kind, the size is not made of
        integers, or the data are compressed in a way that cannot be undone here.
    """
    with _opened(path) as file:
        place = find_place(path, file)
        group = file[place.group]
        for name in place.data_sets:
            check_filters(path, group[name])
            check_stored(path, group[name])
        if not place.table.whole:
            for name in place.table.names or ():
                check_kind(path, "column", name, group[name].dtype, group[name].shape)
            check_sizes(path, "columns", [group[name].size for name in place.data_sets])
    return Header(format="HDF5", size_px=place.size_px, layout=place)


def read_hdf5(path: Path, decoder: Decoder) -> Iterator[Events]:
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
    place: Place = decoder.header.layout
    if place.others:
        decoder.remark(f"reads the events of {place.group}; the file also holds those of {', '.join(place.others)}")
    with _opened(path) as file:
        if place.triggers:
            rows = file[place.triggers][:]
            decoder.add_triggers(np.stack([rows[name].astype(np.int64) for name in ("t", "id", "p")], axis=1))
        n_events = len(file[place.group][place.data_sets[0]])

    def part(name: str, rows: slice) -> Array:
        with _opened(path) as file:
            data_set = file[place.group][name]
            return read_ecf_rows(data_set, rows) if is_ecf(data_set) else np.asarray(data_set[rows])

    table: Table = place.table
    yield from read_table(decoder, table, n_events, part)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file, and raise RecordingError where it is damaged or open in another program."""
    try:
        with h5py.File(path, "r") as file:
            yield file
    except RecordingError:
        raise
    except Exception as error:  # a damaged structure can make h5py raise almost anything
        words = " ".join(str(error).split())
        if "unable to lock file" in words:
            raise RecordingError(
                f"{path}: open for writing in another program; close it there first (if none has it open, the disk may "
                "not know locks: set HDF5_USE_FILE_LOCKING=FALSE)"
            ) from None
        if "already open for" in words or "consistency flags" in words:
            raise RecordingError(
                f"{path}: marked as open for writing: a program still writes it, or was stopped; close that program, "
                "or clear the mark with: h5clear -s"
            ) from None
        raise damaged(path, error) from None
