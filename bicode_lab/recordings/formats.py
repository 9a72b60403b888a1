"""The event file formats, the error that all readers and writers share, and how a file is written as a whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

EXTENSIONS = {
    "EVT2": (".raw", ".evt"),
    "EVT3": (".raw", ".evt"),
    "DAT": (".dat",),
    "AEDAT4": (".aedat4", ".aedat"),
    "ES": (".es",),
    "CSV": (".csv",),
    "HDF5": (".h5", ".hdf5"),
    "npz": (".npz",),
}
"""Name endings of each format; the first one is the usual one."""

READABLE = "EVT2 or EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 or npz"


class RecordingError(ValueError):
    """Raised when a recording cannot be read or written as asked; the message is one line that names the file."""


@dataclass(frozen=True, kw_only=True)
class Header:
    """What a file says about itself before its first event."""

    format: str
    """One of EVT2, EVT3, DAT, AEDAT4, ES, CSV, HDF5, npz."""
    size_px: tuple[int, int] | None = None
    """Sensor width and height [px]; None where the file does not state them."""
    size_from: str = "file"
    """'file' where the size is written in the file, 'sensor' where it follows from the sensor model it names."""
    offset: int = 0
    """Position of the first event in the file [bytes]."""
    t0_us: int = 0
    """RAW and DAT: time that was subtracted from every event when the file was written [us]."""
    columns: tuple[int, int, int, int] = (0, 1, 2, 3)
    """CSV only: numbers of the columns that hold x, y, p and t, counted from 0."""
    atis: bool = False
    """ES only: the file holds events of type ATIS, which include exposure measurements."""


def raise_unless_lenient(lenient: bool, message: str) -> None:
    """Raise RecordingError for a fault that lenient reading can work around.

    Parameters
    ----------
    lenient : bool
        True where the file is read leniently; then nothing is raised.
    message : str
        One line: the file, what is wrong with it, and the way out.

    Raises
    ------
    RecordingError
        If `lenient` is False.
    """
    if not lenient:
        raise RecordingError(message)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Write a file so that it appears complete or not at all.

    Parameters
    ----------
    path : Path
        The file to write.

    Yields
    ------
    Path
        A temporary file in the same folder to write to. It replaces `path` when the block ends without an error.

    Raises
    ------
    RecordingError
        If the file cannot be written.
    """
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        unfinished.touch()  # some libraries would make a missing folder
        yield unfinished
        unfinished.replace(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror or error}); check the folder") from None
    finally:
        unfinished.unlink(missing_ok=True)
