"""Tests of a marker in another recording: each event of both is kept, in order, with the recording's clock."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_lab.camera import Optics, PixelModel, PlacedMarker, Pose, Recorder, Scene, Still, stream_over
from bicode_lab.events import check_events, make_events, merge, no_events

SMALL = Optics(width=64, height=48)
SCENE = Scene(
    markers=(PlacedMarker(path=Still(Pose.facing(10.0))),),
    optics=SMALL,
    pixel_model=PixelModel(background_hz=50.0, hot_pixels=3),
)


def a_recording(n, span_us, start_us=0, seed=0):
    """Return events at random on the small sensor, the first and the last at the ends of the span."""
    rng = np.random.default_rng(seed)
    t = start_us + np.sort(rng.integers(0, span_us + 1, n))
    if n:
        t[0], t[-1] = start_us, start_us + span_us if n > 1 else start_us
    return make_events(rng.integers(0, 64, n), rng.integers(0, 48, n), rng.integers(0, 2, n), t)


def the_marker_alone(scene, start_us, end_us, seed):
    """Return what the scene adds between two moments of the recording's clock, both included."""
    quiet = replace(scene, pixel_model=replace(scene.pixel_model, background_hz=0.0, hot_pixels=0))
    seconds = (end_us - start_us) * 1e-6 + 0.02
    events = np.concatenate([no_events(), *Recorder(quiet, seconds, np.random.default_rng(seed))])
    events["t"] += start_us
    return events[events["t"] <= end_us]


def as_set(events):
    return np.sort(events, order=["t", "y", "x", "p"])


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 300),
    st.integers(0, 60_000),
    st.integers(0, 10**12),
    st.lists(st.integers(0, 300), max_size=8),
    st.integers(0, 2**32 - 1),
)
def test_both_are_there_and_in_order(n, span_us, start_us, cuts, seed):
    background = a_recording(n, span_us, start_us, seed)
    chunks = list(stream_over(np.split(background, sorted(cuts)), SCENE, np.random.default_rng(seed)))
    assert all(chunk.size for chunk in chunks)
    found = np.concatenate([no_events(), *chunks])
    check_events(found, SMALL.width, SMALL.height)
    start, end = int(background["t"][0]), int(background["t"][-1])
    expected = merge(background, the_marker_alone(SCENE, start, end, seed))
    np.testing.assert_array_equal(as_set(found), as_set(expected))


def test_without_a_marker_the_recording_comes_back():
    background = a_recording(5000, 100_000, 777)
    empty = replace(SCENE, markers=())
    chunks = stream_over(np.array_split(background, 9), empty, np.random.default_rng(0))
    np.testing.assert_array_equal(np.concatenate(list(chunks)), background)


def test_nothing_over_nothing():
    assert list(stream_over([], SCENE, np.random.default_rng(0))) == []
    assert list(stream_over([no_events()] * 3, SCENE, np.random.default_rng(0))) == []


def test_what_is_given_is_not_written_to():
    background = a_recording(1000, 50_000, 123)
    kept = background.copy()
    for chunk in stream_over([background[:500], background[500:]], SCENE, np.random.default_rng(0)):
        chunk["x"] = 0
    np.testing.assert_array_equal(background, kept)


def test_a_minute_without_events_neither_loses_nor_floods():
    gap_us = 60_000_000
    first, second = a_recording(200, 30_000, 5_000, 1), a_recording(200, 30_000, 35_000 + gap_us, 2)
    sizes, real, last = [], 0, 0
    keys = set(np.concatenate([first, second]).tolist())
    total = 0
    for chunk in stream_over([first, second], SCENE, np.random.default_rng(0)):
        assert chunk["t"][0] >= last
        last = int(chunk["t"][-1])
        sizes.append(chunk.size)
        total += chunk.size
        real += sum(event in keys for event in chunk.tolist()) if chunk.size < 2000 else 0
    assert real >= 400
    # One packet of 14 ms is like the other, so a minute holds what its share of a second does.
    second_long = the_marker_alone(SCENE, 0, 1_000_000, 0).size
    assert total - 400 == pytest.approx(second_long * (gap_us + 60_000) / 1e6, rel=0.05)
    assert max(sizes) < 200 + 3 * second_long / 100 + 100  # memory: a chunk of each
