"""Events as pixel numbers: what the receiver's loops over events read.   events of one period -> one 32-bit code each

An event is 16 bytes; where it was and which way it went fit into 4. The receiver reads a period
twice, for the regions and for the counts in them, so the codes are made once, the sensor's edge
is checked on the way, and the loops behind look at nothing but codes. Time is not in them: events
are sorted, so a frame is a stretch of the period, and its ends are looked up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from bicode_lab.events import Events, words
from bicode_lab.kernels import njit

AHEAD = 32  # events between asking for a pixel's memory and working on it
LOW_16 = np.uint64(0xFFFF)
ONE = np.uint64(1)


@dataclass(frozen=True)
class CodedEvents:
    """The events of one period and their codes; good until the maker is called again.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    codes : ndarray of uint32, shape (n + AHEAD,)
        2 (y width + x) + polarity, and some more behind the last that mean nothing.
    """

    events: Events
    codes: npt.NDArray[np.uint32]

    def cuts(self, times_us: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Rising times in, shape (k,) [us]; number of the first event at or behind each out, shape (k,)."""
        cuts = np.empty(times_us.size, np.int64)
        _cut(words(self.events), times_us, cuts)
        return cuts

    def between(self, start_us: int, end_us: int) -> CodedEvents:
        """Two times in, a view of the events with ``start_us <= t < end_us`` and their codes out."""
        first, end = self.cuts(np.array([start_us, end_us]))
        return CodedEvents(self.events[first:end], self.codes[first : end + AHEAD])


class EventCoder:
    """Memory for the codes of one sensor's events, used period after period.

    Parameters
    ----------
    width, height : int
        Sensor [px], of fewer than 2^31 pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width = width
        self.height = height
        self._codes = np.zeros(AHEAD, np.uint32)

    def __call__(self, events: Events | CodedEvents) -> CodedEvents:
        """Events in, the same with their codes out; those that have them are given back.

        Raises
        ------
        ValueError
            Where events lie outside the sensor.
        """
        if isinstance(events, CodedEvents):
            return events
        if self._codes.size < events.size + AHEAD:
            self._codes = np.zeros(events.size * 5 // 4 + AHEAD, np.uint32)
        codes = self._codes[: events.size + AHEAD]
        most_x, most_y = _encode(words(events), self.width, codes)
        if most_x >= self.width or most_y >= self.height:
            outside = np.count_nonzero((events["x"] >= self.width) | (events["y"] >= self.height))
            raise ValueError(
                f"{outside} of {events.size} events lie outside the {self.width} x {self.height} px sensor "
                f"(largest x {most_x}, y {most_y}); give the recording's width and height"
            )
        codes[events.size :] = 0
        return CodedEvents(events, codes)


@njit(cache=True)
def _encode(events, width, codes):  # type: ignore[no-untyped-def]
    """Words in, see `events.words`; their codes are filled in, and the largest x and y come out."""
    most_x, most_y = np.uint64(0), np.uint64(0)
    for i in range(events.shape[0]):
        word = np.uint64(events[i, 0])
        x, y = word & LOW_16, (word >> np.uint64(16)) & LOW_16
        most_x, most_y = max(most_x, x), max(most_y, y)
        codes[i] = np.uint32(((y * np.uint64(width) + x) << ONE) | ((word >> np.uint64(32)) & ONE))
    return most_x, most_y


@njit(cache=True)
def _cut(events, times_us, cuts):  # type: ignore[no-untyped-def]
    """Halve until the first event at or behind each time is found."""
    low = 0
    for k in range(times_us.size):
        high = events.shape[0]
        while low < high:
            middle = (low + high) // 2
            if events[middle, 1] < times_us[k]:
                low = middle + 1
            else:
                high = middle
        cuts[k] = low


def _prefetch(typingctx, table, index):  # type: ignore[no-untyped-def]
    """Ask for the memory of table[index], and do not wait for it: a processor's own instruction.

    A table of all pixels is larger than a core's cache, and events jump about in it. The loops know
    which pixel comes in AHEAD events, so its memory is on the way while they work.
    """

    def code(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        """To be written to (1), to stay in the nearest cache (3), data (1)."""
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        pointer = builder.gep(data, [arguments[1]])
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, number, number, number])
        ask = builder.module.declare_intrinsic("llvm.prefetch", (pointer.type,), kind)
        builder.call(ask, [pointer, number(1), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(table, index), code


prefetch: Any = intrinsic(_prefetch)
