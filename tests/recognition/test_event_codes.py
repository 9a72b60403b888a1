"""Codes of events, and the search for the first event at or after a time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from bicode_lab.events import Events, make_events, no_events, slice_time
from bicode_lab.recognition.event_codes import AHEAD, EventCoder, prefetch

WIDTH, HEIGHT = 31, 17


def some_events(n: int, seed: int) -> Events:
    """Make events anywhere on the sensor, within 10 ms."""
    rng = np.random.default_rng(seed)
    return make_events(*(rng.integers(end, size=n) for end in (WIDTH, HEIGHT, 2, 10_000)))


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 5000))
def test_a_code_is_the_pixels_number_and_the_polarity(seed: int, n: int) -> None:
    coder = EventCoder(WIDTH, HEIGHT)
    for part in (seed, seed + 1):  # the second time in memory that held the first
        events = some_events(n, part)
        coded = coder(events)
        expected = [2 * (int(y) * WIDTH + int(x)) + int(p) for x, y, p, _ in events.tolist()]
        assert coded.codes[: events.size].tolist() == expected
        assert coder(coded) is coded


@given(seed=st.integers(0, 2**32 - 1), times_us=st.lists(st.integers(-10, 11_000), max_size=20))
def test_cuts_are_where_numpy_finds_them(seed: int, times_us: list[int]) -> None:
    events = some_events(2000, seed)
    times = np.array(sorted(times_us), np.int64)
    cuts = EventCoder(WIDTH, HEIGHT)(events).cuts(times)
    assert cuts.tolist() == np.searchsorted(events["t"], times).tolist()


@given(seed=st.integers(0, 2**32 - 1), start_us=st.integers(-10, 11_000), length_us=st.integers(0, 11_000))
def test_between_two_times_are_their_events_and_codes(seed: int, start_us: int, length_us: int) -> None:
    coder, events = EventCoder(WIDTH, HEIGHT), some_events(2000, seed)
    part = coder(events).between(start_us, start_us + length_us)
    np.testing.assert_array_equal(part.events, slice_time(events, start_us, start_us + length_us))
    again = EventCoder(WIDTH, HEIGHT)(part.events)
    assert part.codes[: part.events.size].tolist() == again.codes[: part.events.size].tolist()
    assert part.codes.size == part.events.size + AHEAD


def test_no_events_have_no_codes_and_every_time_is_behind_them() -> None:
    coded = EventCoder(WIDTH, HEIGHT)(no_events())
    assert coded.cuts(np.array([0, 5])).tolist() == [0, 0]
    assert not coded.codes.any()


@pytest.mark.parametrize(("x", "y"), [(WIDTH, 0), (0, HEIGHT), (65535, 65535)])
def test_one_event_outside_the_sensor_is_refused_with_words(x: int, y: int) -> None:
    coder = EventCoder(WIDTH, HEIGHT)
    with pytest.raises(ValueError, match=rf"1 of 2 events lie outside the 31 x 17 px sensor \(largest x {x}, y {y}"):
        coder(make_events([0, x], [0, y], [1, 1], [1, 2]))
    assert coder(make_events([WIDTH - 1], [HEIGHT - 1], [1], [1])).codes[0] == 2 * WIDTH * HEIGHT - 1


def test_asking_for_memory_changes_none_of_it() -> None:
    @njit
    def ask_all(table):  # type: ignore[no-untyped-def]
        for i in range(table.size):
            prefetch(table, np.uint64(i))

    table = np.arange(1000, dtype=np.uint64)
    ask_all(table)
    assert table.tolist() == list(range(1000))
