"""Code each event of a period in 32 bits, for the loops of the receiver over events.

An event takes 16 bytes, while its pixel and its polarity fit into 4. The receiver reads a period twice: for the
regions, and for the counts in them. So the codes are made once, which also checks that the events lie on the sensor,
and the loops read the codes only. The codes do not hold the time: events are sorted, so that a frame is a contiguous
part of a period, and its ends are looked up.
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

AHEAD = 32  # number of events between the request for a pixel's memory and the work on it
LOW_16 = np.uint64(0xFFFF)
ONE = np.uint64(1)


@dataclass(frozen=True)
class CodedEvents:
    """The events of one period and their codes, which are valid until their `EventCoder` is called again.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    codes : ndarray of uint32, shape (n + AHEAD,)
        2 (y width + x) + polarity of each event, followed by AHEAD entries of padding.
    """

    events: Events
    codes: npt.NDArray[np.uint32]

    def cuts(self, times_us: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Find the first event at or after each of several times.

        Parameters
        ----------
        times_us : ndarray of int64, shape (k,)
            Times in ascending order [us].

        Returns
        -------
        ndarray of int64, shape (k,)
            Number of the event; the number of events if there is none.
        """
        cuts = np.empty(times_us.size, np.int64)
        _cut(words(self.events), times_us, cuts)
        return cuts

    def between(self, start_us: int, end_us: int) -> CodedEvents:
        """Return a view of the events with ``start_us <= t < end_us`` [us] and of their codes."""
        first, end = self.cuts(np.array([start_us, end_us]))
        return CodedEvents(self.events[first:end], self.codes[first : end + AHEAD])


class EventCoder:
    """Coder of the events of one sensor; its memory is used again in every period.

    Parameters
    ----------
    width, height : int
        Sensor size [px], fewer than 2^31 pixels in all.
    """

    def __init__(self, width: int, height: int) -> None:
        self.width = width
        self.height = height
        self._codes = np.zeros(AHEAD, np.uint32)

    def __call__(self, events: Events | CodedEvents) -> CodedEvents:
        """Code events.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
            Events that are coded already are returned as they are.

        Returns
        -------
        CodedEvents

        Raises
        ------
        ValueError
            If events lie outside the sensor.
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
    """Fill in the codes of events, given as `events.words`; return the largest x and the largest y."""
    most_x, most_y = np.uint64(0), np.uint64(0)
    for i in range(events.shape[0]):
        word = np.uint64(events[i, 0])
        x, y = word & LOW_16, (word >> np.uint64(16)) & LOW_16
        most_x, most_y = max(most_x, x), max(most_y, y)
        codes[i] = np.uint32(((y * np.uint64(width) + x) << ONE) | ((word >> np.uint64(32)) & ONE))
    return most_x, most_y


@njit(cache=True)
def _cut(events, times_us, cuts):  # type: ignore[no-untyped-def]
    """Find the first event at or after each time by bisection."""
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
    """Emit the processor's prefetch instruction for ``table[index]``, which loads memory without waiting for it.

    A table of all pixels is larger than the cache of a core, and events access it in no order. The loops know the pixel
    that comes AHEAD events later, so its memory is loaded while they work.
    """

    def code(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        """Call llvm.prefetch for data (last 1) that is written (first 1) and stays in the nearest cache (3)."""
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        pointer = builder.gep(data, [arguments[1]])
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, number, number, number])
        ask = builder.module.declare_intrinsic("llvm.prefetch", (pointer.type,), kind)
        builder.call(ask, [pointer, number(1), number(3), number(1)])
        return context.get_dummy_value()

    return types.void(table, index), code


prefetch: Any = intrinsic(_prefetch)
