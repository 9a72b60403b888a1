"""Candidates of the calibration: how they are drawn, and what a candidate changes in a scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.constants import all_constants, constant
from bicode_studies.calibration.candidates import (
    NAMES,
    Candidate,
    candidate_in_use,
    candidate_scene,
    draw_candidates,
    draw_neighbours,
)
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.scenes import scene_of

PLAIN = Candidate(
    led_to_ambient=0.8, blur_px=0.9, halo_fraction=0.03, time_constant_us=150.0, aruco_id=17, min_region_pixels=3
)


def test_candidates_are_drawn_from_the_ranges_of_the_file() -> None:
    drawn = draw_candidates(400, np.random.default_rng(0))
    assert drawn == draw_candidates(400, np.random.default_rng(0))
    for name in NAMES:
        low, high = all_constants()[name].low, all_constants()[name].high
        values = np.array([getattr(one, name) for one in drawn], float)
        assert low <= values.min()
        assert values.max() <= high
        # of 400 even draws the least and the most miss a tenth of the range with a chance of 0.9^400
        assert values.min() < low + 0.1 * (high - low)
        assert values.max() > high - 0.1 * (high - low)
    least = np.bincount([one.min_region_pixels for one in drawn])[3:21]
    assert np.abs(least - 400 / 18).max() < 5 * np.sqrt(400 / 18)


def test_neighbours_keep_the_pattern_and_stay_in_the_ranges() -> None:
    edge = replace(PLAIN, blur_px=all_constants()["blur_px"].high)
    near = draw_neighbours(edge, 200, np.random.default_rng(1))
    assert {(one.aruco_id, one.min_region_pixels) for one in near} == {(PLAIN.aruco_id, PLAIN.min_region_pixels)}
    assert max(one.blur_px for one in near) == edge.blur_px
    low, high = all_constants()["time_constant_us"].low, all_constants()["time_constant_us"].high
    moved = (np.array([one.time_constant_us for one in near]) - PLAIN.time_constant_us) / (high - low)
    assert abs(moved.mean()) < 4 * 0.1 / np.sqrt(200)
    assert moved.std() == pytest.approx(0.1, rel=4 / np.sqrt(400))


def test_the_file_is_the_candidate_in_use() -> None:
    assert vars(candidate_in_use()) == {name: constant(name) for name in vars(candidate_in_use())}
    scene = scene_of(Condition(figure="08", distance_m=2.5), seed=3)
    same = candidate_scene(scene, candidate_in_use(), (scene.optics.width, scene.optics.height))
    assert same.light == scene.light
    assert same.optics == scene.optics
    assert same.pixel_model == scene.pixel_model
    assert same.markers[0].marker == scene.markers[0].marker


def test_a_candidates_scene_has_its_values_and_nothing_else_is_changed() -> None:
    scene = scene_of(Condition(figure="08", distance_m=5.0, current_ma=21.3), seed=0)
    candidate = Candidate(
        led_to_ambient=1.23, blur_px=0.77, halo_fraction=0.044, time_constant_us=111.0, aruco_id=5, min_region_pixels=12
    )  # fmt: skip
    changed = candidate_scene(scene, candidate, (96, 72))
    assert changed.light.led_to_ambient == 1.23
    assert (changed.optics.blur_px, changed.optics.halo_fraction) == (0.77, 0.044)
    assert changed.pixel_model.time_constant_us == 111.0
    assert changed.markers[0].marker.board.aruco_id == 5
    assert (changed.optics.width, changed.optics.height) == (96, 72)
    before, after = scene.markers[0], changed.markers[0]
    assert after.path == before.path
    assert (after.marker.payload, after.marker.phase_us) == (before.marker.payload, before.marker.phase_us)
    assert after.marker.current_ma == 21.3
    back = candidate_scene(changed, candidate_in_use(), (scene.optics.width, scene.optics.height))
    assert back.light == scene.light
    assert back.optics == scene.optics
    assert back.pixel_model == scene.pixel_model
