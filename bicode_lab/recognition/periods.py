"""Bookkeeping of processing periods, which both receivers share.

A stream is read in periods of delta_t_whole (II-A): period k spans [t0 + k delta_t_whole, t0 + (k + 1) delta_t_whole).
The events of a region are counted in bins, which are numbered from t0 on, too. A bin need not end with a period:
the counts of a period cover all bins that it touches, and a bin across a border is counted in both periods, in each
with the events of that period only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.recognition.event_codes import CodedEvents
from bicode_lab.recognition.led_state import CountKind, Counts, LedCounter
from bicode_lab.recognition.track import Track, Tracker

Memory = TypeVar("Memory")


@dataclass(frozen=True, kw_only=True)
class PeriodGrid:
    """Periods and bins of one stream, both numbered from 0 at `t0_us`.

    Parameters
    ----------
    t0_us : int
        Start of period 0 and of bin 0 [us].
    period_us : int
        Length of a period [us].
    bin_us : int
        Length of a bin [us].

    Examples
    --------
    >>> grid = PeriodGrid(t0_us=0, period_us=1000, bin_us=300)
    >>> grid.period_at(2500), grid.first_bin(1), grid.n_bins(1)
    (2, 3, 4)
    """

    t0_us: int
    period_us: int
    bin_us: int

    def period_at(self, t_us: int) -> int:
        """Return the number of the period that holds the time `t_us` [us]."""
        return (t_us - self.t0_us) // self.period_us

    def start_us(self, period: int) -> int:
        """Return the start of a period [us]."""
        return self.t0_us + period * self.period_us

    def first_bin(self, period: int) -> int:
        """Return the number of the bin in which a period starts."""
        return period * self.period_us // self.bin_us

    def n_bins(self, period: int) -> int:
        """Return the number of bins that a period touches."""
        return -(-(period + 1) * self.period_us // self.bin_us) - self.first_bin(period)

    def bin_start_us(self, number: int) -> int:
        """Return the start of a bin [us]."""
        return self.t0_us + number * self.bin_us


class PeriodCounter:
    """Counter of the ON and OFF events of boxes, period by period.

    Parameters
    ----------
    grid : PeriodGrid
    width, height : int
        Sensor size [px].
    count : {"pixels", "events"}
        What is counted, see `led_state.LedCounter`.
    """

    def __init__(self, grid: PeriodGrid, width: int, height: int, count: CountKind) -> None:
        self.grid = grid
        self.count = count
        self._counter = LedCounter(width, height)

    def __call__(self, period: int, events: Events | CodedEvents, boxes: Sequence[Box]) -> tuple[Counts, Counts]:
        """Count the events of each box in the bins that a period touches.

        Parameters
        ----------
        period : int
            Number of the period.
        events : ndarray of EVENT_DTYPE, shape (n,)
            The events of the period.
        boxes : sequence of Box

        Returns
        -------
        n_on, n_off : ndarray of int32, shape (len(boxes), grid.n_bins(period))
            Counts from bin ``grid.first_bin(period)`` on.
        """
        n_bins = self.grid.n_bins(period)
        if not boxes:
            return np.zeros((0, n_bins), np.int32), np.zeros((0, n_bins), np.int32)
        first_us = self.grid.bin_start_us(self.grid.first_bin(period))
        return self._counter(events, boxes, first_us, n_bins, self.grid.bin_us, self.count)


class TrackMemories(Generic[Memory]):
    """Tracks of a stream, and what a receiver remembers of each for as long as the track lives.

    Parameters
    ----------
    max_age : int
        Number of periods that a track survives without a region.
    min_iou : float
        Least intersection over union of padded boxes for a match, 0 .. 1.

    Attributes
    ----------
    next_period : int
        Number of the period that is expected next.
    """

    def __init__(self, max_age: int, min_iou: float) -> None:
        self.next_period = 0
        self._tracker = Tracker(max_age, min_iou)
        self._memories: dict[int, Memory] = {}

    def start_period(self, period: int) -> None:
        """Let the time of the periods without events pass, which are those between the last one and `period`."""
        self._tracker.skip(period - self.next_period)
        self.next_period = period + 1

    def update(self, boxes: Sequence[Box]) -> list[Track]:
        """Match the boxes of a period with the tracks, and forget what belongs to tracks that ended.

        Parameters
        ----------
        boxes : sequence of Box

        Returns
        -------
        list of Track
            The track of each box, in the order of the boxes.
        """
        tracks = self._tracker.update(boxes)
        alive = {track.number for track in self._tracker.tracks}
        self._memories = {number: memory for number, memory in self._memories.items() if number in alive}
        return tracks

    def recall(self, track: Track, make: Callable[[], Memory]) -> Memory:
        """Return the memory of a track; where it has none yet, `make` makes it."""
        if track.number not in self._memories:
            self._memories[track.number] = make()
        return self._memories[track.number]
