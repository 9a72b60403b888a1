"""Tests of lenient time order: as few events as can be are dropped, however the stream is cut into pieces."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_lab.events import EVENT_DTYPE
from bicode_lab.recordings import time_order
from bicode_lab.recordings.time_order import TimeOrder, longest_ordered
from bicode_lab.recordings.validate import BACKWARDS, COUNT, MISTIMED, new_state, new_tally


def fewest_drops(times):
    """Return how many of some times must go at least, by trying."""
    for n in range(len(times) + 1):
        for kept in itertools.combinations(times, len(times) - n):
            if list(kept) == sorted(kept):
                return n
    raise AssertionError


@settings(deadline=None)  # the first call may compile
@given(st.lists(st.integers(0, 6), max_size=8))
def test_as_few_as_can_be_are_dropped(times):
    keep = longest_ordered(np.array(times, np.int64))
    kept = np.array(times)[keep].tolist()
    assert kept == sorted(kept)
    assert len(times) - len(kept) == fewest_drops(times)


def judge(times, cuts, waiting, monkeypatch):
    """Return the times that are kept, and how many were dropped as too early and as too late."""
    monkeypatch.setattr(time_order, "_WAITING_EVENTS", waiting)
    events = np.zeros(len(times), EVENT_DTYPE)
    events["t"] = times
    tally = new_tally()
    order = TimeOrder(new_state(9, 9), tally)
    kept = [order.judge(part) for part in np.split(events, cuts)]
    kept.append(order.judge(events[:0], final=True))
    return (
        np.concatenate([part["t"] for part in kept]).tolist(),
        int(tally[BACKWARDS, COUNT]),
        int(tally[MISTIMED, COUNT]),
    )


@pytest.mark.parametrize("cuts", [[], [50], [49], [51], [10, 20, 30, 40, 50, 60], list(range(1, 100))])
def test_one_time_far_ahead_wherever_the_stream_is_cut(cuts, monkeypatch):
    times = np.arange(100)
    times[50] = 10_000
    assert judge(times, cuts, 8, monkeypatch) == ([t for t in range(100) if t != 50], 0, 1)
    times[50] = -10_000
    assert judge(times, cuts, 8, monkeypatch) == ([t for t in range(100) if t != 50], 1, 0)


def test_a_time_far_ahead_at_the_beginning(monkeypatch):
    assert judge([900, 1, 2, 3], [], 8, monkeypatch) == ([1, 2, 3], 0, 1)


def test_of_two_that_contradict_each_other_the_later_one_goes(monkeypatch):
    assert judge([5, 4, 9], [], 8, monkeypatch) == ([5, 9], 1, 0)


def test_times_in_order_pass_unchanged(monkeypatch):
    times = [0, 0, 1, 5, 5, 9]
    for cuts in ([], [1], [2, 4]):
        assert judge(times, cuts, 2, monkeypatch) == (times, 0, 0)
