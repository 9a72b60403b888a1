"""Laws that making, checking, slicing and merging keep for every event array."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.events import (
    EVENT_DTYPE,
    check_events,
    make_events,
    merge,
    no_events,
    polarity_sign,
    slice_time,
    windows,
)

WIDTH, HEIGHT = 64, 48
ROWS = st.lists(
    st.tuples(st.integers(0, WIDTH - 1), st.integers(0, HEIGHT - 1), st.integers(0, 1), st.integers(-1000, 1000)),
    max_size=40,
)
EVENTS = ROWS.map(lambda rows: make_events(*(zip(*rows, strict=True) if rows else ([], [], [], []))))


def rows_of(events):
    return sorted(events.tolist())


def cut(events, sizes):
    """Cut events into chunks of the given sizes; the last chunk takes the rest."""
    places = np.cumsum([0, *sizes])
    return [events[a:b] for a, b in zip(places, [*places[1:], None], strict=True)]


def test_the_layout_is_metavisions_event_cd():
    assert EVENT_DTYPE.itemsize == 16
    assert {name: EVENT_DTYPE.fields[name][1] for name in EVENT_DTYPE.names} == {"x": 0, "y": 2, "p": 4, "t": 8}
    assert make_events([1], [2], [1], [3]).tobytes() == bytes([1, 0, 2, 0, 1, 0, 0, 0, 3] + [0] * 7)


@given(ROWS)
def test_made_events_are_sorted_and_lose_nothing(rows):
    events = make_events(*(zip(*rows, strict=True) if rows else ([], [], [], [])))
    assert rows_of(events) == sorted(rows)
    check_events(events, WIDTH, HEIGHT)


def test_events_of_equal_time_keep_their_order():
    assert make_events([3, 1, 2], [0, 0, 0], [1, 1, 1], [5, 5, 4])["x"].tolist() == [2, 3, 1]


@pytest.mark.parametrize("p", [-1, 2, 255])
def test_a_polarity_other_than_0_and_1_is_refused(p):
    with pytest.raises(ValueError, match=f"polarity {p} is neither 0 nor 1; store OFF as 0 and ON as 1"):
        make_events([0, 0], [0, 0], [1, p], [1, 2])


def test_columns_of_different_lengths_are_refused():
    with pytest.raises(ValueError, match=r"\[2, 2, 1, 2\] entries"):
        make_events([0, 0], [0, 0], [1], [1, 2])


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("x", WIDTH, "1 of 3 events have x outside the 64 px wide sensor; the first is number 1"),
        ("y", HEIGHT, "1 of 3 events have y outside the 48 px high sensor; the first is number 1"),
        ("p", -1, "1 of 3 events have a polarity that is neither 0 nor 1; the first is number 1"),
        ("t", 5, "1 of 3 events have a time before the event ahead of it; the first is number 1"),
    ],
)
def test_a_broken_rule_is_counted_and_placed(field, value, words):
    events = make_events([1, 2, 3], [1, 2, 3], [0, 1, 0], [10, 20, 30])
    events[field][1] = value
    with pytest.raises(ValueError, match=words):
        check_events(events, WIDTH, HEIGHT)


def test_another_type_is_refused():
    with pytest.raises(ValueError, match="make them with make_events"):
        check_events(np.zeros(2, [("x", "u2"), ("t", "i8")]), WIDTH, HEIGHT)


@given(EVENTS, st.integers(-1100, 1100), st.integers(-1100, 1100))
def test_a_slice_holds_exactly_the_times_asked_for(events, start_us, end_us):
    inside = [row for row in events.tolist() if start_us <= row[3] < end_us]
    assert slice_time(events, start_us, end_us).tolist() == inside


@given(EVENTS, st.integers(-1100, 1100))
def test_slices_side_by_side_hold_every_event_once(events, border_us):
    parts = slice_time(events, -2000, border_us), slice_time(events, border_us, 2000)
    assert np.concatenate(parts).tolist() == events.tolist()


@given(EVENTS)
def test_the_sign_is_plus_or_minus_one_and_flips_with_the_polarity(events):
    flipped = events.copy()
    flipped["p"] = 1 - events["p"]
    assert (polarity_sign(events) == 2 * events["p"].astype(int) - 1).all()
    assert (polarity_sign(flipped) == -polarity_sign(events)).all()
    assert polarity_sign(events).dtype == np.int8


@given(EVENTS, EVENTS)
def test_merging_keeps_every_event_in_order(first, second):
    together = merge(first, second)
    assert rows_of(together) == sorted(rows_of(first) + rows_of(second))
    check_events(together, WIDTH, HEIGHT)
    assert merge(first).tolist() == first.tolist()


def test_ties_put_the_first_argument_first():
    ones, twos = make_events([1], [0], [1], [7]), make_events([2], [0], [1], [7])
    assert merge(ones, twos)["x"].tolist() == [1, 2]
    assert merge(twos, ones)["x"].tolist() == [2, 1]


def test_empty_arrays_are_legal_everywhere():
    empty = no_events()
    check_events(empty, WIDTH, HEIGHT)
    assert make_events([], [], [], []).dtype == EVENT_DTYPE
    assert slice_time(empty, 0, 10).size == polarity_sign(empty).size == merge().size == merge(empty, empty).size == 0


@given(EVENTS)
def test_nobody_writes_into_events_they_are_given(events):
    events.flags.writeable = False
    polarity_sign(events), merge(events, events), slice_time(events, 0, 10), check_events(events, WIDTH, HEIGHT)


def windows_by_hand(events, length_us, t0_us, max_events):
    """Return what `windows` yields, one event after the other."""
    found = []
    for event in events:
        if event["t"] < t0_us:
            continue
        start_us = t0_us + (int(event["t"]) - t0_us) // length_us * length_us
        if not found or found[-1][0] != start_us or len(found[-1][1]) == max_events:
            found.append((start_us, []))
        found[-1][1].append(event.item())
    return found


@given(
    events=EVENTS,
    sizes=st.lists(st.integers(0, 9), max_size=6),
    length_us=st.integers(1, 400),
    t0_us=st.one_of(st.none(), st.integers(-1200, 1200)),
    max_events=st.one_of(st.none(), st.integers(1, 9)),
)
def test_windows_are_those_cut_by_hand_however_the_stream_is_cut(events, sizes, length_us, t0_us, max_events):
    got = [(t, part.tolist()) for t, part in windows(cut(events, sizes), length_us, t0_us=t0_us, max_events=max_events)]
    first_us = t0_us if t0_us is not None else int(events["t"][0]) if events.size else 0
    assert got == windows_by_hand(events, length_us, first_us, max_events)


def test_windows_refuse_what_is_no_stream():
    one, two = make_events([0], [0], [1], [5]), make_events([0], [0], [1], [4])
    with pytest.raises(ValueError, match="4 us follows 5 us"):
        list(windows([one, two], 10))
    with pytest.raises(ValueError, match="length_us=0 is shorter than one microsecond"):
        list(windows(one, 0))
