"""Open event files and read them as chunks of events in the order of time.

`open_recording` reads the formats that `formats.EXTENSIONS` lists. The times are those of the recording's own clock. A
file that breaks a rule raises `RecordingError`: one line that says where. With ``lenient=True`` every good event is
read, and `Recording.dropped` counts the others by cause.

All formats are read by this package, through h5py, pyarrow and rosbags where there is a container to open.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, join, windows
from bicode_lab.recordings.aedat.aedat2 import read_aedat2, unknown_camera
from bicode_lab.recordings.aedat.aedat3 import read_aedat3
from bicode_lab.recordings.aedat.aedat4 import read_aedat4
from bicode_lab.recordings.bags.containers import read_bag
from bicode_lab.recordings.decode import TRIGGER_DTYPE, Decoder
from bicode_lab.recordings.formats import Header, RecordingError
from bicode_lab.recordings.headers import read_header
from bicode_lab.recordings.raw.blocks import read_file_of_words
from bicode_lab.recordings.remarks import FEWEST_EVENTS, remark_on_clock
from bicode_lab.recordings.standard_input import copy_of_standard_input
from bicode_lab.recordings.tables.hdf5 import read_hdf5
from bicode_lab.recordings.tables.mat import read_mat
from bicode_lab.recordings.tables.npy import read_npy
from bicode_lab.recordings.tables.npz import read_npz
from bicode_lab.recordings.tables.parquet import read_parquet
from bicode_lab.recordings.text.lines import read_lines
from bicode_lab.recordings.validate import EVENTS, REST

MAX_CHUNK_EVENTS = 1_000_000
"""A chunk holds at most this many events."""

_ASSUMED_SIZE_PX = (1280, 720)
_WITH_TIME_WORDS = ("EVT2", "EVT3")  # these judge the time words, not the events


@dataclass(eq=False, kw_only=True)
class Recording:
    """An event file that can be read several times, each time from its start.

    Examples
    --------
    >>> recording = open_recording("scene.npz")             # doctest: +SKIP
    >>> for events in recording: ...                        # doctest: +SKIP
    """

    path: Path
    format: str
    """A key of `formats.EXTENSIONS`."""
    width: int
    """Sensor width [px]."""
    height: int
    """Sensor height [px]."""
    size_from: str
    """Where the size comes from: 'file', 'sensor' (the file names the sensor model), 'caller' or 'assumed'."""
    chunk_us: int
    """Longest time span of a chunk [us]."""
    header: Header
    lenient: bool = False
    """Whether the good events of a damaged file are read and the others dropped."""
    dropped: dict[str, int] = field(default_factory=dict)
    """What the latest reading has dropped so far: counts by cause; empty for a good file."""
    remarks: list[str] = field(default_factory=list)
    """What the latest reading has noticed so far, though no rule is broken: one line each."""
    triggers: npt.NDArray[np.void] = field(default_factory=lambda: np.empty(0, TRIGGER_DTYPE))
    """The external triggers that the latest reading has found so far: ``p``, ``t`` [us] and ``id``."""

    def __iter__(self) -> Iterator[Events]:
        """Iterate over `chunks`."""
        return self.chunks()

    def chunks(self) -> Iterator[Events]:
        """Yield the events in chunks in the order of time, in bounded memory.

        Chunk k holds the events of ``[t0 + k * chunk_us, t0 + (k + 1) * chunk_us)``, where t0 is the time of the
        first event. A chunk of more than a million events is divided, and an empty one is left out.

        Yields
        ------
        ndarray of EVENT_DTYPE, shape (n,), n >= 1

        Raises
        ------
        RecordingError
            In strict reading, if the file breaks a rule: which one, how often, and where first.
        """
        parts = windows(self._counted_pieces(), self.chunk_us, max_events=MAX_CHUNK_EVENTS)
        return (events for _, events in parts)

    def read(self) -> Events:
        """Read all events into one array.

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (n,)

        Raises
        ------
        RecordingError
            As for `chunks`.
        """
        return join(self.chunks())

    def _counted_pieces(self) -> Iterator[Events]:
        """Yield the good events, and keep `dropped`, `remarks` and `triggers` up to date."""
        units = {
            "CSV": "line",
            "text": "line",
            **dict.fromkeys(("EVT2", "EVT2.1", "EVT3", "EVT4", "DAT", "ES"), "byte"),
        }
        unit, any_order = units.get(self.format, ""), self.format not in _WITH_TIME_WORDS
        decoder = Decoder(self.path, self.header, self.width, self.height, self.lenient, unit, any_order)
        self._note(decoder)
        first: list[Events] | None = []
        for piece in self._pieces(decoder):
            if first is not None:
                first.append(piece)
                if sum(part.size for part in first) >= FEWEST_EVENTS:
                    self._remark_on_clock(decoder, first)
                    first = None
            self._note(decoder)
            yield piece
        self._note(decoder)

    def _note(self, decoder: Decoder) -> None:
        """Take over what a reading has found so far."""
        self.dropped, self.remarks, self.triggers = decoder.dropped, decoder.remarks, decoder.triggers

    def _remark_on_clock(self, decoder: Decoder, first: list[Events]) -> None:
        """Add a remark where the first events cannot have times in microseconds."""
        if line := remark_on_clock(join(first)):
            decoder.remark(line)

    def _pieces(self, decoder: Decoder) -> Iterator[Events]:
        """Yield the good events from the reader of this format; strict reading raises the first offence at the end."""
        read = _READERS.get(self.format, read_file_of_words)
        try:
            for piece in read(self.path, decoder):
                if self.lenient or not decoder.tally.any():  # after an offence the rest is only counted
                    yield piece
        except RecordingError:
            if not (self.lenient and decoder.state[EVENTS]):
                raise
            decoder.note_end(REST, 1)
        yield decoder.rest()
        decoder.raise_offence()


def open_recording(
    path: str | os.PathLike[str],
    *,
    width: int | None = None,
    height: int | None = None,
    chunk_us: int = 100_000,
    lenient: bool = False,
) -> Recording:
    """Open an event file; its events are read when the recording is iterated.

    Parameters
    ----------
    path : path-like
        An event file of one of `formats.EXTENSIONS`, or "-" for standard input. The content tells the format.
    width, height : int, optional
        Sensor size [px], for files that do not state theirs. If the file states it, both must agree. If it is not
        known at all, 1280 x 720 (the paper's sensor) is assumed, and `Recording.size_from` says so.
    chunk_us : int
        Longest time span of a chunk [us], 1 or more.
    lenient : bool
        Read the good events of a damaged file, and count the others in `Recording.dropped`. Then only a file of
        which nothing can be read is an error.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If the file is missing, empty, cut short or not an event file, if it has the name of another format, or if
        its sensor has another size than `width` and `height`.
    ValueError
        If only one of `width` and `height` is given, or `chunk_us` is below 1.
    """
    if chunk_us < 1:
        raise ValueError(f"chunk_us={chunk_us} is shorter than 1 us; choose 1 or more")
    path = copy_of_standard_input() if str(path) == "-" else Path(path)
    header = read_header(path, lenient)
    (width, height), size_from = _settle_size(path, header.size_px, header.size_from, width, height)
    if header.format == "AEDAT2" and size_from == "assumed":  # its columns are counted from the right
        raise unknown_camera(path)
    return Recording(
        path=path,
        format=header.format,
        width=width,
        height=height,
        size_from=size_from,
        chunk_us=chunk_us,
        header=header,
        lenient=lenient,
    )


def _settle_size(
    path: Path, size_px: tuple[int, int] | None, size_from: str, width: int | None, height: int | None
) -> tuple[tuple[int, int], str]:
    """Return the sensor size to use and where it comes from, after checking that file and caller agree."""
    if (width is None) != (height is None):
        raise ValueError(f"width={width} and height={height}: one is missing; give both or neither")
    asked = None if width is None or height is None else (width, height)
    for size, who in ((asked, "asked for"), (size_px, "in the file")):
        if size is not None and not all(1 <= side <= 65536 for side in size):
            raise RecordingError(f"{path}: sensor of {size[0]}x{size[1]} px {who}; sides are 1 to 65536 px")
    if asked and size_px and size_from == "file" and asked != size_px:
        says = f"{size_px[0]}x{size_px[1]}"
        raise RecordingError(
            f"{path}: width={width}, height={height} but the file says {says}; leave width and height out"
        )
    if size_px and (not asked or asked == size_px):
        return size_px, size_from
    return (asked, "caller") if asked else (_ASSUMED_SIZE_PX, "assumed")


_READERS: dict[str, Callable[[Path, Decoder], Iterator[Events]]] = {
    "AEDAT2": read_aedat2,
    "AEDAT3.1": read_aedat3,
    "AEDAT4": read_aedat4,
    "CSV": read_lines,
    "text": read_lines,
    "HDF5": read_hdf5,
    "npz": read_npz,
    "npy": read_npy,
    "MAT": read_mat,
    "Parquet": read_parquet,
    "ROS 1 bag": read_bag,
    "ROS 2 bag": read_bag,
}
"""The reader of each format that is not made of words alone."""
