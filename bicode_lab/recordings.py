"""Recordings: event files in and out   a path -> chunks of events in the order of time

`open_recording` reads EVT2 and EVT3 RAW, DAT, AEDAT4, ES and CSV through faery, and our
own npz (arrays x, y, p, t, and perhaps width and height). The recording's own clock is
kept. A file that breaks a rule raises `RecordingError`, one line with the place.

Two limits come with faery: an AEDAT4 file's backward times are held at the latest time
without a word (its packets are compressed, and nobody else here can open them), and
where a Gen4.1 sensor sends an EVT3 time word a few us ahead and then corrects it, faery
holds the former (by 11 us at most, 0.7 % of the events of the recording that shows it).
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import faery
import numpy as np

from bicode_lab.events import EVENT_DTYPE, Events, no_events
from bicode_lab.recording_checks import Check
from bicode_lab.recording_headers import Header, RecordingError, read_header
from bicode_lab.recording_npz import read_npz_pieces, read_npz_size, write_npz
from bicode_lab.recording_write import write_recording

__all__ = ["Recording", "RecordingError", "open_recording", "write_npz", "write_recording"]

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
    """One of EVT2, EVT3, DAT, AEDAT4, ES, CSV, npz."""
    width: int
    """Sensor width [px]."""
    height: int
    """Sensor height [px]."""
    size_from: str
    """Where the size comes from: 'file', 'sensor' (the file names it), 'caller', or 'assumed'."""
    chunk_us: int
    """Longest time a chunk spans [us]."""
    header: Header

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
            Where the file breaks a rule: what, how often, and where first.
        """
        check = Check(self.path, self.header, self.width, self.height)
        pieces = read_npz_pieces(self.path, check) if self.format == "npz" else self._faery_pieces(check)
        return cut_chunks(pieces, self.chunk_us)

    def read(self) -> Events:
        """Nothing in, all events out in one array of EVENT_DTYPE, shape (n,)."""
        return np.concatenate([no_events(), *self.chunks()])

    def _faery_pieces(self, check: Check) -> Iterator[Events]:
        """Faery's packets as our events, each judged before it is passed on."""
        n_events = 0
        for packet in self._faery_packets(check):
            events = np.empty(packet.size, EVENT_DTYPE)
            for ours, theirs in (("x", "x"), ("y", "y"), ("p", "on"), ("t", "t")):
                events[ours] = packet[theirs]
            n_events += events.size
            if self.format == "AEDAT4":  # compressed, so only what faery made of it can be judged
                check.judge(*(events[name] for name in ("x", "y", "p", "t")))
                check.complain()
            else:
                check.advance(n_events)
            yield events

    def _faery_packets(self, check: Check) -> Iterator[Any]:
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
            check.advance()
            raise _translated(self.path, error, n_events) from None
        check.advance()


def open_recording(
    path: str | os.PathLike[str], *, width: int | None = None, height: int | None = None, chunk_us: int = 100_000
) -> Recording:
    """A path in, its recording out; the events are read when it is iterated.

    Parameters
    ----------
    path : path-like
        An EVT2 or EVT3 RAW, DAT, AEDAT4, ES, CSV or npz file. The content decides the format.
    width, height : int, optional
        Sensor size [px], for files that do not tell theirs. Where the file tells it, they
        must agree. Where nobody does, 1280 x 720 (the paper's sensor) is assumed, and
        `Recording.size_from` says so.
    chunk_us : int
        Longest time a chunk spans [us].

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
    header = read_header(path)
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
    )


def cut_chunks(pieces: Iterable[Events], chunk_us: int, max_events: int = MAX_CHUNK_EVENTS) -> Iterator[Events]:
    """Time-ordered pieces of any length in, chunks of at most `chunk_us` and `max_events` out.

    Chunk borders lie at t0 + k chunk_us, so they do not depend on the pieces.
    """
    held: list[Events] = []
    n_held, end_us = 0, 0
    started = False
    for piece in pieces:
        while piece.size:
            if not started:
                started, end_us = True, int(piece["t"][0]) + chunk_us
            elif not n_held and piece["t"][0] >= end_us:
                end_us += ((int(piece["t"][0]) - end_us) // chunk_us + 1) * chunk_us
            n = min(int(np.searchsorted(piece["t"], end_us)), max_events - n_held)
            held.append(piece[:n])
            n_held += n
            piece = piece[n:]
            if piece.size or n_held == max_events:
                if n_held:
                    yield np.concatenate(held)
                held, n_held = [], 0
    if n_held:
        yield np.concatenate(held)


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
