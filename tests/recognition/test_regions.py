"""Regions in which something blinks (Fig. 2, boxes d to f)."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from blinker import blink, hot_pixels, noise, plate, square
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from bicode_lab.events import Events, make_events, merge, no_events
from bicode_lab.marker import Board, Marker
from bicode_lab.recognition import ReceiverSettings, Region, RegionFinder, find_regions

SMALL = ReceiverSettings(width=200, height=150)


def boxes(regions: list[Region]) -> list[tuple[int, int, int, int]]:
    return [(r.x, r.y, r.w, r.h) for r in regions]


def papers_way(events: Events, s: ReceiverSettings) -> list[tuple[int, int, int, int]]:
    """Apply the rule with whole frames: ON and OFF frames, 3 x 3 dilation, votes, and closing by OpenCV."""
    n_bins = min(32, int(np.ceil(s.delta_t_whole_us / (s.delta_t_blinker_us / 2))))
    marks = np.zeros((2, n_bins, s.height, s.width), np.uint8)
    bins = np.minimum(events["t"] * n_bins // s.delta_t_whole_us, n_bins - 1)
    marks[events["p"], bins, events["y"], events["x"]] = 1
    near = np.array([[cv2.dilate(mark, np.ones((3, 3), np.uint8)) for mark in side] for side in marks])
    frames = near[:, :-1] | near[:, 1:]
    votes = (frames[0] & frames[1]).sum(axis=0)
    moments = (marks[0] | marks[1]).sum(axis=0)
    kept = (votes >= np.ceil(s.min_blink_fraction * (n_bins - 1))) & (moments >= 3)
    if s.opening_px > 1:
        kept = ndimage.binary_opening(kept, np.ones((s.opening_px, s.opening_px)))
    # At twice the size, pixels up to closing_px + 1 apart touch when each grows by closing_px on all sides.
    side = s.closing_px + 1
    large = cv2.resize(kept.astype(np.uint8), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    grown = cv2.dilate(large, np.ones((2 * side - 1, 2 * side - 1), np.uint8))
    _, labels = cv2.connectedComponents(grown, connectivity=8)
    found = []
    for label in range(1, labels.max() + 1):
        y, x = np.nonzero((labels[::2, ::2] == label) & kept)
        if x.size >= s.min_region_pixels:
            found.append((int(x.min()), int(y.min()), int(x.max()), int(y.max())))
    return [(x0, y0, x1 - x0 + 1, y1 - y0 + 1) for x0, y0, x1, y1 in joined(found)]


def joined(found: list[tuple[int, int, int, int]]) -> list[tuple[int, int, int, int]]:
    """Merge the boxes that overlap, given by their corners."""
    for i, a in enumerate(found):
        for b in found[:i]:
            if a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]:
                both = (min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3]))
                return joined([box for box in found if box not in (a, b)] + [both])
    return found


@given(seed=st.integers(0, 2**32 - 1), closing=st.integers(0, 6), least=st.integers(1, 4))
@settings(max_examples=40)
def test_regions_are_those_of_whole_frames(seed: int, closing: int, least: int) -> None:
    rng = np.random.default_rng(seed)
    s = ReceiverSettings(width=60, height=40, closing_px=closing, min_region_pixels=least)
    parts = [noise(60, 40, 20.0, 0, 33_000, rng)]
    for k, corner in enumerate([(5, 5), (25, 8), (45, 25)]):
        side = int(rng.integers(1, 9))
        mask = rng.random(side * side) < 0.5
        pixels = tuple(column[mask] for column in square(*corner, side))
        parts.append(blink(Marker(payload=k), pixels, 33_000, rng, probability=0.6))
    events = merge(*parts)
    events = events[events["t"] < 33_000]
    assert sorted(boxes(find_regions(events, 0, s))) == sorted(papers_way(events, s))


@pytest.mark.parametrize(("half_frames", "is_kept"), [(2, False), (3, True)])
def test_a_kept_pixel_has_events_of_its_own_in_three_half_frames(half_frames: int, is_kept: bool) -> None:
    """A pixel beside a marker has the votes of its neighbours; two events of noise do not make it a part of it."""
    events = blink(Marker(), square(20, 20, 4), 33_000, np.random.default_rng(0))
    half_us = 33_000 / 32
    times_us = (np.array([3.5, 9.5, 20.5])[:half_frames] * half_us).astype(int)
    beside = make_events(np.full(half_frames, 24), np.full(half_frames, 21), np.ones(half_frames), times_us)
    expected = [(20, 20, 5 if is_kept else 4, 4)]
    assert boxes(find_regions(merge(events[events["t"] < 33_000], beside), 0, SMALL)) == expected


@pytest.mark.parametrize(("fraction", "least"), [(0.3, 10), (9 / 31, 9), (0.0, 1), (1.0, 31), (0.01, 1)])
def test_votes_must_reach_the_fraction_of_the_frames(fraction: float, least: int) -> None:
    """Of 31 frames 30 % are 9.3, so that 9 votes are too few. Frame k holds the half frames k and k + 1."""
    finder = RegionFinder(replace(SMALL, min_blink_fraction=fraction, min_region_pixels=1))
    assert (finder.n_frames, finder.min_votes) == (31, least)
    for n_halves in range(3, 32):  # half frames in a row with events of both polarities, from number 1 on
        halves = np.repeat(np.arange(1, n_halves + 1), 2)
        t = ((halves + 0.5) * 33_000 / 32).astype(int)
        events = make_events(np.full(t.size, 9), np.full(t.size, 9), np.tile([0, 1], n_halves), t)
        votes = min(n_halves + 1, 31)  # the frames before, between and behind them
        assert bool(finder(events, 0)) == (votes >= least)


@pytest.mark.parametrize("glow", ["black", "white"])
@pytest.mark.parametrize("side", [33, 82, 165])
@pytest.mark.parametrize("rule", ["blink", "any"])
def test_a_near_marker_is_one_box(glow: str, side: int, rule: str) -> None:
    rng = np.random.default_rng(0)
    marker = Marker(board=Board(glow=glow))
    s = ReceiverSettings(width=400, height=300, frame_rule_blinker=rule)
    events = blink(marker, plate(marker, 100, 60, side), 33_000, rng)
    assert boxes(find_regions(events, 0, s)) == [(100, 60, side, side)]


@pytest.mark.parametrize("side", [3, 4, 6])
def test_a_far_marker_that_misses_edges_is_found_in_every_period(side: int) -> None:
    rng = np.random.default_rng(1)
    finder = RegionFinder(SMALL)
    events = merge(
        blink(Marker(phase_us=777), square(90, 70, side), 40 * 33_000, rng, probability=0.3),
        noise(200, 150, 0.003, 0, 40 * 33_000, rng),
        hot_pixels(20, 200, 150, 134.0, 40 * 33_000, rng),
    )
    for k in range(40):
        regions = finder(events[(events["t"] >= k * 33_000) & (events["t"] < (k + 1) * 33_000)], k * 33_000)
        assert len(regions) == 1
        x, y, w, h = boxes(regions)[0]
        assert x >= 90
        assert y >= 70
        assert x + w <= 90 + side
        assert y + h <= 70 + side


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_swapping_on_and_off_changes_nothing(seed: int) -> None:
    """Detection must not depend on an imbalance of ON and OFF."""
    rng = np.random.default_rng(seed)
    events = blink(Marker(payload=int(rng.integers(256))), square(20, 20, 4), 33_000, rng, probability=0.4)
    events = events[events["t"] < 33_000]
    swapped = events.copy()
    swapped["p"] = 1 - swapped["p"]
    assert find_regions(events, 0, SMALL) == find_regions(swapped, 0, SMALL)


def test_a_balanced_blinker_is_found() -> None:
    """Each pair of edges makes one ON and one OFF event: the sum over delta_t_blinker is 0 in most frames."""
    times_us, levels = Marker().waveform.steps(0, 33_000)
    x, y = square(20, 20, 4)
    n = times_us.size - 1
    events = make_events(np.tile(x, n), np.tile(y, n), np.repeat(levels[1:] > 0, 16), np.repeat(times_us[1:] + 40, 16))
    assert boxes(find_regions(events, 0, SMALL)) == [(20, 20, 4, 4)]


@given(dx=st.integers(0, 150), dy=st.integers(0, 100), dt=st.integers(0, 2**40))
@settings(max_examples=30)
def test_a_shift_shifts_the_boxes_and_nothing_else(dx: int, dy: int, dt: int) -> None:
    events = blink(Marker(), square(3, 2, 5), 32_000, np.random.default_rng(0), probability=0.5)
    moved = events.copy()
    moved["x"] += dx
    moved["y"] += dy
    moved["t"] += dt
    here, there = find_regions(events, 0, SMALL), find_regions(moved, dt, SMALL)
    assert there == [replace(r, x=r.x + dx, y=r.y + dy) for r in here]


def test_two_markers_four_pixels_apart_are_two() -> None:
    rng = np.random.default_rng(2)
    events = merge(
        blink(Marker(payload=1), square(20, 20, 12), 33_000, rng),
        blink(Marker(payload=2, phase_us=5000), square(36, 20, 12), 33_000, rng),
    )
    assert sorted(boxes(find_regions(events, 0, SMALL))) == [(20, 20, 12, 12), (36, 20, 12, 12)]


def test_a_moving_edge_is_no_region() -> None:
    """A bar of light crosses the sensor by one pixel per millisecond, with ON at its front and OFF at its back."""
    x, t = np.arange(33), np.arange(33) * 1000
    parts = [
        make_events(np.repeat(x + at, 150 * 3), np.tile(np.repeat(np.arange(150), 3), 33), np.full(33 * 450, p),
                    np.repeat(t, 450) + np.tile([0, 200, 400], 33 * 150))
        for at, p in ((40, 1), (80, 0))
    ]  # fmt: skip
    assert find_regions(merge(*parts), 0, SMALL) == []


def test_noise_and_hot_pixels_are_no_region() -> None:
    rng = np.random.default_rng(3)
    events = merge(noise(200, 150, 5.0, 0, 33_000, rng), hot_pixels(50, 200, 150, 134.0, 33_000, rng))
    assert find_regions(events, 0, SMALL) == []
    assert find_regions(no_events(), 0, SMALL) == []


def test_a_flood_of_blinkers_is_cut_to_the_strongest() -> None:
    rng = np.random.default_rng(4)
    spots = [square(x, y, 2) for x in range(0, 200, 8) for y in range(0, 150, 8)]
    events = merge(
        *(blink(Marker(), spot, 33_000, rng) for spot in spots), blink(Marker(), square(3, 3, 4), 33_000, rng)
    )
    regions = find_regions(events, 0, replace(SMALL, max_regions=5))
    assert len(regions) == 5
    assert regions[0].n_pixels == max(r.n_pixels for r in regions)


def test_the_memory_is_clean_after_a_period_and_after_an_error() -> None:
    rng = np.random.default_rng(5)
    finder = RegionFinder(SMALL)
    events = blink(Marker(), square(20, 20, 5), 33_000, rng)
    first = finder(events, 0)
    assert finder(no_events(), 0) == []
    with pytest.raises(ValueError, match="1 of 1 events lie outside the 200 x 150 px sensor"):
        finder(make_events([200], [0], [1], [0]), 0)
    assert finder(events, 0) == first


def test_the_memory_is_clean_after_a_crowded_period_and_a_quiet_one() -> None:
    rng = np.random.default_rng(6)
    finder = RegionFinder(SMALL)
    crowd, quiet = noise(200, 150, 300.0, 0, 33_000, rng), blink(Marker(), square(20, 20, 5), 33_000, rng)
    expected = [find_regions(events, 0, SMALL) for events in (crowd, quiet)]
    for k in (0, 0, 1, 1, 0, 1):
        assert finder((crowd, quiet)[k], 0) == expected[k]
