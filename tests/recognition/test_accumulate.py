"""Frames by every rule (Fig. 3), against the paper's loop over events; streams of frames."""

import numpy as np
import pytest
from blinker import noise
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.events import Events, make_events, no_events, polarity_sign, windows
from bicode_lab.recognition import accumulate, count_events, frames

WIDTH, HEIGHT = 7, 5


def some_events(seed: int, n_hz: float = 2000.0) -> Events:
    return noise(WIDTH, HEIGHT, n_hz, 0, 10_000, np.random.default_rng(seed))


def papers_loop(events: Events, rule: str) -> np.ndarray:
    """Add the polarities at each coordinate in the order of time; the frame holds the sign (II-A, word for word)."""
    total = np.zeros((HEIGHT, WIDTH), int)
    for x, y, p, _ in events.tolist():
        sign = 1 if p else -1
        if rule == "sum":
            total[y, x] += sign
        elif rule == "last":
            total[y, x] = sign
        else:
            total[y, x] = 1
    return np.sign(total)


@given(seed=st.integers(0, 2**32 - 1), rule=st.sampled_from(["sum", "last", "any"]))
def test_frame_is_the_papers_loop(seed: int, rule: str) -> None:
    events = some_events(seed)
    frame = accumulate(events, WIDTH, HEIGHT, rule)
    assert frame.dtype == np.int8
    np.testing.assert_array_equal(frame, papers_loop(events, rule))


@given(seed=st.integers(0, 2**32 - 1), rule=st.sampled_from(["sum", "last"]))
def test_flipped_polarity_flips_the_frame(seed: int, rule: str) -> None:
    events = some_events(seed)
    flipped = events.copy()
    flipped["p"] = 1 - flipped["p"]
    np.testing.assert_array_equal(accumulate(flipped, WIDTH, HEIGHT, rule), -accumulate(events, WIDTH, HEIGHT, rule))


@given(seed=st.integers(0, 2**32 - 1), dx=st.integers(0, 9), dt=st.integers(0, 2**40))
def test_a_shift_shifts_and_nothing_else(seed: int, dx: int, dt: int) -> None:
    events = some_events(seed)
    moved = events.copy()
    moved["x"] += dx
    moved["t"] += dt
    wide = accumulate(moved, WIDTH + dx, HEIGHT)
    assert not wide[:, :dx].any()
    np.testing.assert_array_equal(wide[:, dx:], accumulate(events, WIDTH, HEIGHT))


def test_counts_are_a_histogram() -> None:
    events = some_events(1)
    expected = np.zeros((HEIGHT, WIDTH), int)
    np.add.at(expected, (events["y"], events["x"]), 1)
    np.testing.assert_array_equal(count_events(events, WIDTH, HEIGHT), expected)
    assert polarity_sign(events).size == expected.sum()


def test_no_events_make_an_empty_frame_and_none_in_a_stream() -> None:
    assert not accumulate(no_events(), 3, 2).any()
    assert list(frames([no_events()], 10, 3, 2)) == []


def test_events_outside_the_sensor_are_refused_with_words() -> None:
    events = make_events([0, 9], [0, 0], [1, 1], [1, 2])
    for make in (accumulate, count_events):
        with pytest.raises(ValueError, match=r"1 of 2 events lie outside the 4 x 4 px sensor \(largest x 9"):
            make(events, 4, 4)


def test_unknown_rule_and_empty_time_are_refused() -> None:
    with pytest.raises(ValueError, match="rule='mean' is not known"):
        accumulate(no_events(), 4, 4, "mean")
    with pytest.raises(ValueError, match="delta_t_us=0"):
        list(frames(no_events(), 0, 4, 4))


def test_frames_come_at_a_constant_rate_empty_ones_too() -> None:
    events = make_events([0, 1, 2], [0, 0, 0], [1, 1, 0], [5, 34, 35])
    stream = list(frames(events, 10, 3, 1))
    assert [t for t, _ in stream] == [5, 15, 25, 35]
    assert [frame.tolist() for _, frame in stream] == [[[1, 0, 0]], [[0, 0, 0]], [[0, 1, 0]], [[0, 0, -1]]]


@given(seed=st.integers(0, 2**32 - 1), borders=st.lists(st.integers(0, 700), max_size=6), dt=st.integers(1, 4000))
def test_how_a_stream_is_chunked_does_not_matter(seed: int, borders: list[int], dt: int) -> None:
    events = some_events(seed)
    whole = list(windows(events, dt))
    parts = list(windows(np.split(events, sorted(borders)), dt))
    assert [t for t, _ in whole] == [t for t, _ in parts]
    for (start, a), (_, b) in zip(whole, parts, strict=True):
        np.testing.assert_array_equal(a, b)
        assert ((a["t"] >= start) & (a["t"] < start + dt)).all()
    assert sum(part.size for _, part in whole) == events.size


def test_a_quiet_gap_of_hours_costs_nothing() -> None:
    hours_us = 7 * 3600 * 10**6
    events = make_events([0, 1], [0, 0], [1, 1], [5, 5 + hours_us])
    assert [t for t, _ in windows(events, 10)] == [5, 5 + hours_us]


def test_time_running_backwards_between_chunks_is_refused() -> None:
    first, second = make_events([0], [0], [1], [50]), make_events([0], [0], [1], [20])
    with pytest.raises(ValueError, match="20 us follows 50 us"):
        list(windows([first, second], 10))


def test_events_ahead_of_t0_are_left_out() -> None:
    events = make_events([0, 1, 2], [0, 0, 0], [1, 1, 1], [5, 15, 25])
    assert [(t, part.size) for t, part in windows(events, 10, t0_us=12)] == [(12, 1), (22, 1)]
