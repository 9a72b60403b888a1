"""Open event files and read them as chunks of events in the order of time.

`open_recording` reads EVT2 and EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 with columns, and this project's npz (arrays x,
y, p, t, and width and height). The times are those of the recording's own clock. A file that breaks a rule raises
`RecordingError`: one line that says where. With ``lenient=True`` every good event is read, and `Recording.dropped`
counts the others by cause.

EVT2, EVT3, HDF5 and npz are read by this package, the other formats by faery. This has one limit: faery silently
replaces a backward time of an AEDAT4 file by the latest time before it, and this cannot be noticed here, because only
faery can open the compressed packets.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import faery
import numpy as np

from bicode_lab.events import EVENT_DTYPE, Events, join, windows
from bicode_lab.recordings.decode import Decoder
from bicode_lab.recordings.formats import Header, RecordingError
from bicode_lab.recordings.hdf5 import read_hdf5_pieces
from bicode_lab.recordings.headers import read_header
from bicode_lab.recordings.npz import read_npz_pieces, read_npz_size
from bicode_lab.recordings.validate import REST

MAX_CHUNK_EVENTS = 1_000_000
"""A chunk holds at most this many events."""

_ASSUMED_SIZE_PX = (1280, 720)


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
    """One of EVT2, EVT3, DAT, AEDAT4, ES, CSV, HDF5, npz."""
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
        """Yield the good events, and keep `dropped` up to date."""
        decoder = Decoder(self.path, self.header, self.width, self.height, self.lenient)
        self.dropped = {}
        for piece in self._pieces(decoder):
            self.dropped = decoder.dropped
            yield piece
        self.dropped = decoder.dropped

    def _pieces(self, decoder: Decoder) -> Iterator[Events]:
        """Return an iterator over the good events from the reader of this format."""
        if self.format == "npz":
            return read_npz_pieces(self.path, decoder)
        if self.format == "HDF5":
            return read_hdf5_pieces(self.path, decoder)
        if self.format in ("EVT2", "EVT3") or (self.lenient and self.format != "AEDAT4"):
            return decoder.pieces()
        return self._faery_pieces(decoder)

    def _faery_pieces(self, decoder: Decoder) -> Iterator[Events]:
        """Yield faery's packets as event arrays, each validated before it is passed on."""
        n_events = 0
        for packet in self._faery_packets(decoder):
            n_events += packet.size
            if self.format == "AEDAT4":  # it is compressed, so only what faery makes of it can be validated
                events = decoder.filter(tuple(packet[name] for name in ("x", "y", "on", "t")))
                decoder.raise_offence()
            else:
                events = np.empty(packet.size, EVENT_DTYPE)
                for ours, theirs in (("x", "x"), ("y", "y"), ("p", "on"), ("t", "t")):
                    events[ours] = packet[theirs]
                decoder.advance(n_events)
            yield events

    def _faery_packets(self, decoder: Decoder) -> Iterator[Any]:
        """Yield faery's packets, and turn its errors into `RecordingError`."""
        n_events = 0
        try:
            for packet in _faery_stream(self.path, self.header, (self.width, self.height)):
                n_events += packet.size
                yield packet
        except (GeneratorExit, RecordingError):
            raise
        except BaseException as error:
            _raise_if_not_from_faery(error)
            if self.lenient:
                decoder.note_end(REST, 1)
                return
            decoder.advance()
            raise _recording_error(self.path, error, n_events) from None
        if not self.lenient:
            decoder.advance()


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
        An EVT2 or EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 or npz file. The content tells the format.
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
    path = Path(path)
    if chunk_us < 1:
        raise ValueError(f"chunk_us={chunk_us} is shorter than 1 us; choose 1 or more")
    header = read_header(path, lenient)
    size_px, size_from = header.size_px, header.size_from
    if header.format == "npz":
        size_px = read_npz_size(path)
    (width, height), size_from = _settle_size(path, size_px, size_from, width, height)
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


def _faery_stream(path: Path, header: Header, size_px: tuple[int, int]) -> Any:
    """Open a file with faery; it is told the format, so that it does not guess it from the name."""
    file_type = {"EVT2": "evt", "EVT3": "evt", "DAT": "dat", "AEDAT4": "aedat", "ES": "es", "CSV": "csv"}
    properties = faery.CsvProperties.default()
    if header.format == "CSV":
        x, y, p, t = header.columns
        properties.x_index, properties.y_index, properties.on_index, properties.t_index = x, y, p, t
    return faery.events_stream_from_file(
        path, dimensions_fallback=size_px, file_type=file_type[header.format], csv_properties=properties
    )


def _raise_if_not_from_faery(error: BaseException) -> None:
    """Raise an error again unless it is an `Exception` or a panic of faery (which is not an `Exception`)."""
    if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
        raise error


def _recording_error(path: Path, error: BaseException, n_events: int) -> RecordingError:
    """Return a `RecordingError` of one line for an error of faery."""
    words = " ".join(str(error).split())[:120]
    return RecordingError(f"{path}: damaged after {n_events:,} good events ({words}); export or copy it again")
