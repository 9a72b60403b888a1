"""What stood where: scenes come from condition and seed alone, and pans and turns are those of IV-E and IV-F."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab import paper
from bicode_lab.camera import truth_at
from bicode_lab.camera.optics import ambient_signal
from bicode_lab.constants import constant
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.grids import conditions, seeds
from bicode_studies.paper_experiments.scenes import (
    STRATA,
    half_pan_deg,
    light_of,
    motion_duration_s,
    optics_of,
    recording_start_s,
    scene_of,
)

PANS, SPINS = conditions("12"), conditions("14")
ALL_FIGURES = ("08", "09", "10", "11", "12", "14")


def name_of(condition: Condition) -> str:
    return f"{condition.distance_m:g}m-{condition.speed_m_per_s:g}mps-{condition.rpm:g}rpm"


def whole_pan_s(condition: Condition) -> float:
    rate_rad_per_s = condition.speed_m_per_s / condition.distance_m
    return float(2 * np.deg2rad(half_pan_deg(condition)) / rate_rad_per_s)


@pytest.mark.parametrize("figure", ALL_FIGURES)
def test_a_seed_is_a_payload_a_phase_and_a_place(figure: str) -> None:
    condition = conditions(figure, quick=True)[0]
    one, again, other = (scene_of(condition, seed).markers[0] for seed in (3, 3, 4))
    assert one.marker == again.marker
    assert np.array_equal(one.path.pose_at(0).position_m, again.path.pose_at(0).position_m)
    assert one.marker.phase_us != other.marker.phase_us
    assert not np.array_equal(one.path.pose_at(0).position_m, other.path.pose_at(0).position_m)
    assert 1 <= one.marker.payload <= 255
    assert 0 <= one.marker.phase_us < paper.PACKET_US


def test_seeds_have_many_payloads_and_places_within_a_pixel() -> None:
    condition = Condition(figure="08", distance_m=20.0)
    markers = [scene_of(condition, seed).markers[0] for seed in range(40)]
    assert len({placed.marker.payload for placed in markers}) > 30
    pixel_m = condition.distance_m / optics_of(condition).focal_px
    offsets_px = np.array([placed.path.pose_at(0).position_m[:2] for placed in markers]) / pixel_m
    assert np.abs(offsets_px).max() <= 0.5
    assert (np.ptp(offsets_px, axis=0) > 0.8).all()


def test_a_lux_of_daylight_is_more_to_a_bare_sensor_than_one_of_lamps() -> None:
    def signal(lux: float) -> float:
        condition = Condition(figure="11", distance_m=1.0, illuminance_lux=lux)
        return ambient_signal(light_of(condition), optics_of(condition))

    assert signal(paper.OFFICE_LUX) == pytest.approx(1)
    per_lux = signal(paper.EVENING_LUX) / (paper.EVENING_LUX / paper.OFFICE_LUX)
    # lamps 310 .. 340 lm/W, the sun 158 lm/W within 400 .. 1000 nm: twice as much if the sensor weighs energy
    assert 1.4 < per_lux < 2.4


def test_infrared_has_its_filter_lens_and_share_of_the_light() -> None:
    red = Condition(figure="11", distance_m=1.0, illuminance_lux=paper.EVENING_LUX)
    assert optics_of(red).f_number == paper.F_NUMBER_VISIBLE
    assert not optics_of(red).infrared_filter
    assert light_of(red).infrared_share == constant("infrared_share_bare_sensor")
    for lux, place in ((paper.OFFICE_LUX, "office"), (paper.EVENING_LUX, "evening"), (20_000.0, "evening")):
        condition = Condition(figure="11", distance_m=1.0, band="infrared", illuminance_lux=lux)
        assert optics_of(condition).f_number == paper.F_NUMBER_INFRARED
        assert optics_of(condition).infrared_filter
        assert light_of(condition).infrared_share == constant(f"infrared_share_{place}")
        assert scene_of(condition, 0).markers[0].marker.band == "infrared"


@pytest.mark.parametrize("condition", PANS, ids=name_of)
def test_each_stretch_of_a_pan_has_the_marker_in_view_from_its_beginning_to_its_end(condition: Condition) -> None:
    for seed in seeds(condition):
        scene = scene_of(condition, seed)
        length_s = min(condition.duration_s, whole_pan_s(condition))
        for t_us in (0.0, length_s * 0.5e6, length_s * 1e6 - 1):
            (marker,) = truth_at(scene, t_us)
            assert marker.in_view


@pytest.mark.parametrize("condition", PANS, ids=name_of)
def test_stretches_share_the_pan_from_entering_to_leaving(condition: Condition) -> None:
    way_s = whole_pan_s(condition)
    rest_s = max(way_s - condition.duration_s, 0.0)
    begins_s = np.array([recording_start_s(condition, seed) for seed in seeds(condition)])
    parts = np.clip(np.floor(begins_s / (rest_s / STRATA)), 0, STRATA - 1) if rest_s else np.arange(STRATA)
    # as many in each tenth: the first enters, the last leaves
    assert sorted(parts) == sorted(list(range(STRATA)) * (begins_s.size // STRATA))
    assert begins_s.max() + condition.duration_s <= way_s + max(condition.duration_s - way_s, 0) + 1e-9
    if 2 * rest_s / STRATA <= condition.duration_s:  # near: long enough to overlap, whatever the draws
        starts, ends = np.sort(begins_s), np.sort(begins_s) + condition.duration_s
        assert (starts[1:] <= ends[:-1]).all()
        assert starts[0] <= rest_s / STRATA
        assert ends[-1] >= way_s - rest_s / STRATA


@pytest.mark.parametrize("condition", PANS, ids=name_of)
def test_a_whole_pan_has_the_marker_wholly_in_view_and_no_more(condition: Condition) -> None:
    scene, early_s = scene_of(condition, 0), recording_start_s(condition, 0)
    for end_s in (-early_s, motion_duration_s(condition) - early_s):
        corners_px = truth_at(scene, end_s * 1e6)[0].corners_px
        beyond_px = min(corners_px[:, 0].min(), optics_of(condition).width - 1 - corners_px[:, 0].max())
        side_px = condition.size_m / condition.distance_m * optics_of(condition).focal_px
        assert 0 <= beyond_px <= side_px + 5


@pytest.mark.parametrize("condition", SPINS, ids=name_of)
def test_a_whole_turn_is_its_recording(condition: Condition) -> None:
    assert motion_duration_s(condition) == condition.duration_s


@pytest.mark.parametrize("condition", [PANS[0], PANS[-1]], ids=name_of)
def test_a_pan_passes_the_marker_at_the_paper_s_speed(condition: Condition) -> None:
    scene, dt_s = scene_of(condition, 5), 0.01
    before, after = (scene.marker_pose(0, t_s).position_m for t_s in (0.0, dt_s))
    turned_rad = np.arctan2(before[0], before[2]) - np.arctan2(after[0], after[2])
    assert abs(turned_rad) / dt_s * condition.distance_m == pytest.approx(condition.speed_m_per_s, rel=1e-3)


@pytest.mark.parametrize("condition", SPINS, ids=name_of)
def test_a_spin_turns_by_half_a_turn_in_its_plane(condition: Condition) -> None:
    assert 6 * condition.rpm * condition.duration_s == pytest.approx(180)
    first, last = (scene_of(condition, 2).markers[0].path.pose_at(t_s) for t_s in (0.0, condition.duration_s))
    turn = first.rotation.T @ last.rotation
    assert np.allclose(turn, np.diag([-1, -1, 1]), atol=1e-6)
    assert recording_start_s(condition, 2) == 0.0


def test_only_a_pan_has_a_wall_and_it_stands_behind_the_marker() -> None:
    for figure in ALL_FIGURES:
        for condition in conditions(figure, quick=True):
            scene = scene_of(condition, 0)
            assert (scene.wall is not None) == bool(condition.speed_m_per_s)
            if scene.wall is not None:
                assert scene.wall.distance_m > condition.distance_m
                points_px = optics_of(condition).focal_px * scene.wall.texel_m / scene.wall.distance_m
                assert points_px == pytest.approx(1.0)
            assert condition.moves == (figure in ("12", "14"))
