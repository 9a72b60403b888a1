"""Tests of the events per blink: limits that follow from the pixel, laws of light, the measured table's shape."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bicode_lab.camera import PixelModel
from bicode_studies.real_light.blink_response import (
    BLINK_HZ,
    DISTANCES_M,
    Beacon,
    blink_curve,
    busiest_hz,
    events_per_blink,
    fit_scene,
    misfit_factor,
    mix_curves,
    read_blink_table,
    slope,
)

QUIET = replace(PixelModel(), noise=0.0, threshold_spread=0.0)


def test_slow_blinks_are_answered_in_full_and_fast_ones_are_not() -> None:
    beacon = Beacon(brightness=10, illuminance_lux=35)
    slow, slower, fast = (events_per_blink(beacon, hz, QUIET) for hz in (50, 25, 15_000))
    assert slow == pytest.approx(slower, rel=0.02)
    assert fast < slow / 3


def test_only_the_time_constant_over_the_light_counts() -> None:
    """Three times the light with three times the time constant is the same signal in time: it makes the same events."""
    beacon = Beacon(brightness=6, illuminance_lux=10)
    brighter = Beacon(brightness=18, illuminance_lux=30)
    slower = replace(QUIET, time_constant_us=3 * QUIET.time_constant_us)
    for hz in (250, 2500):
        assert events_per_blink(brighter, hz, slower) == pytest.approx(events_per_blink(beacon, hz, QUIET), rel=0.01)


def test_a_longer_dead_time_leaves_fewer_events_and_a_slower_pixel_bends_earlier() -> None:
    beacon = Beacon(brightness=10, illuminance_lux=3.5)
    dead = [events_per_blink(beacon, 250, replace(QUIET, refractory_us=us)) for us in (0, 50, 200)]
    assert dead[0] > dead[1] > dead[2]
    rates = (50.0, 125.0, 500.0, 1250.0)
    quick, slow = (busiest_hz(blink_curve(beacon, rates, replace(QUIET, time_constant_us=us))) for us in (30.0, 3000.0))
    assert slow < quick


def test_a_far_led_makes_fewer_events() -> None:
    beacon = Beacon(brightness=10, illuminance_lux=10)
    near, far = (events_per_blink(replace(beacon, distance_m=d), 50) for d in (1.0, 5.0))
    assert 0 < far < near


def test_an_led_that_is_not_brighter_than_chance_makes_next_to_nothing() -> None:
    assert events_per_blink(Beacon(brightness=0.01), 250, QUIET) == 0


def test_the_scene_that_made_a_curve_is_found_again() -> None:
    made = blink_curve(Beacon(brightness=30, illuminance_lux=10), (25.0, 500.0, 5000.0), seed=1)
    found = fit_scene(made, (10, 30), (3, 10), seed=2)
    assert tuple(found.loc[0, ["brightness", "illuminance_lux"]]) == (30, 10)
    assert found["misfit_factor"].is_monotonic_increasing
    assert 1 <= found["misfit_factor"][0] < 1.2


def test_a_factor_is_symmetric_and_one_where_nothing_differs() -> None:
    assert misfit_factor([5, 7], [5, 7]) == 1
    assert misfit_factor([5, 7], [50, 70]) == pytest.approx(10) == pytest.approx(misfit_factor([50, 70], [5, 7]))
    assert misfit_factor([0.0], [0.1]) == 1  # both are next to nothing


def test_a_mixture_is_taken_apart_and_no_weight_is_negative() -> None:
    curves = np.array([[100.0, 90, 20, 1], [4000, 900, 10, 0.5], [50, 50, 50, 45]])
    assert mix_curves(curves, np.array([0.5, 2.0, 0.1]) @ curves) == pytest.approx([0.5, 2.0, 0.1])
    assert (mix_curves(curves, curves[0] - 0.3 * curves[2]) >= 0).all()


def test_slopes_are_powers() -> None:
    hz = np.array([5.0, 50.0, 700.0])
    assert slope(pd.DataFrame({"blink_hz": hz, "events": 3e4 * hz**-0.8})) == pytest.approx([-0.8, -0.8])


def test_another_table_is_refused(tmp_path: Path) -> None:
    for arrays in ({"avg_events_array_0": np.ones((3, 12))}, {"events": np.ones((13, 12))}):
        np.savez(tmp_path / "other.npz", **arrays)
        with pytest.raises(ValueError, match=r"other\.npz holds no avg_events_array_0 of 13 distances x 12 rates"):
            read_blink_table(tmp_path / "other.npz")


def test_the_measured_table_is_laid_out_as_its_readme_says(real_recordings: Path) -> None:
    table = read_blink_table(real_recordings / "evk4_events_per_blink.npz")
    assert len(table) == len(DISTANCES_M) * len(BLINK_HZ)
    near = table[table["distance_m"] == 1.0]
    assert near["blink_hz"].is_monotonic_increasing
    assert near["events"].is_monotonic_decreasing
    assert (table["per_s"] / table["blink_hz"]).to_numpy() == pytest.approx(table["events"].to_numpy())
    slow = table[table["blink_hz"] == 250.0]["events"]
    assert slow.is_monotonic_decreasing  # with distance
