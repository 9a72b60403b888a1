"""Scenes are what their condition says, recordings repeat, and tiles add as many events as the number of them."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.camera import truth_at
from bicode_lab.events import check_events, no_events
from bicode_studies.robustness.link_conditions import HOME, LinkCondition, balanced_conditions
from bicode_studies.robustness.link_scenes import WALL_BEHIND, WINDOW, add_tiles, link_scene, settings_of

DURATION_US = 330_000


def tiles(times: int, seed: int = 0, width: int = WINDOW[0], duration_us: int = DURATION_US):
    return add_tiles(no_events(), times, duration_us, width, WINDOW[1], np.random.default_rng(seed))


@pytest.mark.parametrize("condition", balanced_conditions()[:30])
def test_the_whole_path_of_the_marker_is_in_view(condition: LinkCondition) -> None:
    settings = settings_of(condition)
    end_us = condition.periods * settings.delta_t_whole_us
    for seed in range(4):
        scene = link_scene(condition, seed)
        assert (scene.optics.width, scene.optics.height) == (settings.width, settings.height)
        first, last = (truth_at(scene, t_us)[0] for t_us in (0, end_us))
        assert first.in_view
        assert last.in_view
        moved_px = last.corners_px[0] - first.corners_px[0]
        assert abs(moved_px[0]) == pytest.approx(condition.speed_px_per_s * end_us * 1e-6, abs=1e-6)
        assert moved_px[1] == pytest.approx(0, abs=1e-9)
        assert 0 < scene.markers[0].marker.payload < 2**condition.payload_bits
        assert scene.markers[0].marker.current_ma == condition.current_ma


def test_seeds_draw_payload_phase_place_and_direction() -> None:
    scenes = [link_scene(replace(HOME, speed_px_per_s=100.0), seed) for seed in range(40)]
    markers = [scene.markers[0].marker for scene in scenes]
    assert len({marker.payload for marker in markers}) > 30
    assert np.ptp([marker.phase_us for marker in markers]) > 12_000
    assert {np.sign(scene.markers[0].path.velocity_m_per_s[0]) for scene in scenes} == {-1, 1}  # type: ignore[attr-defined]
    places = [truth_at(scene, 165_000)[0].corners_px.mean(0) for scene in scenes]
    room = np.array(WINDOW) - 8 - 0.05 * 1646 / 10  # a plate of 5 cm at 10 m, and 4 px on each side
    assert (np.ptp(places, axis=0) > 0.8 * room).all()
    assert (np.ptp(places, axis=0) < room + 1).all()
    assert len({tuple((place % 1).round(2)) for place in places}) > 30


def test_lamps_are_on_the_mains_and_behind_dimmers_in_turn() -> None:
    scene = link_scene(replace(HOME, clutter="lamps", amount=12.0), 0)
    assert len(scene.lamps) == 12
    rates_hz = np.array([lamp.flicker.rate_hz for lamp in scene.lamps])  # type: ignore[attr-defined]
    assert ((rates_hz > 950).sum(), (rates_hz < 130).sum()) == (6, 6)
    assert not link_scene(HOME, 0).lamps
    assert len(link_scene(replace(HOME, clutter="lamps", amount=3.0), 0).lamps) == 3


def test_a_wall_moves_behind_a_marker_that_stays() -> None:
    scene = link_scene(replace(HOME, clutter="wall", amount=3.0), 0)
    assert scene.wall is not None
    assert scene.wall.distance_m == WALL_BEHIND * 10.0
    before, after = (truth_at(scene, t_us)[0].corners_px for t_us in (0, 300_000))
    np.testing.assert_allclose(before, after, atol=1e-6)
    moved_m = scene.camera.pose_at(1.0).position_m - scene.camera.pose_at(0.0).position_m
    assert abs(moved_m[0]) == pytest.approx(3.0)


def test_tiles_are_as_busy_as_their_number_says() -> None:
    one, twenty = tiles(1), tiles(20)
    check_events(twenty, *WINDOW)
    # A tile makes about 40,000 events a second.
    assert 30_000 < twenty.size / 20 / (DURATION_US * 1e-6) < 60_000
    assert 0.5 < one.size / (twenty.size / 20) < 2
    assert twenty["t"].min() >= 0
    assert twenty["t"].max() < DURATION_US
    thirds = np.histogram(twenty["t"], 3, (0, DURATION_US))[0] / twenty.size
    np.testing.assert_allclose(thirds, 1 / 3, atol=0.05)  # there is no hole where a tile begins again
    on_left = (twenty["x"] < WINDOW[0] // 2).mean()
    assert 0.3 < on_left < 0.7
    assert {0, WINDOW[0] - 1} <= set(twenty["x"].tolist())
    assert {0, WINDOW[1] - 1} <= set(twenty["y"].tolist())


def test_tiles_cover_a_wide_sensor_and_not_more_than_it() -> None:
    wide = tiles(2, width=150)
    check_events(wide, 150, WINDOW[1])
    right = wide[wide["x"] >= WINDOW[0]]
    assert right["x"].max() == 149
    per_pixel = right.size / 54, (wide.size - right.size) / 96
    assert 0.5 < per_pixel[0] / per_pixel[1] < 2


def test_tiles_go_on_for_longer_than_they_were_recorded() -> None:
    long = tiles(3, duration_us=5_000_000)
    fifths = np.histogram(long["t"], 5, (0, 5_000_000))[0] / long.size
    np.testing.assert_allclose(fifths, 0.2, atol=0.05)


def test_tiles_repeat_and_leave_the_events_as_they_were() -> None:
    assert np.array_equal(tiles(2, seed=3), tiles(2, seed=3))
    assert not np.array_equal(tiles(2, seed=3)[:100], tiles(2, seed=4)[:100])
    own = tiles(1, seed=5)
    before = own.copy()
    both = add_tiles(own, 1, DURATION_US, *WINDOW, np.random.default_rng(6))
    assert np.array_equal(own, before)
    assert both.size == own.size + tiles(1, seed=6).size
    assert (np.diff(both["t"]) >= 0).all()
