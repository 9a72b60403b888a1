"""Read and write this project's own event file: an npz of the arrays x, y, p, t [us], and width and height [px]."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import Events, check_events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import RecordingError, whole_file

_PIECE_EVENTS = 1 << 18


def write_npz(path: str | os.PathLike[str], events: Events, width: int, height: int) -> None:
    """Write events to a compressed npz file.

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
        np.savez_compressed(
            file,
            x=events["x"],
            y=events["y"],
            p=events["p"].astype(np.uint8),
            t=events["t"],
            width=np.int64(width),
            height=np.int64(height),
        )


def read_npz_pieces(path: Path, decoder: Decoder) -> Iterator[Events]:
    """Yield the good events of an npz file in pieces, after all of them have been validated.

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
    x, y, p, t = (_load_column(path, name) for name in "xypt")
    sizes = [column.size for column in (x, y, p, t)]
    if len(set(sizes)) > 1:
        raise RecordingError(f"{path}: arrays x, y, p, t have {sizes} entries; give one of each per event")
    parts = [slice(start, start + _PIECE_EVENTS) for start in range(0, t.size, _PIECE_EVENTS)]
    good = [decoder.filter((x[part], y[part], p[part], t[part])) for part in parts]
    decoder.raise_offence()
    yield from good


def _load_member(path: Path, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """Return one array of an npz file, and raise RecordingError where it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return np.asarray(archive[name])
    except Exception as error:  # a damaged header can make numpy raise almost anything
        words = " ".join(str(error).split())[:100]
        raise RecordingError(f"{path}: array {name} cannot be read ({words}); write or copy it again") from None


def _load_column(path: Path, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """Return one of the columns of an npz file, after checking that it holds integers."""
    column = _load_member(path, name)
    if column.ndim != 1 or column.dtype.kind not in "iub":
        found = f"{column.dtype} of shape {column.shape}"
        nan = " with NaN" if column.dtype.kind == "f" and np.isnan(column).any() else ""
        rule = "whole microseconds" if name == "t" else "whole numbers"
        raise RecordingError(f"{path}: array {name} is {found}{nan}; store {rule} in one dimension")
    return column


def read_npz_size(path: Path) -> tuple[int, int] | None:
    """Return the sensor size that an npz file states.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    (int, int) or None
        Width and height [px]; None where the file does not state them.

    Raises
    ------
    RecordingError
        If they are not integers.
    """
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
    if not {"width.npy", "height.npy"} <= names:
        return None
    width, height = (_load_member(path, name) for name in ("width", "height"))
    if width.size != 1 or height.size != 1 or {width.dtype.kind, height.dtype.kind} - set("iu"):
        raise RecordingError(f"{path}: width and height are not whole numbers; store one integer each [px]")
    return int(width.item()), int(height.item())
