"""Our own event file: a numpy npz of the arrays x, y, p, t (us), and perhaps width and height."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicode_lab.events import Events, check_events
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.file import whole_file
from bicode_lab.recordings.formats import RecordingError

_PIECE_EVENTS = 1 << 18


def write_npz(path: str | os.PathLike[str], events: Events, width: int, height: int) -> None:
    """A path and events in; a compressed npz on disk out (x, y, p, t in us, width, height).

    The file appears whole or not at all. The same events always give the same bytes.

    Raises
    ------
    ValueError
        Events that break a rule (see `events.check_events`), or a name that does not end in .npz.
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
    """A path in, its good events in pieces out, after the arrays were judged as a whole.

    numpy loads an array whole, so the memory grows with the file: about 30 bytes an event.
    """
    x, y, p, t = (_load_column(path, name) for name in "xypt")
    sizes = [column.size for column in (x, y, p, t)]
    if len(set(sizes)) > 1:
        raise RecordingError(f"{path}: arrays x, y, p, t have {sizes} entries; give one of each per event")
    parts = [slice(start, start + _PIECE_EVENTS) for start in range(0, t.size, _PIECE_EVENTS)]
    good = [decoder.filter((x[part], y[part], p[part], t[part])) for part in parts]
    decoder.complain()
    yield from good


def _load_member(path: Path, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """One array of an npz, with its damage in words."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return np.asarray(archive[name])
    except Exception as error:  # a damaged header can make numpy raise almost anything
        words = " ".join(str(error).split())[:100]
        raise RecordingError(f"{path}: array {name} cannot be read ({words}); write or copy it again") from None


def _load_column(path: Path, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """One of the columns of an npz, as whole numbers."""
    column = _load_member(path, name)
    if column.ndim != 1 or column.dtype.kind not in "iub":
        found = f"{column.dtype} of shape {column.shape}"
        nan = " with NaN" if column.dtype.kind == "f" and np.isnan(column).any() else ""
        rule = "whole microseconds" if name == "t" else "whole numbers"
        raise RecordingError(f"{path}: array {name} is {found}{nan}; store {rule} in one dimension")
    return column


def read_npz_size(path: Path) -> tuple[int, int] | None:
    """A path in, the sensor's width and height [px] out, or None where the file does not tell."""
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
    if not {"width.npy", "height.npy"} <= names:
        return None
    width, height = (_load_member(path, name) for name in ("width", "height"))
    if width.size != 1 or height.size != 1 or {width.dtype.kind, height.dtype.kind} - set("iu"):
        raise RecordingError(f"{path}: width and height are not whole numbers; store one integer each [px]")
    return int(width.item()), int(height.item())
