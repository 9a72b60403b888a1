"""Recordings: event files in and out   a path -> chunks of events in the order of time

`open_recording` reads EVT2 and EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 in columns, and our
own npz (arrays x, y, p, t, and perhaps width and height); `write_recording` writes most
of them. The recording's own clock is kept. A file that breaks a rule raises
`RecordingError`, one line with the place; with ``lenient=True`` every good event comes,
and `Recording.dropped` counts the others by cause.

EVT2, EVT3, HDF5 and npz are read here, the others by faery. One limit comes with it: an
AEDAT4 file's backward times are held at the latest time without a word, because its
packets are compressed and nobody else here can open them.
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
from bicode_lab.recordings.npz import read_npz_pieces, read_npz_size, write_npz
from bicode_lab.recordings.validate import REST
from bicode_lab.recordings.writer import WRITABLE, write_recording

__all__ = ["WRITABLE", "Recording", "RecordingError", "open_recording", "write_npz", "write_recording"]

MAX_CHUNK_EVENTS = 1_000_000
"""No chunk holds more events than this."""

_ASSUMED_SIZE_PX = (1280, 720)


@dataclass(eq=False, kw_only=True)
class Recording:
    """An event file that can be read again and again, each time from its start.

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
    """Where the size comes from: 'file', 'sensor' (the file names it), 'caller', or 'assumed'."""
    chunk_us: int
    """Longest time a chunk spans [us]."""
    header: Header
    lenient: bool = False
    """Whether good events of a damaged file are read, and the others dropped."""
    dropped: dict[str, int] = field(default_factory=dict)
    """What the last reading has dropped so far: cause -> count; empty for a good file."""

    def __iter__(self) -> Iterator[Events]:
        return self.chunks()

    def chunks(self) -> Iterator[Events]:
        """Nothing in, the events out in chunks ordered by time, in bounded memory.

        Chunk k holds the events of [t0 + k chunk_us, t0 + (k + 1) chunk_us), t0 being the
        first event's time, whatever the format; a chunk of more than a million events is
        split, an empty one left out.

        Yields
        ------
        ndarray of EVENT_DTYPE, shape (n,), n >= 1

        Raises
        ------
        RecordingError
            Where the file breaks a rule, if it is not read leniently: what, how often, and
            where first.
        """
        parts = windows(self._counted_pieces(), self.chunk_us, max_events=MAX_CHUNK_EVENTS)
        return (events for _, events in parts)

    def read(self) -> Events:
        """Nothing in, all events out in one array of EVENT_DTYPE, shape (n,)."""
        return join(self.chunks())

    def _counted_pieces(self) -> Iterator[Events]:
        """The good events as they come, with `dropped` kept up to date."""
        decoder = Decoder(self.path, self.header, self.width, self.height, self.lenient)
        self.dropped = {}
        for piece in self._pieces(decoder):
            self.dropped = decoder.dropped
            yield piece
        self.dropped = decoder.dropped

    def _pieces(self, decoder: Decoder) -> Iterator[Events]:
        """The good events, from whoever reads this format."""
        if self.format == "npz":
            return read_npz_pieces(self.path, decoder)
        if self.format == "HDF5":
            return read_hdf5_pieces(self.path, decoder)
        if self.format in ("EVT2", "EVT3") or (self.lenient and self.format != "AEDAT4"):
            return decoder.pieces()
        return self._faery_pieces(decoder)

    def _faery_pieces(self, decoder: Decoder) -> Iterator[Events]:
        """Faery's packets as our events, each judged before it is passed on."""
        n_events = 0
        for packet in self._faery_packets(decoder):
            n_events += packet.size
            if self.format == "AEDAT4":  # compressed, so only what faery made of it can be judged
                events = decoder.filter(tuple(packet[name] for name in ("x", "y", "on", "t")))
                decoder.complain()
            else:
                events = np.empty(packet.size, EVENT_DTYPE)
                for ours, theirs in (("x", "x"), ("y", "y"), ("p", "on"), ("t", "t")):
                    events[ours] = packet[theirs]
                decoder.advance(n_events)
            yield events

    def _faery_packets(self, decoder: Decoder) -> Iterator[Any]:
        """What faery reads, and what it cannot read in our words."""
        n_events = 0
        try:
            for packet in _faery_stream(self.path, self.header, (self.width, self.height)):
                n_events += packet.size
                yield packet
        except (GeneratorExit, RecordingError):
            raise
        except BaseException as error:
            _let_pass(error)
            if self.lenient:
                decoder.note_end(REST, 1)
                return
            decoder.advance()
            raise _translated(self.path, error, n_events) from None
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
    """A path in, its recording out; the events are read when it is iterated.

    Parameters
    ----------
    path : path-like
        An EVT2 or EVT3 RAW, DAT, AEDAT4, ES, CSV, HDF5 or npz file. The content decides the format.
    width, height : int, optional
        Sensor size [px], for files that do not tell theirs. Where the file tells it, they
        must agree. Where nobody does, 1280 x 720 (the paper's sensor) is assumed, and
        `Recording.size_from` says so.
    chunk_us : int
        Longest time a chunk spans [us].
    lenient : bool
        Read the good events of a damaged file and count the others in `Recording.dropped`.
        Only a file of which nothing can be read is an error then.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        Missing, not an event file, empty, cut short, named as another format, or of
        another size than asked for.
    """
    path = Path(path)
    if chunk_us < 1:
        raise ValueError(f"chunk_us={chunk_us} is no time; choose 1 us or more")
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
    """The file's size and the caller's in, the one to use and where it comes from out."""
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
    """Faery's stream of this file; it is told the format, never left to guess by the name."""
    file_type = {"EVT2": "evt", "EVT3": "evt", "DAT": "dat", "AEDAT4": "aedat", "ES": "es", "CSV": "csv"}
    properties = faery.CsvProperties.default()
    if header.format == "CSV":
        x, y, p, t = header.columns
        properties.x_index, properties.y_index, properties.on_index, properties.t_index = x, y, p, t
    return faery.events_stream_from_file(
        path, dimensions_fallback=size_px, file_type=file_type[header.format], csv_properties=properties
    )


def _let_pass(error: BaseException) -> None:
    """Raise again what is not faery's: only its errors and its panics, which are no `Exception`s, are translated."""
    if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
        raise error


def _translated(path: Path, error: BaseException, n_events: int) -> RecordingError:
    """Faery's words in, ours out, on one line."""
    words = " ".join(str(error).split())[:120]
    return RecordingError(f"{path}: damaged after {n_events:,} good events ({words}); export or copy it again")
