"""Read npz files, and write this project's own: the arrays x, y, p, t [us], and width and height [px]."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import Events, check_events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError, whole_file, words_of
from bicode_lab.recordings.tables.columns import (
    Array,
    Table,
    check_kind,
    check_sizes,
    find_table,
    missing_names,
    read_table,
)

MAX_COMPRESSED_EVENTS = 1_000_000  # 13 MB, and a second of packing


def write_npz(path: str | os.PathLike[str], events: Events, width: int, height: int) -> None:
    """Write events to an npz file, which is compressed unless it is large: packing takes much longer than writing.

    The file appears complete or not at all. The same events always give the same bytes.

    Parameters
    ----------
    path : path-like
        Must end in .npz.
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events, in the order of time.
    width, height : int
        Sensor size [px].

    Raises
    ------
    ValueError
        If an event breaks a rule (see `events.check_events`).
    RecordingError
        If the name does not end in .npz, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".npz":
        raise RecordingError(f"{path}: write_npz writes npz; give a name that ends in .npz")
    check_events(events, width, height)
    with whole_file(path) as unfinished, unfinished.open("wb") as file:
        save = np.savez_compressed if events.size <= MAX_COMPRESSED_EVENTS else np.savez
        save(
            file,
            x=events["x"],
            y=events["y"],
            p=events["p"].astype(np.uint8),
            t=events["t"],
            width=np.int64(width),
            height=np.int64(height),
        )


def read_npz_header(path: Path) -> Header:
    """Return the header of an npz file, after checking that x, y, p and t are among its arrays.

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
        If the file is damaged, arrays are missing, or the size is not made of integers.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = [name for name in archive.namelist() if name.endswith(".npy")]
            names = [name.removesuffix(".npy") for name in members]
            kinds = {name: _kind_of(path, archive, name) for name in names}
            others = sorted(set(archive.namelist()) - set(members))
    except RecordingError:
        raise
    except Exception:  # a damaged directory can make zipfile raise almost anything
        raise RecordingError(f"{path}: damaged or cut short: not a whole npz file; write or copy it again") from None
    if not names and others:
        raise RecordingError(
            f"{path}: a zip archive with no arrays in it (found: {', '.join(others)[:100]}); unpack it first (unzip)"
        )
    table = find_table(kinds)
    if table is None:
        raise missing_names(path, "arrays", names)
    return Header(format="npz", size_px=_size(path, set(names)), layout=table)


def _kind_of(path: Path, archive: zipfile.ZipFile, name: str) -> tuple[Any, tuple[int, ...]]:
    """Return the type and the shape of an array from the head of its npy file."""
    try:
        with archive.open(f"{name}.npy") as file:
            version = np.lib.format.read_magic(file)
            read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(file)
    except Exception as error:  # a damaged head can make numpy raise almost anything
        raise _unreadable(path, name, error) from None
    return dtype, shape


def _unreadable(path: Path, name: str, error: Exception) -> RecordingError:
    """Return the error of an array that cannot be read."""
    return RecordingError(f"{path}: array {name} cannot be read ({words_of(error)}); write or copy it again")


def read_npz(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an npz file in pieces.

    numpy loads whole arrays, so this takes about 30 bytes of memory per event.

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
        If an array is damaged or of another kind, or in strict reading at the first offence.
    """
    table: Table = decoder.header.layout
    if table.whole:
        arrays = {table.whole: _load_member(path, table.whole)}
        n_events = len(arrays[table.whole])
    else:
        arrays = {name: _load_column(path, name) for name in table.names or ()}
        check_sizes(path, "arrays", [column.size for column in arrays.values()])
        n_events = next(iter(arrays.values())).size
    yield from read_table(decoder, table, n_events, lambda name, rows: arrays[name][rows])


def _load_member(path: Path, name: str) -> Array:
    """Return one array of an npz file, and raise RecordingError where it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return np.asarray(archive[name])
    except Exception as error:  # a damaged header can make numpy raise almost anything
        raise _unreadable(path, name, error) from None


def _load_column(path: Path, name: str) -> Array:
    """Return one of the columns of an npz file, after checking that it holds numbers."""
    column = _load_member(path, name)
    check_kind(path, "array", name, column.dtype, column.shape)
    return column.ravel()


def _size(path: Path, names: set[str]) -> tuple[int, int] | None:
    """Return the sensor size that an npz file states; None where it does not."""
    if not {"width", "height"} <= names:
        return None
    width, height = (_load_member(path, name) for name in ("width", "height"))
    if width.size != 1 or height.size != 1 or {width.dtype.kind, height.dtype.kind} - set("iu"):
        raise RecordingError(f"{path}: width and height are not whole numbers; store one integer each [px]")
    return int(width.item()), int(height.item())
