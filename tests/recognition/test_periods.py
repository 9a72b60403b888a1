"""Period bookkeeping that both receivers share."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.boxes import Box
from bicode_lab.events import make_events
from bicode_lab.recognition.periods import PeriodCounter, PeriodGrid, TrackMemories


@given(
    t0_us=st.integers(0, 2**45),
    period_us=st.integers(1, 5000),
    bin_us=st.integers(1, 900),
    period=st.integers(0, 10**6),
)
def test_a_period_touches_the_bins_that_hold_its_times(t0_us: int, period_us: int, bin_us: int, period: int) -> None:
    grid = PeriodGrid(t0_us=t0_us, period_us=period_us, bin_us=bin_us)
    start_us, end_us = grid.start_us(period), grid.start_us(period + 1)
    assert [grid.period_at(t_us) for t_us in (start_us - 1, start_us, end_us - 1, end_us)] == [
        period - 1, period, period, period + 1,
    ]  # fmt: skip
    first, n = grid.first_bin(period), grid.n_bins(period)
    assert grid.bin_start_us(first) <= start_us < grid.bin_start_us(first + 1)
    assert grid.bin_start_us(first + n - 1) < end_us <= grid.bin_start_us(first + n)


def test_a_bin_across_the_border_is_counted_in_both_periods() -> None:
    grid = PeriodGrid(t0_us=100, period_us=1000, bin_us=300)
    counter = PeriodCounter(grid, 10, 10, "events")
    times_us = [1050, 1150]  # bin 3 spans 1000 .. 1300, period 1 starts at 1100
    events = make_events([2, 2], [3, 3], [1, 1], times_us)
    n_on, _ = counter(0, events[:1], [Box(0, 0, 5, 5)])
    assert n_on.tolist() == [[0, 0, 0, 1]]
    n_on, n_off = counter(1, events[1:], [Box(0, 0, 5, 5)])
    assert n_on.tolist() == [[1, 0, 0, 0]]
    assert not n_off.any()
    assert counter(1, events, [])[0].shape == (0, 4)
    assert n_on.dtype == np.int32


def test_a_memory_lives_as_long_as_its_track() -> None:
    tracks: TrackMemories[list[int]] = TrackMemories(max_age=2, min_iou=0.1)
    for period in (0, 1, 3):  # period 2 has no events
        tracks.start_period(period)
        (track,) = tracks.update([Box(5, 5, 4, 4)])
        tracks.recall(track, list).append(period)
    assert tracks.recall(track, list) == [0, 1, 3]
    assert tracks.next_period == 4
    tracks.start_period(7)  # three periods without a region: the track ends
    (other,) = tracks.update([Box(5, 5, 4, 4)])
    assert other.number != track.number
    assert tracks.recall(other, list) == []
    assert tracks.recall(track, lambda: [-1]) == [-1]
