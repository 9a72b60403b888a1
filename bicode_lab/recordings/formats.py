"""The event file formats, the error that all readers and writers share, and how a file is written as a whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

EXTENSIONS = {
    "EVT2": (".raw", ".evt"),
    "EVT2.1": (".raw", ".evt"),
    "EVT3": (".raw", ".evt"),
    "EVT4": (".raw", ".evt"),
    "DAT": (".dat",),
    "AEDAT2": (".aedat", ".aedat2"),
    "AEDAT3.1": (".aedat", ".aedat31", ".aedat3"),
    "AEDAT4": (".aedat4", ".aedat"),
    "ES": (".es",),
    "CSV": (".csv", ".txt", ".tsv"),
    "text": (".txt", ".csv", ".tsv", ".dat"),
    "HDF5": (".h5", ".hdf5", ".hdf", ".mat"),
    "npz": (".npz",),
    "npy": (".npy",),
    "MAT": (".mat",),
    "Parquet": (".parquet", ".pq"),
    "ROS 1 bag": (".bag",),
    "ROS 2 bag": (".db3", ".mcap"),
}
"""Name endings of each format; the first one is the usual one."""

READABLE = "EVT2, EVT2.1, EVT3 or EVT4 RAW, DAT, AEDAT, ES, CSV, text, HDF5, npz, npy, MAT, Parquet or a ROS bag"


class RecordingError(ValueError):
    """Raised when a recording cannot be read or written as asked; the message is one line that names the file."""


def words_of(error: Exception) -> str:
    """Return the first words of what another library says of an error, in one line."""
    return " ".join(str(error).split())[:100]


def damaged(path: Path, error: Exception) -> RecordingError:
    """Return the error of a file that another library cannot read.

    Parameters
    ----------
    path : Path
        The file.
    error : Exception
        What the library raised.
    """
    return RecordingError(f"{path}: damaged or cut short ({words_of(error)}); write or copy it again")


@dataclass(frozen=True, kw_only=True)
class Header:
    """What a file says about itself before its first event."""

    format: str
    """A key of `EXTENSIONS`."""
    size_px: tuple[int, int] | None = None
    """Sensor width and height [px]; None where the file does not state them."""
    size_from: str = "file"
    """'file' where the size is written in the file, 'sensor' where it follows from the sensor model it names."""
    offset: int = 0
    """Position of the first event in the file [bytes]."""
    t0_us: int = 0
    """Time that was subtracted from every event when the file was written [us]."""
    swapped: bool = False
    """EVT2.1 only: the halves of each 64-bit word have changed places."""
    atis: bool = False
    """ES only: the file holds events of type ATIS, which include exposure measurements."""
    layout: Any = None
    """Where the reader of the format finds x, y, p and t: columns of a text, data sets of an HDF5 file, ..."""


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
