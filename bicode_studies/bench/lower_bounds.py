"""The least that a loop over events can cost on this machine: what is left to gain in receiver and generator.

Each loop does one thing that theirs cannot do without. The receiver's: read the events, write them
as codes, change the word or byte that an event's pixel has in a table of the receiver's size. The
generator's: one division, exponential and logarithm, one count, one place to store an event at.
Nothing is decided, and nothing else is read.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from bicode_lab.camera import Recorder, Scene
from bicode_lab.camera.pixel_steps import MOST_LANES, fast_exp, fast_log
from bicode_lab.camera.recorder import CHUNK_US
from bicode_lab.events import Events, words
from bicode_lab.kernels import njit
from bicode_lab.recognition.event_codes import AHEAD, ONE, EventCoder, prefetch
from bicode_studies.bench.scaling import seconds_of

CHUNKS = 3  # the generator makes so many, and the last one's events are looked at


def least_ns(events: Events, width: int, height: int, repeats: int = 7) -> pd.Series[float]:
    """The events of a period and its sensor in; the least time of each step out, for an event [ns].

    By processor time, the best of `repeats`. The tables are the receiver's: a byte a pixel (its box), a word of
    2 bytes (its sum in a bin), a word of 8 (its marks); with and without asking for the memory ahead.
    """
    coder = EventCoder(width, height)
    codes = coder(events).codes
    seconds = {
        "read the events": seconds_of(partial(_read, words(events)), repeats),
        "read them, write codes": seconds_of(partial(coder, events), repeats),
    }
    for kind in (np.uint8, np.uint16, np.uint64):
        table = np.zeros(width * height, kind)
        for name, touch in (("", _touch), (", asked for ahead", _touch_ahead)):
            name = f"a code, and {table.nbytes / 1e6:.1f} MB at random{name}"
            seconds[name] = seconds_of(partial(touch, codes, table), repeats)
    return pd.Series(seconds, name="ns") / max(events.size, 1) * 1e9


class UnsortedRecorder(Recorder):
    """A generator that keeps its last chunk of events as it was before it was sorted.

    Attributes
    ----------
    codes, moments : ndarray of uint32, of int32
        Pixel and polarity, and microsecond of the chunk, in the order in which the pixels fired.
    """

    def _take_until(self, start: int, end: int) -> Events:
        is_ready = self._times[: self._count] < end
        self.codes = self._pixels[: self._count][is_ready]
        self.moments = (self._times[: self._count][is_ready].astype(np.int64) - start).astype(np.int32)
        return super()._take_until(start, end)


def least_generator_ns(scene: Scene, repeats: int = 15) -> pd.Series[float]:
    """A scene in, the least time of each step of generating its events out, for an event [ns].

    By processor time, the best of `repeats`, on one chunk's events in the order in which the generator's pixels make
    them. The steps are those of `pixel_steps` (pixels side by side, exponential and logarithm written out) and of
    `sort_by_time` (a count a microsecond, 16 bytes an event); where an event goes to is known before.
    """
    recorder = UnsortedRecorder(scene, CHUNKS * CHUNK_US * 1e-6, np.random.default_rng(0))
    for _ in recorder:
        pass
    codes, moments = recorder.codes, recorder.moments
    places = np.argsort(np.argsort(moments, kind="stable")).astype(np.int32)
    way, aim = np.random.default_rng(0).uniform(0.1, 10.0, (2, MOST_LANES))
    times = -(-codes.size // MOST_LANES)
    ways_s = seconds_of(partial(_ways, way, aim, np.empty(MOST_LANES), times), repeats)
    seconds = {
        "a division, exponential and logarithm": ways_s * codes.size / (times * MOST_LANES),
        "counted by its microsecond": seconds_of(partial(_count, moments, np.zeros(CHUNK_US, np.int32)), repeats),
        "stored at its place": seconds_of(
            partial(_store, codes, moments, places, np.empty((codes.size, 2), np.int64)), repeats
        ),
    }
    return pd.Series(seconds, name="ns") / max(codes.size, 1) * 1e9


@njit(cache=True)
def _read(events):  # type: ignore[no-untyped-def]
    """Words in, something that needs all of them out."""
    seen = np.int64(0)
    for i in range(events.shape[0]):
        seen ^= events[i, 0] ^ events[i, 1]
    return seen


@njit(cache=True)
def _touch(codes, table):  # type: ignore[no-untyped-def]
    """Change what each event's pixel has in the table."""
    for i in range(codes.size - AHEAD):
        table[np.uint64(codes[i]) >> ONE] ^= 1


@njit(cache=True)
def _touch_ahead(codes, table):  # type: ignore[no-untyped-def]
    """The same, each asked for AHEAD events before."""
    for i in range(codes.size - AHEAD):
        prefetch(table, np.uint64(codes[i + AHEAD]) >> ONE)
        table[np.uint64(codes[i]) >> ONE] ^= 1


@njit(cache=True, error_model="numpy")
def _ways(way, aim, out, times):  # type: ignore[no-untyped-def]
    """Fill `out` with log(exp(-way) / aim), side by side, so many times over."""
    for k in range(times):
        for i in range(out.size):
            out[i] = fast_log(fast_exp(-way[i]) / (aim[i] + k))


@njit(cache=True)
def _count(moments, at):  # type: ignore[no-untyped-def]
    """Add each moment to the count of its microsecond."""
    for i in range(moments.size):
        at[moments[i]] += 1


@njit(cache=True)
def _store(codes, moments, places, target):  # type: ignore[no-untyped-def]
    """Write each event's code and moment, two words of 8 bytes, at its place."""
    for i in range(places.size):
        target[places[i], 0] = codes[i]
        target[places[i], 1] = moments[i]
