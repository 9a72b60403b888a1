"""From the pixels to the wire: rows are read one after the other, and the link has a limit.

An event's time stamp is taken when its row is read. When many pixels fire at once,
rows wait, which delays events; where the link cannot carry them away in the long run,
its buffer fills and events are lost. Both are counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, words
from bicode_lab.kernels import njit


@dataclass(frozen=True, kw_only=True)
class Readout:
    """Rates of the way out of the sensor.

    Parameters
    ----------
    row_us : float
        Time to turn to a row [us]; 0 by default: the events of a row go together when many wait, and what a turn
        costs is in the vendor's peak rate.
    peak_mev_per_s : float
        Events of a row that can be read a microsecond (vendor: about 1000 Mev/s).
    sustained_mev_per_s : float
        What the link carries away (drivers: about 50 Mev/s over USB).
    buffer_events : int
        What it holds back meanwhile (assumption: 2 million).
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
    """A readout at work: it keeps its place from one chunk to the next, and counts.

    Attributes
    ----------
    lost : int
        Events the link could not carry.
    longest_wait_us : float
        The longest an event waited for its row [us].
    """

    def __init__(self, readout: Readout) -> None:
        self._readout = readout
        self._state = np.zeros(4)  # when the sensor is free [us], events in the buffer, time of that, longest wait
        self.lost = 0

    @property
    def longest_wait_us(self) -> float:
        """The longest an event waited for its row [us]."""
        return float(self._state[3])

    def pass_on(self, events: Events, *, in_place: bool = False) -> Events:
        """A chunk in the order in which its pixels fired in; what comes out of the camera, with its times, out.

        It may be written over the chunk that was given, where that is nobody else's: `in_place`.
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
    """How many of the events, from the first on, `_read_rows` would pass on as they are and forget.

    All but those of the last microsecond, where no microsecond has more than are read and carried away before
    the next one, and than have waited for each other already; else none.
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
    """Events' words in, those that the buffer can hold out with the time they are read at, and their number.

    `out` comes with a copy of the events, or is the same.
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
