"""Lock-in images: against a plain loop over events, and their laws."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.boxes import Box
from bicode_lab.events import Events, make_events
from bicode_lab.pose import LedClock, lock_in
from bicode_lab.pose.lock_in import lock_in_at, phase_times

CLOCK = LedClock(start_us=0, packet_us=14_000, chips=tuple(map(int, "0000001010011010010110011001")))
BOX = Box(100, 50, 12, 10)
SPAN = (14_000.0, 98_000.0)


def lit_events(rng: np.random.Generator, per_edge: int = 2, late_us: float = 120.0) -> Events:
    """Return events of the middle pixels of the box, which follow each edge."""
    times, rises = CLOCK.edges(0, 98_000)
    ys, xs = (each.ravel() for each in np.mgrid[53:57, 104:109])
    rows = []
    for t, rise in zip(times, rises, strict=True):
        for _ in range(per_edge):
            rows.append(np.stack([xs, ys, np.full(xs.size, rise), t + late_us + rng.exponential(60, xs.size)], 1))
    return sorted_events(np.concatenate(rows))


def noise(rng: np.random.Generator, count: int) -> Events:
    return sorted_events(
        np.stack(
            [
                rng.integers(100, 112, count),
                rng.integers(50, 60, count),
                rng.integers(0, 2, count),
                rng.uniform(0, 98_000, count),
            ],
            1,
        )
    )


def sorted_events(rows: np.ndarray) -> Events:
    rows = rows[np.argsort(rows[:, 3], kind="stable")]
    return make_events(*(rows[:, k].astype(np.int64) for k in range(4)))


def test_events_per_edge_are_counted() -> None:
    image = lock_in(lit_events(np.random.default_rng(0)), CLOCK, BOX, *SPAN)
    assert image is not None
    np.testing.assert_allclose(image.image[3:7, 4:9], 4, rtol=0.05)  # two at an ON edge and two at an OFF edge
    assert np.abs(np.delete(image.image, slice(3, 7), 0)).max() == 0
    assert image.t_us == 56_000
    _, rises = CLOCK.edges(*SPAN)
    assert image.n_edges == min(rises.sum(), (~rises).sum())


def test_noise_averages_out_and_its_variance_is_known() -> None:
    rng = np.random.default_rng(1)
    events = noise(rng, 60_000)
    both = np.concatenate([lit_events(rng), events])
    image = lock_in(both[np.argsort(both["t"], kind="stable")], CLOCK, BOX, *SPAN)
    assert image is not None
    dark = np.ones((10, 12), bool)
    dark[3:7, 4:9] = False
    z = image.image[dark] / np.sqrt(image.variance[dark])
    assert abs(z.mean()) < 0.4
    assert 0.6 < z.std() < 1.3
    assert image.image[~dark].mean() == pytest.approx(4, abs=0.5)


def test_a_plain_loop_says_the_same() -> None:
    rng = np.random.default_rng(2)
    both = np.concatenate([lit_events(rng), noise(rng, 5_000)])
    events = both[np.argsort(both["t"], kind="stable")]
    image = lock_in(events, CLOCK, BOX, *SPAN)
    assert image is not None
    # Without weights: in phase minus out of phase, by the ratio of the times, is the same for the sum of all events.
    times, rises = CLOCK.edges(-28_000, SPAN[1])
    total = 0.0
    for polarity in (0, 1):
        n = int((rises == (polarity > 0))[times >= SPAN[0]].sum())
        inside = outside = 0
        for event in events:
            if not SPAN[0] <= event["t"] < SPAN[1] or event["p"] != polarity:
                continue
            last = np.searchsorted(times + image.lag_us, event["t"], side="right") - 1
            if rises[last] == (polarity > 0):
                inside += 1
            else:
                outside += 1
        time_in, time_out = phase_times(times + image.lag_us, rises, *SPAN)
        total += (inside - outside * time_in[polarity].sum() / time_out[polarity]) / n
    assert image.image.sum() == pytest.approx(total, rel=0.05)


def test_a_shift_of_the_events_shifts_the_image() -> None:
    events = lit_events(np.random.default_rng(3))
    first = lock_in(events, CLOCK, BOX, *SPAN)
    moved = events.copy()
    moved["x"] += 2
    moved["y"] -= 1
    moved["t"] += 500_000
    later = LedClock(start_us=500_000, packet_us=14_000, chips=CLOCK.chips)
    second = lock_in(moved, later, BOX, SPAN[0] + 500_000, SPAN[1] + 500_000)
    assert first is not None
    assert second is not None
    np.testing.assert_allclose(second.image[:-1, 2:], first.image[1:, :-2])


def test_only_the_events_of_the_core_tell_the_latency() -> None:
    rng = np.random.default_rng(4)
    late = lit_events(rng, late_us=300)
    flicker = noise(rng, 20_000)
    flicker["x"] = 111
    both = np.concatenate([late, flicker])
    image = lock_in(both[np.argsort(both["t"], kind="stable")], CLOCK, BOX, *SPAN, core=Box(104, 53, 5, 4))
    assert image is not None
    assert 150 <= image.lag_us <= 400
    assert image.image[3:7, 4:9].mean() == pytest.approx(4, rel=0.05)


def test_no_image_without_edges_or_events() -> None:
    assert lock_in(lit_events(np.random.default_rng(5))[:0], CLOCK, BOX, *SPAN) is None
    assert lock_in(lit_events(np.random.default_rng(5)), CLOCK, BOX, 14_000, 16_000) is None  # the LED is off


def test_times_in_and_out_of_phase_make_the_whole_span() -> None:
    times, rises = CLOCK.edges(-14_000, SPAN[1])
    time_in, time_out = phase_times(times, rises, *SPAN)
    assert time_in.sum() == pytest.approx(SPAN[1] - SPAN[0])
    np.testing.assert_allclose(time_in.sum(1), time_out[::-1])
    assert time_in[1].sum() == pytest.approx(6 * sum(CLOCK.chips) * 500)  # six packets


@pytest.mark.parametrize("latest", [160, 13])
def test_late_events_are_left_out_with_their_time(latest: int) -> None:
    rng = np.random.default_rng(6)
    late = lit_events(rng, per_edge=1, late_us=380)
    events = np.concatenate([lit_events(rng, late_us=60), late, noise(rng, 40_000)])
    events = events[np.argsort(events["t"], kind="stable")]
    events = events[(events["t"] >= SPAN[0]) & (events["t"] < SPAN[1])]
    x, y = events["x"].astype(np.int64) - BOX.x, events["y"].astype(np.int64) - BOX.y
    p, t, everything = events["p"].astype(np.int64), events["t"].astype(float), np.ones(events.size, bool)
    image = lock_in_at(x, y, p, t, everything, CLOCK, BOX, *SPAN, latest=latest)
    assert image is not None
    lit = image.image[3:7, 4:9].mean()
    assert lit == pytest.approx(4, abs=0.6) if latest == 13 else lit > 4.7
    assert abs(np.delete(image.image, slice(3, 7), 0).mean()) < 0.1
