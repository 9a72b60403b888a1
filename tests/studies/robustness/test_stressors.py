"""Each stressor damages events as it says and no more, and trials repeat."""

import numpy as np
import pandas as pd
import pytest

from bicode_lab.events import Events, check_events, make_events
from bicode_studies.paper_experiments.scenes import window_scene
from bicode_studies.robustness import stressors as module
from bicode_studies.robustness.stressors import (
    STRESSORS,
    StressCondition,
    add_hot_pixels,
    add_noise,
    drop_events,
    jitter_times,
    saturate_readout,
    stress,
    stress_curves,
)

WIDTH, HEIGHT, DURATION_US = 40, 30, 1_000_000


@pytest.fixture
def events() -> Events:
    rng = np.random.default_rng(1)
    n = 20_000
    return make_events(
        rng.integers(WIDTH, size=n),
        rng.integers(HEIGHT, size=n),
        rng.integers(2, size=n),
        rng.integers(DURATION_US, size=n),
    )


def as_counts(events: Events) -> dict[tuple[int, ...], int]:
    rows, counts = np.unique(np.array([events[name] for name in "xypt"]).T, axis=0, return_counts=True)
    return dict(zip(map(tuple, rows.tolist()), counts.tolist(), strict=True))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_the_share_said_is_lost_and_the_rest_is_as_it_was(events: Events, share: float) -> None:
    before = events.copy()
    left = drop_events(events, share, np.random.default_rng(0))
    sigma = np.sqrt(events.size * share * (1 - share))
    assert abs(left.size - events.size * (1 - share)) <= 5 * sigma
    whole = as_counts(events)
    assert all(count <= whole[row] for row, count in as_counts(left).items())
    assert np.array_equal(events, before)


@pytest.mark.parametrize("rate_hz", [0.0, 3.0])
def test_noise_comes_on_top_everywhere_at_its_rate(events: Events, rate_hz: float) -> None:
    more = add_noise(events, rate_hz, DURATION_US, WIDTH, HEIGHT, np.random.default_rng(0))
    check_events(more, WIDTH, HEIGHT)
    expected = rate_hz * WIDTH * HEIGHT
    assert abs(more.size - events.size - expected) <= 5 * np.sqrt(expected)
    whole = as_counts(more)
    assert all(count <= whole[row] for row, count in as_counts(events).items())


def test_hot_pixels_are_few_and_fire_all_the_time() -> None:
    nothing = make_events([], [], [], [])
    hot = add_hot_pixels(nothing, 0.05, DURATION_US, WIDTH, HEIGHT, np.random.default_rng(0))
    check_events(hot, WIDTH, HEIGHT)
    pixels, counts = np.unique(hot["y"].astype(int) * WIDTH + hot["x"], return_counts=True)
    assert abs(pixels.size - 0.05 * WIDTH * HEIGHT) <= 5 * np.sqrt(60)
    assert 60 < counts.max() < 134 + 5 * np.sqrt(134)
    assert add_hot_pixels(nothing, 0.0, DURATION_US, WIDTH, HEIGHT, np.random.default_rng(0)).size == 0


def test_rates_of_hot_pixels_lie_evenly_in_the_logarithm_over_two_decades() -> None:
    """Half of them are above 13.4 Hz, a quarter above 42 Hz; the mean is 0.99 / (2 ln 10) = 0.215 of 134 Hz."""
    n, seconds = 4000, 5.0
    hot = add_hot_pixels(make_events([], [], [], []), 1.0, int(seconds * 1e6), n, 1, np.random.default_rng(0))
    counts = np.bincount(hot["x"], minlength=n)
    for rate_hz, share in ((134 * 10**-0.5, 0.25), (13.4, 0.5), (134 * 10**-1.5, 0.75)):
        assert (counts > rate_hz * seconds).mean() == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / n))
    assert counts.mean() / seconds / 134 == pytest.approx(0.99 / (2 * np.log(10)), abs=4 * 0.25 / np.sqrt(n))


def test_jitter_moves_times_by_its_sigma_and_nothing_else(events: Events) -> None:
    assert np.array_equal(jitter_times(events, 0, np.random.default_rng(0)), events)
    lone = make_events(
        np.arange(30_000) % WIDTH, np.zeros(30_000), np.ones(30_000, int), 10_000 + 2_000 * np.arange(30_000)
    )
    moved = jitter_times(lone, 100, np.random.default_rng(0))
    assert np.array_equal(moved["x"], lone["x"])  # 2 ms apart, none overtakes another
    assert np.std(moved["t"] - lone["t"]) == pytest.approx(100, rel=0.02)
    crowd = jitter_times(events, 1000, np.random.default_rng(0))
    check_events(crowd, WIDTH, HEIGHT)
    assert crowd["t"].min() >= 0
    assert np.array_equal(np.sort(crowd["x"]), np.sort(events["x"]))


def test_a_link_passes_its_rate_and_what_its_buffer_holds(events: Events) -> None:
    assert saturate_readout(events, 10.0).size == events.size
    passed = saturate_readout(events, 0.005, buffer_events=1000).size  # 5000 a second, of 20 000
    assert passed == pytest.approx(5000 + 1000, rel=0.02)


@pytest.mark.parametrize(
    ("change", "value", "words"),
    [(drop_events, 1.5, "probability=1.5"), (jitter_times, -1, "sigma_us=-1")],
)
def test_nonsense_is_refused(events: Events, change, value: float, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        change(events, value, np.random.default_rng(0))


def test_seeds_are_markers_of_their_own_and_ids_are_not_0() -> None:
    markers = [window_scene(20.0, seed).markers[0].marker for seed in range(200)]
    assert len({marker.payload for marker in markers}) > 100
    assert min(marker.payload for marker in markers) > 0  # 0 is what lamps look like
    assert abs(window_scene(20.0, 0, 300).markers[0].marker.clock_error_ppm) == 300


def test_a_trial_repeats_and_half_the_events_hurt_the_papers_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "RECEIVERS", {"paper": module.RECEIVERS["paper"]})
    none, half = (StressCondition(stressor="loss", level=level) for level in (0.0, 0.5))
    assert stress(half, 0) == stress(half, 0)
    table = pd.DataFrame([row for condition in (none, half) for seed in range(6) for row in stress(condition, seed)])
    summary = stress_curves(table).set_index("level")
    assert summary["seeds"].tolist() == [6, 6]
    assert summary.loc[0.5, "high"] < summary.loc[0.0, "low"]


def test_an_unknown_stressor_is_refused() -> None:
    with pytest.raises(ValueError, match="stressor 'rain' is not known; choose one of loss, noise"):
        StressCondition(stressor="rain", level=1.0)


def test_every_stressor_is_known_and_begins_with_none_of_it() -> None:
    assert len({stressor.name for stressor in STRESSORS}) == len(STRESSORS) == 6
    for stressor in STRESSORS:
        best = max(stressor.levels) if stressor.name == "readout" else 0
        assert stressor.levels[0] == best
