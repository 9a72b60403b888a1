"""The formats of event files, what one says about itself, and the error they share."""

from __future__ import annotations

from dataclasses import dataclass

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

READABLE = "EVT2 or EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 or npz"


class RecordingError(ValueError):
    """A recording that cannot be read or written as asked; the message is one line that names the file."""


def refuse(lenient: bool, message: str) -> None:
    """Raise what is wrong with a file, unless it is read leniently and can be read all the same."""
    if not lenient:
        raise RecordingError(message)


@dataclass(frozen=True, kw_only=True)
class Header:
    """What a file says about itself, before its first event."""

    format: str
    """One of EVT2, EVT3, DAT, AEDAT4, ES, CSV, HDF5, npz."""
    size_px: tuple[int, int] | None = None
    """Sensor width and height, where the file tells."""
    size_from: str = "file"
    """'file' where the size is written in the file, 'sensor' where it follows from the sensor it names."""
    offset: int = 0
    """Byte at which the events begin."""
    t0_us: int = 0
    """RAW and DAT: time that was taken off every event when the file was written [us]."""
    columns: tuple[int, int, int, int] = (0, 1, 2, 3)
    """CSV only: which columns hold x, y, p, t."""
    atis: bool = False
    """ES only: events of the type ATIS, which carry exposures among them."""
