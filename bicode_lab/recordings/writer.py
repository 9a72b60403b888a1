"""Write event files: .raw (EVT3), .aedat4, .dat, .csv, .h5 or .npz.

The ending of the name chooses the format. The file appears complete or not at all. No more than one chunk of events
is held in memory, except for npz, which numpy writes at once.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import faery
import numpy as np

from bicode_lab.events import EVENT_DTYPE, Events, check_events, join, words
from bicode_lab.kernels import njit
from bicode_lab.recordings.formats import RecordingError, whole_file
from bicode_lab.recordings.raw.evt3_write import FIRST_TIME_US, MAX_SIDE_PX, write_evt3
from bicode_lab.recordings.tables.hdf5 import write_hdf5
from bicode_lab.recordings.tables.npz import write_npz

WRITABLE = (".npz", ".raw", ".aedat4", ".dat", ".csv", ".h5")
"""The name endings that `write_recording` accepts."""

_MAX_SIDES_PX = {".raw": MAX_SIDE_PX, ".dat": 1 << 14}


def write_recording(path: str | os.PathLike[str], events: Events | Iterable[Events], width: int, height: int) -> int:
    """Write events to a file, in the format that the ending of its name tells.

    Parameters
    ----------
    path : path-like
        Ends in .raw (EVT3), .aedat4, .dat, .csv, .h5 (HDF5 in columns) or .npz.
    events : ndarray of EVENT_DTYPE, or an iterable of such
        All events, or chunks of them in the order of time.
    width, height : int
        Sensor size [px]; for .raw at most 2048 in each direction.

    Returns
    -------
    int
        Time subtracted from every event in the file [us]; 0 where the file keeps the times of the events.
        RAW and DAT have short clocks that begin at 0. If the first event comes later than 16.78 s (24 bits), such
        a file begins at 0 and its header has a line ``t0``. From it `open_recording` and faery restore the times
        of the events; the vendor's tools count from 0.

    Raises
    ------
    ValueError
        If an event breaks a rule (see `events.check_events`), or a chunk begins before the previous one ends.
    RecordingError
        If the ending is unknown, the sensor is too large for the format, or the folder cannot be written to.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in WRITABLE:
        raise RecordingError(f"{path}: no format is called {suffix or 'nothing'}; end the name in {_listed(WRITABLE)}")
    limit_px = _MAX_SIDES_PX.get(suffix, 1 << 16)
    if not (1 <= width <= limit_px and 1 <= height <= limit_px):
        raise RecordingError(f"{path}: sensor of {width}x{height} px; {suffix} holds sides of 1 to {limit_px} px")
    chunks = _checked([events] if isinstance(events, np.ndarray) else events, width, height)
    if suffix == ".npz":
        write_npz(path, join(chunks), width, height)
        return 0
    first = next(chunks, None)
    chunks = chain([] if first is None else [first], chunks)
    start_us = 0 if first is None else int(first["t"][0])
    if start_us < 0 and suffix != ".h5":
        raise RecordingError(f"{path}: the first event is at {start_us} us; {suffix} holds no time before 0")
    shift_us = start_us if suffix in (".raw", ".dat") and start_us >= FIRST_TIME_US else 0
    with whole_file(path) as unfinished:
        if suffix == ".raw":
            with unfinished.open("wb") as file:
                write_evt3(file, chunks, width, height, shift_us)
        elif suffix == ".h5":
            write_hdf5(unfinished, chunks, width, height)
        else:
            _write_with_faery(unfinished, suffix, chunks, (width, height), shift_us > 0)
    return shift_us


def _checked(chunks: Iterable[Events], width: int, height: int) -> Iterator[Events]:
    """Yield the chunks that hold events, after checking their events and their order."""
    last_us = None
    for chunk in chunks:
        if chunk.dtype != EVENT_DTYPE or not keep_rules(words(chunk), width, height):
            check_events(chunk, width, height)
        if not chunk.size:
            continue
        if last_us is not None and chunk["t"][0] < last_us:
            raise ValueError(
                f"a chunk begins at {chunk['t'][0]} us, before the end of the last, {last_us} us; sort them"
            )
        last_us = int(chunk["t"][-1])
        yield chunk


@njit(cache=True, nogil=True)
def keep_rules(events, width, height):  # type: ignore[no-untyped-def]
    """Return whether events, given as `events.words`, keep the rules that `check_events` names."""
    last = events[0, 1] if events.shape[0] else 0
    for i in range(events.shape[0]):
        word, t = events[i, 0], events[i, 1]
        if word & 0xFFFF >= width or (word >> 16) & 0xFFFF >= height or (word >> 32) & 0xFFFF > 1 or t < last:
            return False
        last = t
    return True


def _write_with_faery(path: Path, suffix: str, chunks: Iterator[Events], size_px: tuple[int, int], zero: bool) -> None:
    """Write an AEDAT4, DAT or CSV file; `zero` makes its times begin at 0."""
    kind = {".aedat4": "aedat", ".dat": "dat", ".csv": "csv"}[suffix]
    try:
        faery.file_encoder.events_to_file(
            map(_as_faery, chunks), path, size_px, file_type=kind, zero_t0=zero, use_write_suffix=False
        )
    except RuntimeError as error:  # faery's word for what the system reports, such as a full disk
        raise OSError(str(error)) from None


def _as_faery(events: Events) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Return events in faery's layout."""
    theirs = np.empty(events.size, faery.EVENTS_DTYPE)
    for name, ours in (("t", "t"), ("x", "x"), ("y", "y"), ("on", "p")):
        theirs[name] = events[ours]
    return theirs


def _listed(words: Iterable[str]) -> str:
    """Return words as 'a, b or c'."""
    *most, last = words
    return f"{', '.join(most)} or {last}"
