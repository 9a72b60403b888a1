"""Candidates of the calibration: what a candidate changes in a scene and in a receiver, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bicode_lab.constants import all_constants, constant
from bicode_studies.calibration.candidates import (
    NAMES,
    NOT_IN_FIG_8,
    Candidate,
    candidate_in_use,
    candidate_of,
    candidate_receiver,
    candidate_scene,
)
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of

OTHER = Candidate(
    led_to_ambient=1.23, blur_px=0.77, halo_fraction=0.044, time_constant_us=111.0, threshold=0.31,
    threshold_spread=0.021, noise=0.017, refractory_us=77.0, aruco_id=5, min_region_pixels=12, opening_px=4,
)  # fmt: skip


@pytest.mark.parametrize("band", ["red", "infrared"])
def test_the_file_is_the_candidate_in_use(band: str) -> None:
    assert vars(candidate_in_use()) == {name: constant(name) for name in NAMES}
    condition = Condition(figure="08", distance_m=2.5, band=band)
    scene = scene_of(condition, seed=3)
    assert candidate_scene(scene, candidate_in_use()) == scene
    assert candidate_receiver(receiver_settings(condition), candidate_in_use()) == receiver_settings(condition)


@pytest.mark.parametrize("condition", [
    Condition(figure="08", distance_m=5.0, current_ma=21.3), Condition(figure="12", distance_m=5.0, speed_m_per_s=0.3)
])  # fmt: skip
def test_a_candidates_scene_has_its_values_and_nothing_else_is_changed(condition: Condition) -> None:
    scene = scene_of(condition, seed=0)
    changed = candidate_scene(scene, OTHER, (96, 72))
    assert (changed.light.led_to_ambient, changed.light.infrared_led_to_ambient) == (1.23, 1.23)
    assert (changed.optics.blur_px, changed.optics.halo_fraction) == (0.77, 0.044)
    model = changed.pixel_model
    assert (model.threshold_on, model.threshold_off, model.threshold_spread) == (0.31, 0.31, 0.021)
    assert (model.time_constant_us, model.noise, model.refractory_us) == (111.0, 0.017, 77.0)
    assert changed.markers[0].marker.board.aruco_id == 5
    assert (changed.optics.width, changed.optics.height) == (96, 72)
    assert candidate_scene(changed, candidate_in_use(), (scene.optics.width, scene.optics.height)) == scene
    kept = candidate_scene(scene, OTHER)
    assert (kept.optics.width, kept.optics.height) == (scene.optics.width, scene.optics.height)


def test_a_candidates_receiver_has_its_values_and_nothing_else_is_changed() -> None:
    settings = receiver_settings(Condition(figure="08", distance_m=5.0))
    changed = candidate_receiver(settings, OTHER)
    assert (changed.opening_px, changed.min_region_pixels) == (4, 12)
    assert changed == replace(settings, opening_px=4, min_region_pixels=12)


def test_values_are_rounded_and_whole_constants_are_whole() -> None:
    made = candidate_of({**vars(OTHER), "blur_px": 0.123456, "aruco_id": 6.7, "unknown": 1.0})
    assert (made.blur_px, made.aruco_id) == (0.123, 7)


def test_every_constant_that_is_named_is_in_the_file() -> None:
    assert {*NAMES, *NOT_IN_FIG_8} <= set(all_constants())
