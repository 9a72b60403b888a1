"""Write EVT3 files so that the vendor's tools read every event back.

The upper 4 bits of a 16-bit word tell its kind:

    8 TIME_HIGH  upper 12 of 24 bits of the time [us]     0 ADDR_Y   row
    6 TIME_LOW   lower 12 bits                            2 ADDR_X   column and polarity: one event
    3 VECT_BASE  column and polarity, then  4 VECT_12, 4 VECT_12, 5 VECT_8: one bit for each of 32 columns

Trials with the vendor's reader showed what it needs: vectors only in whole groups of a base, 12, 12 and 8 columns;
every TIME_HIGH word, also where there are no events (one each 4.096 ms, otherwise gaps are lost when the 24 bits wrap
after 16.78 s); and time words that begin at 0.

The columns of a vector rise. So only successive events of equal time, row and polarity with rising columns become a
vector, and the order of the events is kept in any case.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, join
from bicode_lab.events import words as as_words
from bicode_lab.kernels import njit

MAX_SIDE_PX = 2048
"""Largest width and height [px]: rows and columns have 11 bits."""
FIRST_TIME_US = 1 << 24
"""A recording that begins later than one turn of the 24-bit clock is shifted so that it begins at 0 [us]."""

_HIGH, _LOW, _ROW = range(3)  # entries of the encoder's state: the last value written of each, -1 before the first
_GROUP_PX = 32
_GROUP_WORDS = 4
_BUFFER_WORDS = 1 << 18
PLACE_BITS = (1 << 33) - 1  # of an event's first word: what is above are bits that fill a record

Ints = npt.NDArray[np.int64]


def evt3_header(width: int, height: int, shift_us: int = 0) -> bytes:
    r"""Return the header of an EVT3 file.

    Parameters
    ----------
    width, height : int
        Sensor size [px].
    shift_us : int
        Time subtracted from the events [us]; the header has a line ``t0`` where it is not 0.

    Returns
    -------
    bytes
        Lines that begin with ``%``.

    Examples
    --------
    >>> evt3_header(640, 480).splitlines()[2:4]
    [b'% format EVT3;height=480;width=640', b'% geometry 640x480']
    """
    lines = [
        "camera_integrator_name Prophesee",
        "evt 3.0",
        f"format EVT3;height={height};width={width}",
        f"geometry {width}x{height}",
        "integrator_name Prophesee",
        "plugin_name hal_plugin_imx636_evk4",
        "sensor_generation 4.2",
        "serial_number 00000000",
        "system_ID 49",
        *([f"t0 {shift_us}"] if shift_us else []),
        "end",
    ]
    return "".join(f"% {line}\n" for line in lines).encode()


@njit(cache=True, nogil=True)
def _encode(
    events: Ints, first: int, stop: int, width: int, state: Ints, words: npt.NDArray[np.uint16]
) -> tuple[int, int]:
    """Encode events from `first` to about `stop`; return the number of words written and the next event.

    The events are given as `events.words` shows them.
    """
    last_high, last_low, last_row = state[_HIGH], state[_LOW], state[_ROW]
    n, i = 0, first
    while i < stop and n + 2 + _GROUP_WORDS < words.size:
        place, t = events[i, 0] & PLACE_BITS, events[i, 1]
        x, y, polarity = place & 0xFFFF, (place >> 16) & 0xFFFF, (place >> 32) << 11
        high, low = t >> 12, t & 0xFFF
        if last_high < high:
            last_high += 1
            last_low = np.int64(-1)
            words[n] = 0x8000 | (last_high & 0xFFF)
            n += 1
            continue
        if last_low != low:
            last_low = low
            words[n] = 0x6000 | low
            n += 1
        if last_row != y:
            last_row = y
            words[n] = y
            n += 1
        base = min(x, max(width - _GROUP_PX, 0))  # a group must lie inside the sensor
        bits = np.int64(1) << (x - base)
        end, j = place - x + base + _GROUP_PX, i + 1  # the same row and polarity, and a column of the group
        before = place
        while j < events.shape[0] and events[j, 1] == t and before < events[j, 0] & PLACE_BITS < end:
            before = events[j, 0] & PLACE_BITS
            bits |= np.int64(1) << ((before & 0xFFFF) - base)
            j += 1
        if j - i > _GROUP_WORDS and width >= _GROUP_PX:
            words[n] = 0x3000 | polarity | base
            words[n + 1] = 0x4000 | (bits & 0xFFF)
            words[n + 2] = 0x4000 | ((bits >> 12) & 0xFFF)
            words[n + 3] = 0x5000 | (bits >> 24)
            n += _GROUP_WORDS
            i = j
        else:
            words[n] = 0x2000 | polarity | x
            n += 1
            i += 1
    state[_HIGH], state[_LOW], state[_ROW] = last_high, last_low, last_row
    return n, i


def encode_evt3(chunks: Iterator[Events], width: int, shift_us: int = 0) -> Iterator[bytes]:
    """Encode events as EVT3 words; the words do not depend on how the events were divided into chunks.

    Parameters
    ----------
    chunks : iterator of ndarray of EVENT_DTYPE, shape (n,)
        Valid events in the order of time.
    width : int
        Sensor width [px].
    shift_us : int
        Time to subtract from every event [us].

    Yields
    ------
    bytes
        Some words, two bytes each.
    """
    state = np.full(3, -1, np.int64)
    words = np.empty(_BUFFER_WORDS, np.uint16)
    held: list[Events] = []
    for chunk in chunks:
        together = join([*held, chunk])
        together["t"][together.size - chunk.size :] -= shift_us
        done = yield from _encode_all(together, max(together.size - _GROUP_PX, 0), width, state, words)
        held = [together[done:].copy()]
    rest = join(held)
    yield from _encode_all(rest, rest.size, width, state, words)
    if state[_HIGH] < 0:
        yield np.array([0x8000, 0x6000], "<u2").tobytes()  # without events the file still needs time words


def _encode_all(
    events: Events, stop: int, width: int, state: Ints, words: npt.NDArray[np.uint16]
) -> Generator[bytes, None, int]:
    """Yield the words of a chunk in blocks; return the first event that is left for the next chunk."""
    i = 0
    while i < stop:
        n, i = _encode(as_words(events), i, stop, width, state, words)
        yield words[:n].astype("<u2").tobytes()
    return i


def write_evt3(file: BinaryIO, chunks: Iterator[Events], width: int, height: int, shift_us: int = 0) -> None:
    """Write an EVT3 file: its header and the words of all events.

    Parameters
    ----------
    file : binary file
        Open for writing.
    chunks, width, shift_us
        See `encode_evt3`.
    height : int
        Sensor height [px].
    """
    file.write(evt3_header(width, height, shift_us))
    for block in encode_evt3(chunks, width, shift_us):
        file.write(block)
