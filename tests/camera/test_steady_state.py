"""The noise of a pixel, and a sensor whose state no longer depends on how it started."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, ndimage

from bicode_lab.camera import Moving, Optics, PixelModel, PlacedMarker, Pose, Recorder, Scene, Still, Wall, record
from bicode_lab.camera.pixel_steps import NOISE_CELL, noise_cells, noise_scale
from bicode_lab.camera.pixels import fire_lit_pixels
from bicode_lab.marker import Marker

recorder_module, scene_module = sys.modules[Recorder.__module__], sys.modules[Scene.__module__]
SMALL = Optics(width=120, height=90)
NOISY = PixelModel(background_hz=0.0, hot_pixels=0)


def same_cell(lag):
    """Return the probability that two moments so many mean lengths apart are in one cell."""
    return 1 - lag + lag**3 / 6 if lag < 1 else max(2 - lag, 0) ** 3 / 6


# -- cells


def test_cells_depend_on_absolute_time_alone():
    starts, numbers = noise_cells(-5e5, 5e5, 200.0)
    assert starts[0] <= -5e5 < starts[1]
    assert starts[-1] < 5e5
    assert (np.diff(starts) > 0).all()
    assert (np.diff(numbers) == 1).all()
    assert np.diff(starts).mean() == pytest.approx(NOISE_CELL * 200, rel=0.01)
    for start, end in ((-1.0, 1.0), (12_345.6, 12_346.0), (1e4, 2e4), (-2e4, -1e4)):
        some, names = noise_cells(start, end, 200.0)
        first = np.searchsorted(starts, start, side="right") - 1
        np.testing.assert_array_equal(some, starts[first : first + some.size])
        np.testing.assert_array_equal(names, numbers[first : first + some.size])
        assert starts[first + some.size] >= end


def test_two_moments_share_a_cell_as_often_as_is_stated():
    starts, _ = noise_cells(0.0, 2e7, 250.0)
    t = np.random.default_rng(0).uniform(0, 1.9e7, 100_000)
    cell = np.searchsorted(starts, t, side="right")
    for lag in (0.1, 0.5, 0.9, 1.3, 1.7, 2.0):
        shared = (np.searchsorted(starts, t + lag * NOISE_CELL * 250, side="right") == cell).mean()
        assert shared == pytest.approx(same_cell(lag), abs=0.01)


def test_the_cells_have_no_rhythm():
    starts, _ = noise_cells(0.0, 1e6, 125.0)  # 500 us on the average, as a chip has
    for rate_hz in np.linspace(1990, 2010, 81):
        assert np.abs(np.exp(2j * np.pi * rate_hz * 1e-6 * starts).mean()) < 4.5 / np.sqrt(starts.size)


# -- level


@pytest.mark.parametrize("signal", [0.3, 1.0, 2.3, 26.0])
def test_the_scale_is_one_over_the_root_of_the_passed_variance(signal):
    x = NOISE_CELL * signal
    passed, _ = integrate.quad(lambda s: x * np.exp(-x * s) * same_cell(s), 0, 2, points=[1.0])
    assert noise_scale(signal) == pytest.approx(passed**-0.5, rel=1e-6)


def levels_at(moments_us, signal, noise=0.05, n=4000, tau_us=246.0):
    """Return the levels of pixels in constant light at some moments, shape (moments, n)."""
    one = np.ones((1, n), np.float32)
    wide = np.full(n, 9.0, np.float32)
    level = np.full(n, np.log(signal), np.float32)
    state = level, level.copy(), np.full(n, -1e18), wide, wide
    found, start = [], -20_000.0
    for end in moments_us:
        cells, numbers = noise_cells(start, end, tau_us)
        edges = np.concatenate([[start], cells[1:], [end]])
        fire_lit_pixels(
            0, np.arange(n, dtype=np.int32), np.float32(signal) * one, np.zeros((1, 1, n), np.float32), edges,
            numbers, np.zeros((numbers.size, 1), np.float32), np.zeros(numbers.size, np.int32), *state,
            np.uint64(7), noise, tau_us, 50.0, 0.0, 0.0, np.empty(1 << 20, np.uint32), np.empty(1 << 20), 0,
        )  # fmt: skip
        found.append(level.copy())
        start = end
    return np.array(found) - np.log(signal)


@pytest.mark.parametrize("signal", [0.5, 1.0, 2.3, 26.0])
def test_the_level_has_the_noise_asked_for_in_any_light(signal):
    moments = np.random.default_rng(1).uniform(0, 2e5, 200)
    level = levels_at(np.sort(moments), signal)
    # The cells begin at the same moments for all pixels, so 200 moments count and not 800,000 values.
    assert level.std() == pytest.approx(0.05, rel=0.03)
    assert abs(level.mean()) < 0.001


def test_the_noise_forgets_within_some_cells_and_not_within_one():
    tau_us = 246.0
    t = np.sort(np.random.default_rng(2).uniform(0, 3e5, 80))
    for lag_us, low, high in ((20.0, 0.95, 1.0), (tau_us, 0.75, 0.95), (5 * NOISE_CELL * tau_us, -0.02, 0.02)):
        pairs = [np.corrcoef(levels_at([at, at + lag_us], 1.0))[0, 1] for at in t[:20]]
        assert low < np.mean(pairs) < high


# -- walls


def wall_events(seed, settle_s=0.0, duration_s=0.4, px_per_s=200.0, contrast=0.04):
    rng = np.random.default_rng(5)
    image = ndimage.gaussian_filter(rng.normal(size=(64, 96)), 1.5, mode="wrap")
    pixel_m = 5.0 / SMALL.focal_px
    wall = Wall(log_image=(image / image.std() * contrast).astype(np.float32), texel_m=pixel_m)
    camera = Moving(velocity_m_per_s=(px_per_s * pixel_m, 0.0, 0.0))
    scene = Scene(markers=(), camera=camera, wall=wall, optics=SMALL, pixel_model=NOISY)
    return record(scene, duration_s, seed, settle_s=settle_s)


def test_the_events_of_a_wall_do_not_depend_on_how_often_it_is_drawn(monkeypatch):
    found = []
    for step_px in (0.125, 0.25, 0.5):
        monkeypatch.setattr(scene_module, "STEP_PX", step_px)
        found.append(wall_events(0).size)
    assert min(found) > 1000
    assert np.ptp(found) < 2 * np.sqrt(min(found))  # the noise is the same, so they differ by less than by chance


def test_a_settled_wall_makes_from_the_start_what_it_makes_after_seconds():
    settled = np.bincount(wall_events(0, 1.0)["t"] // 100_000, minlength=4)
    running = np.bincount(wall_events(0, 0.0, duration_s=4.0)["t"] // 400_000, minlength=10) / 4
    assert running[0] > 1.2 * settled.mean()  # references all near the present level are no steady state
    assert settled[0] == pytest.approx(settled[1:].mean(), rel=0.1)
    assert settled.mean() == pytest.approx(running[-1], rel=0.15)


# -- settling


def marker_scene(distance_m, model=NOISY):
    path = Still(Pose.facing(distance_m, x_m=0.3 * distance_m / SMALL.focal_px))
    return Scene(markers=(PlacedMarker(marker=Marker(), path=path),), optics=SMALL, pixel_model=model)


def settled(scene, settle_s, seed=0):
    """Return the references and levels of a sensor that has seen a scene for some time."""
    recorder = Recorder(scene, 0.1, np.random.default_rng(seed), settle_s=settle_s)
    recorder._settle()
    return recorder._state


@pytest.mark.parametrize("distance_m", [2.5, 20.0])
def test_the_short_cut_gives_what_running_all_pixels_gives(monkeypatch, distance_m):
    scene = marker_scene(distance_m)
    short = settled(scene, 0.5)
    monkeypatch.setattr(recorder_module, "FORGET_PACKETS", 1000)
    whole = settled(scene, 0.5)
    fresh = settled(scene, 0.0)
    changed = np.abs(whole.reference - fresh.reference) > 1e-4
    assert changed.sum() > 20
    assert (np.abs(short.reference - whole.reference)[changed] > 1e-4).mean() < 0.01


def test_a_settled_sensor_has_forgotten_how_it_started():
    spread = marker_scene(20.0)
    adapted = marker_scene(20.0, replace(NOISY, leak_hz=0.0))
    fresh, long = ([settled(s, settle_s) for s in (spread, adapted)] for settle_s in (0.0, 1.0))
    lit = np.abs(long[0].reference - fresh[0].reference) > 0.05  # those that have fired
    assert lit.sum() > 20
    assert (np.abs(fresh[0].reference - fresh[1].reference)[lit] > 0.002).mean() > 0.8
    assert (np.abs(long[0].reference - long[1].reference)[lit] > 0.002).mean() < 0.2


def test_settling_leaves_no_event_before_the_start_and_changes_no_chance():
    scene = marker_scene(2.5, replace(NOISY, background_hz=10.0, noise=0.0))
    events = record(scene, 0.05, 3, settle_s=0.2)
    assert events["t"].min() >= 0
    far_away = events["x"] < 5
    fresh = record(scene, 0.05, 3)
    # Pixels that no marker lights have the same background activity with and without settling.
    np.testing.assert_array_equal(events[far_away], fresh[fresh["x"] < 5])
