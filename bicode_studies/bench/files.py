"""The rows of ``bicode bench`` about event files: how fast each format is read and written, beside faery."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import faery

from bicode_lab.events import Events
from bicode_lab.recordings import open_recording, write_recording
from bicode_studies.bench import fresh_process, streams
from bicode_studies.bench.rows import Row, rate_row, time_row
from bicode_studies.bench.timing import time_in_turn

FILE_MEV_PER_S, FILE_S = 10.0, 0.4
READ_REACH = {".raw": 80.0, ".dat": 60.0, ".aedat4": 60.0, ".h5": 60.0, ".npz": 60.0, ".csv": 10.0}
"""Events per microsecond that each format should be read with."""
WRITE_REACH = 80.0  # of .raw
FAERY_READS = (".raw", ".dat", ".aedat4", ".csv")
REPEATS = 3


def file_rows() -> Iterator[Row]:
    """Measure reading and writing of files, and the time from a file to its rows."""
    events = streams.six_markers(FILE_MEV_PER_S, FILE_S)
    with tempfile.TemporaryDirectory() as folder:
        for suffix, reach in READ_REACH.items():
            path = Path(folder) / f"stream{suffix}"
            write_recording(path, events, streams.WIDTH, streams.HEIGHT)
            peers = [partial(_read_by_faery, path)] if suffix in FAERY_READS else []
            timing, *others = time_in_turn(REPEATS, partial(_read, path), *peers)
            beside = ", ".join(f"faery {events.size / other.cpu_s / 1e6:.1f}" for other in others) or "-"
            yield rate_row(timing, events.size / 1e6, name=f"read-{suffix[1:]}", what=f"read a {suffix} file strictly",
                           reach=reach, unit="Mev/s", beside=beside)  # fmt: skip
        path = Path(folder) / "stream.raw"
        (timing,) = time_in_turn(REPEATS, partial(write_recording, path, events, streams.WIDTH, streams.HEIGHT))
        yield rate_row(timing, events.size / 1e6, name="write-raw", what="write a .raw file", reach=WRITE_REACH,
                       unit="Mev/s")  # fmt: skip
        yield _decode_row(path, events)


def _decode_row(path: Path, events: Events) -> Row:
    """Measure `bicode decode` of a file, without the time that a process needs for a file of no more than a period."""
    short = path.with_name("short.raw")
    first = events[events["t"] < events["t"][0] + streams.PERIOD_US]
    write_recording(short, first, streams.WIDTH, streams.HEIGHT)
    whole, start = (
        fresh_process.time_fresh("-c", fresh_process.RUN_DECODE.format(path=str(one))) for one in (path, short)
    )
    seconds = float(events["t"][-1] - first["t"][-1]) * 1e-6
    timing = replace(whole, cpu_s=whole.cpu_s - start.cpu_s, wall_s=whole.wall_s - start.wall_s)
    rate = (events.size - first.size) / timing.wall_s / 1e6
    return time_row(timing, 1 / seconds, name="decode-raw", what="`bicode decode` for a second of a .raw file",
                    reach=1.0, unit="s/s", beside=f"{rate:.1f} Mev/s by the clock")  # fmt: skip


def _read(path: Path) -> int:
    """Read a file and return the number of its events."""
    return sum(part.size for part in open_recording(path))


def _read_by_faery(path: Path) -> int:
    """Read a file with faery and return the number of its events."""
    return sum(len(packet) for packet in faery.events_stream_from_file(path))
