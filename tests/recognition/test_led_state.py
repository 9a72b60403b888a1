"""ON and OFF counts against the 3-valued frame, and the state of the LED (Fig. 2, box g)."""

import numpy as np
import pytest
from blinker import noise
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.events import Events, slice_time
from bicode_lab.recognition import LedCounter, accumulate, count_on_off, edge_gates, led_state

WIDTH, HEIGHT = 12, 9
BOXES = [(1, 1, 4, 3), (6, 2, 5, 6), (0, 7, 3, 2)]


def some_events(seed: int) -> Events:
    return noise(WIDTH, HEIGHT, 3000.0, 1000, 6000, np.random.default_rng(seed))


@given(seed=st.integers(0, 2**32 - 1), delta_t=st.integers(37, 900))
def test_counts_are_the_pixels_of_the_3_valued_frames(seed: int, delta_t: int) -> None:
    """The oracle is the paper's way: count the +1 and -1 in the box, in a frame for each delta_t_ID."""
    events = some_events(seed)
    n_bins = 5000 // delta_t
    counter = LedCounter(WIDTH, HEIGHT)
    for _ in range(2):  # the second time with memory of the first
        n_on, n_off = counter(events, BOXES, 1000, n_bins, delta_t)
    for k in range(n_bins):
        start = 1000 + k * delta_t
        frame = accumulate(slice_time(events, start, start + delta_t), WIDTH, HEIGHT)
        for number, (x, y, w, h) in enumerate(BOXES):
            part = frame[y : y + h, x : x + w]
            assert (n_on[number, k], n_off[number, k]) == ((part > 0).sum(), (part < 0).sum())


@given(seed=st.integers(0, 2**32 - 1))
def test_one_box_alone_counts_as_among_others(seed: int) -> None:
    events = some_events(seed)
    together = LedCounter(WIDTH, HEIGHT)(events, BOXES, 1000, 20, 250, "events")
    for number, box in enumerate(BOXES):
        alone = count_on_off(events, box, 1000, 20, 250, "events")
        np.testing.assert_array_equal(together[0][number], alone[0])
        np.testing.assert_array_equal(together[1][number], alone[1])


def test_counting_events_counts_each_one() -> None:
    events = some_events(3)
    n_on, n_off = count_on_off(events, (0, 0, WIDTH, HEIGHT), 1000, 20, 250, "events")
    assert (n_on.sum(), n_off.sum()) == ((events["p"] == 1).sum(), (events["p"] == 0).sum())


def test_boxes_over_the_sensors_edge_and_overlapping_ones() -> None:
    events = some_events(4)
    n_on, n_off = LedCounter(WIDTH, HEIGHT)(events, [(-3, -3, 9, 9), (4, 4, 99, 99)], 1000, 20, 250, "events")
    inside = (events["x"] < 6) & (events["y"] < 6)
    second = ~inside & (events["x"] >= 4) & (events["y"] >= 4)
    assert (n_on + n_off).sum(axis=1).tolist() == [inside.sum(), second.sum()]


def test_more_boxes_than_a_byte_can_number() -> None:
    events = noise(40, 30, 3000.0, 0, 5000, np.random.default_rng(5))
    boxes = [(x, y, 1, 1) for y in range(30) for x in range(40)]
    counter = LedCounter(40, 30)
    n_on, n_off = counter(events, boxes, 0, 20, 250)
    for k in range(20):
        frame = accumulate(slice_time(events, 250 * k, 250 * (k + 1)), 40, 30).ravel()
        assert (n_on[:, k].tolist(), n_off[:, k].tolist()) == ((frame > 0).tolist(), (frame < 0).tolist())
    few = counter(events, boxes[:2], 0, 20, 250)  # the same memory, few boxes again
    np.testing.assert_array_equal(few, (n_on[:2], n_off[:2]))


@given(lead=st.lists(st.integers(-3, 3), max_size=40), before=st.integers(0, 1))
def test_state_follows_the_larger_side_and_holds_between(lead: list[int], before: int) -> None:
    n_on, n_off = np.maximum(lead, 0) + 1, np.maximum(np.negative(lead), 0) + 1
    state, expected = before, []
    for difference in lead:
        state = 1 if difference > 0 else 0 if difference < 0 else state
        expected.append(state)
    assert led_state(n_on, n_off, before=before).tolist() == expected


def test_a_gate_holds_back_stray_events() -> None:
    n_on, n_off = [900, 0, 0, 0, 1, 0, 950], [0, 0, 800, 30, 0, 0, 0]
    assert led_state(n_on, n_off).tolist() == [1, 1, 0, 0, 1, 1, 1]
    gate_on, gate_off = edge_gates(n_on, n_off, 0.2)
    assert led_state(n_on, n_off, gate_on=gate_on, gate_off=gate_off).tolist() == [1, 1, 0, 0, 0, 0, 1]


def test_no_events_have_no_gate() -> None:
    assert edge_gates([0, 0], [0, 0], 0.2) == (0.0, 0.0)
    assert edge_gates([5, 0], [0, 7], 0.0) == pytest.approx((0.0, 0.0))
