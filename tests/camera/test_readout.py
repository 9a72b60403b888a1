"""Tests of the readout against a plain queue, and of its laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import Readout
from bicode_lab.camera.readout import ReadoutQueue, _count_calm
from bicode_lab.events import check_events, make_events, no_events, words


def a_burst(n, span_us, rows=40, seed=0):
    """Return events at random over a span."""
    rng = np.random.default_rng(seed)
    return make_events(
        rng.integers(0, 64, n), rng.integers(0, rows, n), rng.integers(0, 2, n), np.sort(rng.integers(0, span_us, n))
    )


def plain_queue(events, readout):
    """Read row after row, event after event: return which events are kept, their times and the longest wait."""
    kept, times, longest = [], [], 0.0
    sensor_free = 0.0
    buffer, buffer_time = 0.0, 0.0
    before = None
    for number, event in enumerate(events):
        t, row = int(event["t"]), int(event["y"])
        read = max(t, sensor_free)
        longest = max(longest, read - t)
        if (row, t) != before:
            read += readout.row_us  # turn to the row
        before = (row, t)
        sensor_free = read + 1 / readout.peak_mev_per_s
        buffer = max(0.0, buffer - (read - buffer_time) * readout.sustained_mev_per_s)
        buffer_time = read
        if buffer + 1 <= readout.buffer_events:
            buffer += 1
            kept.append(number)
            times.append(int(read))
    return np.array(kept, int), np.array(times, int), longest


@given(
    st.integers(0, 400),
    st.integers(1, 300),
    st.builds(
        Readout,
        row_us=st.sampled_from([0.0, 0.02, 0.5]),
        peak_mev_per_s=st.sampled_from([1.0, 10.0, 1000.0]),
        sustained_mev_per_s=st.sampled_from([0.5, 3.0, 50.0]),
        buffer_events=st.sampled_from([1, 10, 100, 10_000]),
    ),
    st.integers(0, 2**32 - 1),
)
def test_a_plain_queue_does_the_same(n, span_us, readout, seed):
    events = a_burst(n, span_us, seed=seed)
    queue = ReadoutQueue(readout)
    out = queue.pass_on(events)
    kept, times, longest = plain_queue(events, readout)
    assert out.size == kept.size
    assert queue.lost == events.size - kept.size
    assert queue.longest_wait_us == pytest.approx(longest)
    for field in ("x", "y", "p"):
        np.testing.assert_array_equal(out[field], events[field][kept])
    np.testing.assert_array_equal(out["t"], times)
    check_events(out, 64, 40)
    assert (out["t"] >= events["t"][kept]).all()  # never before it fired


def test_a_slow_trickle_passes_untouched():
    # One event each 10 us against 0.021 us a row: no wait reaches the next whole microsecond.
    events = a_burst(1000, 1)
    events["t"] = np.arange(1000) * 10
    queue = ReadoutQueue(Readout())
    np.testing.assert_array_equal(queue.pass_on(events), events)
    assert queue.lost == 0
    assert queue.longest_wait_us == 0


def test_what_is_given_is_not_written_to():
    events = a_burst(1000, 2)
    before = events.copy()
    ReadoutQueue(Readout(peak_mev_per_s=1.0)).pass_on(events)
    np.testing.assert_array_equal(events, before)


def test_in_place_is_the_same():
    events = a_burst(3000, 30)
    readout = Readout(peak_mev_per_s=8.0, sustained_mev_per_s=5.0, buffer_events=200)
    expected = ReadoutQueue(readout).pass_on(events)
    assert expected.size < events.size
    np.testing.assert_array_equal(ReadoutQueue(readout).pass_on(events, in_place=True), expected)


def test_chunks_do_not_matter():
    events = a_burst(3000, 300)
    readout = Readout(row_us=0.0, peak_mev_per_s=8.0, sustained_mev_per_s=5.0, buffer_events=200)
    whole, cut = ReadoutQueue(readout), ReadoutQueue(readout)
    expected = whole.pass_on(events)
    found = np.concatenate([cut.pass_on(part) for part in np.array_split(events, 17)])
    np.testing.assert_array_equal(found, expected)
    assert (cut.lost, cut.longest_wait_us) == (whole.lost, whole.longest_wait_us)
    assert whole.lost > 0
    assert cut.pass_on(no_events()).size == 0


@pytest.mark.parametrize("sustained_mev_per_s", [3.0, 50.0, 1e6])
@pytest.mark.parametrize("start_us", [0, 10**6, 10**12])
@pytest.mark.parametrize("crowd", [3, 30, 3000])
def test_calm_chunks_are_read_at_once_and_as_one_by_one(crowd, start_us, sustained_mev_per_s):
    # Chunks of 0.3 ms, more and less dense, with a crowd in one microsecond of every fourth.
    readout = Readout(sustained_mev_per_s=sustained_mev_per_s, buffer_events=2000)
    queue, parts, found, calm = ReadoutQueue(readout), [], [], 0
    for k, n in enumerate((300, 900, 100, 2000, 5, 900, 300, 20, 600, 100)):
        part = np.concatenate([a_burst(n, 300, seed=k), a_burst(crowd if k % 4 == 0 else 0, 1, seed=k)])
        part["t"][n:] = 150
        part = part[np.argsort(part["t"], kind="stable")]
        part["t"] += start_us + 300 * k
        parts.append(part)
        calm += _count_calm(words(part), queue._state, 0.0, 1e-3, sustained_mev_per_s, 2000)
        found.append(queue.pass_on(part))
    events = np.concatenate(parts)
    kept, times, longest = plain_queue(events, readout)
    out = np.concatenate(found)
    for field in ("x", "y", "p"):
        np.testing.assert_array_equal(out[field], events[field][kept])
    np.testing.assert_array_equal(out["t"], times)
    assert queue.longest_wait_us == longest
    assert calm > 0 or sustained_mev_per_s < 10  # where the link is slow, no chunk is calm


def test_the_link_carries_what_it_promises_and_no_more():
    # 20 events a us for 2 ms over a link of 5 a us with room for 1000: all the rest are lost.
    events = make_events(np.zeros(40_000), np.zeros(40_000), np.zeros(40_000), np.repeat(np.arange(2000), 20))
    queue = ReadoutQueue(Readout(row_us=0.0, peak_mev_per_s=1e6, sustained_mev_per_s=5.0, buffer_events=1000))
    out = queue.pass_on(events)
    assert out.size == pytest.approx(5 * 1999 + 1000, abs=2)
    assert queue.lost == 40_000 - out.size


def test_rows_wait_for_each_other():
    # 720 rows fire in one microsecond, ten events each: 0.02 us to turn to a row, 0.001 us an event.
    events = make_events(np.tile(np.arange(10), 720), np.repeat(np.arange(720), 10), np.ones(7200), np.full(7200, 50))
    queue = ReadoutQueue(Readout(row_us=0.02))
    out = queue.pass_on(events)
    takes = 720 * (0.02 + 10 * 0.001)
    assert queue.longest_wait_us == pytest.approx(takes, abs=0.03)
    assert out["t"][0] == 50
    assert out["t"][-1] == int(50 + takes - 0.001)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"row_us": -1.0}, ["row_us=-1.0", "0 or more"]),
        ({"sustained_mev_per_s": -2.0}, ["sustained_mev_per_s=-2.0"]),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, words):
    with pytest.raises(ValueError) as refused:
        Readout(**settings)
    assert all(word in str(refused.value) for word in words), refused.value
