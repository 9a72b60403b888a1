"""Lower bounds of what receiver and generator can cost on this machine, from loops over events that do the least.

Each loop does one thing that receiver or generator cannot do without. For the receiver it reads the events, writes them
as codes, or changes the word or byte of an event's pixel in a table of the receiver's size. For the generator it does
one division, exponential and logarithm, counts one event, or stores one. The loops decide nothing and read nothing
else.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.camera import Recorder, Scene
from bicode_lab.camera.pixel_steps import MAX_LANES, fast_exp, fast_log
from bicode_lab.camera.recorder import CHUNK_US
from bicode_lab.events import Events, words
from bicode_lab.kernels import njit
from bicode_lab.recognition.event_codes import AHEAD, ONE, EventCoder, prefetch
from bicode_studies.bench.timing import cpu_seconds

CHUNKS = 3  # the generator records so many chunks, and the events of the last one are used


def least_ns(events: Events, width: int, height: int, repeats: int = 7) -> pd.Series[float]:
    """Time the least loops of the receiver.

    The tables are those of the receiver: for each pixel one byte (its box), one word of 2 bytes (its sum in a bin), or
    one word of 8 bytes (its marks); with and without fetching the memory ahead.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events of one period.
    width, height : int
        Size of the sensor [px].
    repeats : int
        The shortest processor time of so many counts.

    Returns
    -------
    Series
        Time per event [ns] by step.
    """
    coder = EventCoder(width, height)
    codes = coder(events).codes
    seconds = {
        "read the events": cpu_seconds(partial(_read, words(events)), repeats),
        "read them, write codes": cpu_seconds(partial(coder, events), repeats),
    }
    for kind in (np.uint8, np.uint16, np.uint64):
        table = np.zeros(width * height, kind)
        for name, touch in (("", _touch), (", fetched ahead", _touch_ahead)):
            name = f"a code, and {table.nbytes / 1e6:.1f} MB at random{name}"
            seconds[name] = cpu_seconds(partial(touch, codes, table), repeats)
    return pd.Series(seconds, name="ns") / max(events.size, 1) * 1e9


def last_unsorted_chunk(scene: Scene, chunks: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.int32]]:
    """Record a scene and return the events of its last chunk in the order in which the pixels fire.

    Parameters
    ----------
    scene : Scene
    chunks : int
        Length of the recording, in chunks of `CHUNK_US`.

    Returns
    -------
    codes : ndarray of uint32, shape (n,)
        Pixel and polarity, ``2 * (y * width + x) + p``.
    moments : ndarray of int32, shape (n,)
        Time since the start of the chunk [us].
    """
    kept: list[tuple[npt.NDArray[np.uint32], npt.NDArray[np.int32]]] = []

    def keep(codes: npt.NDArray[np.uint32], moments: npt.NDArray[np.int32]) -> None:
        kept[:] = [(codes, moments)]

    for _ in Recorder(scene, chunks * CHUNK_US * 1e-6, np.random.default_rng(0), on_unsorted=keep):
        pass
    return kept[0]


def least_generator_ns(scene: Scene, repeats: int = 15) -> pd.Series[float]:
    """Time the least loops of the generator, on one chunk of events in the order in which the pixels fire.

    The steps are those of `pixel_steps` (pixels side by side, exponential and logarithm written out) and of
    `sort_by_time` (one count for each microsecond, 16 bytes for each event). The place of each event is known before.

    Parameters
    ----------
    scene : Scene
    repeats : int
        The shortest processor time of so many counts.

    Returns
    -------
    Series
        Time per event [ns] by step.
    """
    codes, moments = last_unsorted_chunk(scene, CHUNKS)
    places = np.argsort(np.argsort(moments, kind="stable")).astype(np.int32)
    way, aim = np.random.default_rng(0).uniform(0.1, 10.0, (2, MAX_LANES))
    times = -(-codes.size // MAX_LANES)
    ways_s = cpu_seconds(partial(_ways, way, aim, np.empty(MAX_LANES), times), repeats)
    seconds = {
        "a division, exponential and logarithm": ways_s * codes.size / (times * MAX_LANES),
        "counted by its microsecond": cpu_seconds(partial(_count, moments, np.zeros(CHUNK_US, np.int32)), repeats),
        "stored at its place": cpu_seconds(
            partial(_store, codes, moments, places, np.empty((codes.size, 2), np.int64)), repeats
        ),
    }
    return pd.Series(seconds, name="ns") / max(codes.size, 1) * 1e9


@njit(cache=True)
def _read(events):  # type: ignore[no-untyped-def]
    """Return a value that depends on all words of the events."""
    seen = np.int64(0)
    for i in range(events.shape[0]):
        seen ^= events[i, 0] ^ events[i, 1]
    return seen


@njit(cache=True)
def _touch(codes, table):  # type: ignore[no-untyped-def]
    """Change the entry of each event's pixel in a table."""
    for i in range(codes.size - AHEAD):
        table[np.uint64(codes[i]) >> ONE] ^= 1


@njit(cache=True)
def _touch_ahead(codes, table):  # type: ignore[no-untyped-def]
    """Do the same, and fetch each entry AHEAD events before it is needed."""
    for i in range(codes.size - AHEAD):
        prefetch(table, np.uint64(codes[i + AHEAD]) >> ONE)
        table[np.uint64(codes[i]) >> ONE] ^= 1


@njit(cache=True, error_model="numpy")
def _ways(way, aim, out, times):  # type: ignore[no-untyped-def]
    """Fill `out` with log(exp(-way) / aim), side by side, as many `times` as asked."""
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
    """Write the code and the moment of each event, two words of 8 bytes, at its place."""
    for i in range(places.size):
        target[places[i], 0] = codes[i]
        target[places[i], 1] = moments[i]
