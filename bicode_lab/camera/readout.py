"""The readout, which takes events from the pixels to the computer.

Rows are read one after the other, and the link to the computer is limited. An event gets its time stamp when its row is
read. When many pixels fire at once, rows wait and events are delayed. Where the link cannot carry the events in the
long run, its buffer fills and events are lost. Both are counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, words
from bicode_lab.kernels import njit


@dataclass(frozen=True, kw_only=True)
class Readout:
    """Rates of the readout and the link.

    Parameters
    ----------
    row_us : float
        Time to switch to another row [us]. It is 0 by default: the events of a row are read together when many wait,
        and the vendor's peak rate includes the time to switch.
    peak_mev_per_s : float
        Rate at which the events of a row are read [million events per second] (vendor: about 1000).
    sustained_mev_per_s : float
        Rate that the link carries [million events per second] (drivers: about 50 over USB).
    buffer_events : int
        Number of events that the buffer holds (assumption: 2 million).

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    row_us: float = 0.0
    peak_mev_per_s: float = 1000.0
    sustained_mev_per_s: float = 50.0
    buffer_events: int = 2_000_000

    def __post_init__(self) -> None:
        if not self.row_us >= 0:
            raise ValueError(f"row_us={self.row_us} is negative; choose 0 or more")
        for name in ("peak_mev_per_s", "sustained_mev_per_s", "buffer_events"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} lets nothing through; choose more than 0")


class ReadoutQueue:
    """A readout at work, which keeps its state from one chunk to the next.

    Parameters
    ----------
    readout : Readout

    Attributes
    ----------
    lost : int
        Number of events that the link could not carry.
    """

    def __init__(self, readout: Readout) -> None:
        self._readout = readout
        self._state = np.zeros(4)  # when the sensor is free [us], events in the buffer, time of that, longest wait
        self.lost = 0

    @property
    def longest_wait_us(self) -> float:
        """The longest time that an event has waited for its row [us]."""
        return float(self._state[3])

    def pass_on(self, events: Events, *, in_place: bool = False) -> Events:
        """Pass a chunk of events through the readout.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)
            Sorted by the times at which the pixels fired.
        in_place : bool
            True if the result may be written over `events`.

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (at most n,)
            The events that are not lost, with the times at which they are read.
        """
        out = events if in_place else events.copy()
        r = self._readout
        kept = int(
            _read_rows(words(events), words(out), self._state, r.row_us, 1 / r.peak_mev_per_s, r.sustained_mev_per_s,
                       r.buffer_events)
        )  # fmt: skip
        self.lost += events.size - kept
        return out[:kept]


@njit(cache=True)
def _count_calm(
    events: npt.NDArray[np.int64],
    state: npt.NDArray[np.float64],
    row_us: float,
    event_us: float,
    drain: float,
    room: int,
) -> int:
    """Return how many of the first events `_read_rows` would pass on unchanged, without any effect on later events.

    These are all events but those of the last microsecond, if no microsecond holds more events than are read and
    carried before the next one, or than have waited for each other already; otherwise there are none.
    """
    t, n = events[:, 1], events.shape[0]
    if n == 0 or row_us > 0.0 or state[0] > t[0] or state[1] > (t[0] - state[2]) * drain:
        return 0
    step = event_us + t[-1] * 2.3e-16  # sums of times are rounded
    few = int(min(float(min(n, room)), 0.99 / step, 0.99 * drain / (1 + step * drain), 0.99 * state[3] / step + 1))
    first, after, crowded = t[: n - few], t[few:], 0
    for i in range(first.size):
        crowded += first[i] == after[i]
    return 0 if crowded else int(np.searchsorted(t, t[-1]))


@njit(cache=True)
def _read_rows(
    events: npt.NDArray[np.int64],
    out: npt.NDArray[np.int64],
    state: npt.NDArray[np.float64],
    row_us: float,
    event_us: float,
    drain: float,
    room: int,
) -> int:
    """Write the events that the buffer can hold, with the times at which they are read, to `out`; return their number.

    `out` holds a copy of the events, or is the same array.
    """
    free, held, held_at, longest, last_row, last_t = state[0], state[1], state[2], state[3], -1, -1
    kept = calm = _count_calm(events, state, row_us, event_us, drain, room)
    for i in range(calm, events.shape[0]):
        t, row = events[i, 1], (events[i, 0] >> 16) & 0xFFFF
        start = max(float(t), free)
        longest = max(longest, start - t)
        if row != last_row or t != last_t:
            start += row_us
        last_row, last_t = row, t
        free = start + event_us
        held = max(0.0, held - (start - held_at) * drain)
        held_at = start
        if held + 1 > room:
            continue
        held += 1
        out[kept, 0], out[kept, 1] = events[i, 0], max(t, int(start))
        kept += 1
    state[0], state[1], state[2], state[3] = free, held, held_at, longest
    return kept
