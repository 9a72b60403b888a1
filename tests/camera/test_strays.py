"""Events without a change of the light: their rates, and the state of a sensor that has been on for long."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.camera import Light, Optics, PixelModel, PlacedMarker, Recorder, Scene, record
from bicode_lab.camera.pixels import start_pixels
from bicode_lab.camera.strays import copy_references, leak, spread_references
from bicode_lab.marker import Marker

SMALL = Optics(width=80, height=60)
SILENT = PixelModel(noise=0.0, background_hz=0.0, leak_hz=0.0, hot_pixels=0)


def pixels(model, n=20_000, seed=0):
    return start_pixels(np.ones(n, np.float32), model, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", ["unlit", "lit"])
def test_a_pixel_in_constant_light_fires_on_at_the_rate_of_the_leak(kind):
    # The marker of the lit pixels has its LED on so faintly that nothing but the leak can reach a threshold.
    markers = (PlacedMarker(marker=Marker()),) if kind == "lit" else ()
    scene = Scene(
        markers=markers, optics=replace(SMALL, width=24, height=20) if kind == "lit" else SMALL,
        light=Light(led_to_ambient=1e-6), pixel_model=replace(SILENT, leak_hz=1.0),
    )  # fmt: skip
    events = record(scene, 4.0, 0)
    assert (events["p"] == 1).all()
    rate_hz = events.size / (scene.optics.width * scene.optics.height) / 4.0
    # Each pixel fires 4 times, give or take one by its phase; a lit one loses half a step of the leak at each event.
    assert rate_hz == pytest.approx(1.0, abs=0.02)


def test_the_leak_is_a_part_of_the_background_activity():
    model = replace(SILENT, background_hz=1.0, background_off_share=0.6, leak_hz=0.3)
    events = record(Scene(markers=(), optics=SMALL, pixel_model=model), 4.0, 0)
    n = 4 * SMALL.width * SMALL.height
    assert (events["p"] == 0).sum() == pytest.approx(0.6 * n, abs=4 * np.sqrt(0.6 * n))
    assert (events["p"] == 1).sum() == pytest.approx(0.4 * n, abs=4 * np.sqrt(0.4 * n))
    without = record(Scene(markers=(), optics=SMALL, pixel_model=replace(model, leak_hz=0.0)), 4.0, 0)
    assert without.size == pytest.approx(n, abs=4 * np.sqrt(n))


def test_leaking_references_make_an_event_for_each_threshold_that_they_pass():
    state = pixels(SILENT, 1000)
    held = np.arange(1000) < 300
    at = leak(state.level, state.reference, state.threshold_on, 2.5, held)
    assert np.bincount(at, minlength=1000).tolist() == [0] * 300 + [2] * 700
    gone = (state.level - state.reference) / state.threshold_on
    np.testing.assert_allclose(gone, np.where(held, 2.5, 0.5), rtol=1e-4)


def test_references_are_spread_over_the_cycle_of_the_leak():
    for noise in (0.0, 0.02, 0.05):
        model = replace(SILENT, noise=noise, leak_hz=0.001)
        state = pixels(model)
        spread_references(state, model, np.random.default_rng(1))
        gap = state.level - state.reference
        away = 4 * noise  # so far from both thresholds, or as far below the level as an event leaves it
        low = np.maximum(away - state.threshold_off, -away)
        high = np.maximum(state.threshold_on - away, low)
        share = ((gap - low) / np.maximum(high - low, 1e-6))[high - low > 1e-3]
        assert share.min() > -1e-3
        assert share.max() < 1 + 1e-3
        assert share.mean() == pytest.approx(0.5, abs=4 / np.sqrt(12 * share.size))
        assert share.std() == pytest.approx(np.sqrt(1 / 12), abs=0.01)


def test_without_a_leak_references_are_at_the_level():
    state = pixels(SILENT)
    spread_references(state, SILENT, np.random.default_rng(1))
    np.testing.assert_array_equal(state.reference, state.level)


def test_copied_references_are_as_near_to_their_thresholds_as_the_originals_of_their_part():
    model = replace(SILENT, threshold_spread=0.05)
    sample, state = pixels(model, 48 * 64, 1), pixels(model, 96 * 128, 2)
    rows = np.repeat(np.arange(48) // 8, 64)  # each of six bands has its own place between the thresholds
    width = sample.threshold_on + sample.threshold_off
    sample.reference[:] = 0.3 + sample.threshold_off - (0.2 + 0.1 * rows) * width
    copy_references(sample, (48, 64), state, (96, 128), 0.3, np.random.default_rng(0))
    place = (0.3 - state.reference + state.threshold_off) / (state.threshold_on + state.threshold_off)
    np.testing.assert_allclose(place, 0.2 + 0.1 * np.repeat(np.arange(96) // 16, 128), atol=1e-4)


def test_copied_references_go_to_pixels_with_thresholds_as_far_apart():
    model = replace(SILENT, threshold_spread=0.05)
    sample, state = pixels(model, 200 * 200, 1), pixels(model, 200 * 200, 2)
    width = sample.threshold_on + sample.threshold_off
    sample.reference[:] = sample.threshold_off - width**2  # the place between the thresholds is the width itself
    copy_references(sample, (200, 200), state, (200, 200), 0.0, np.random.default_rng(0))
    wanted = state.threshold_on + state.threshold_off
    away = (state.threshold_off - state.reference) / wanted - wanted
    assert np.abs(away).mean() < 0.005  # 0.07 is the spread of widths


@pytest.mark.parametrize("settle_s", [-0.1, 1001.0, float("nan")])
def test_a_settling_time_that_cannot_be_is_refused(settle_s):
    with pytest.raises(ValueError, match=f"settle_s={settle_s} is not in 0 .. 1000 s"):
        Recorder(Scene(), 0.1, np.random.default_rng(0), settle_s=settle_s)
