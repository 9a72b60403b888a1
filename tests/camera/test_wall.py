"""Tests of the textured wall: sampled as scipy samples, followed as any pixel is followed, as fast as its motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from bicode_lab.boxes import Box
from bicode_lab.camera import (
    Light,
    Moving,
    Optics,
    PixelModel,
    PlacedMarker,
    Pose,
    Readout,
    Recorder,
    Scene,
    Still,
    Wall,
    pan,
    record,
    textured_wall,
)
from bicode_lab.camera.motion import turn_about
from bicode_lab.camera.pixels import fire_lit_pixels, start_pixels
from bicode_lab.camera.wall_pixels import fire_wall_pixels
from bicode_lab.events import check_events
from bicode_lab.marker import Marker

SMALL = Optics(width=120, height=90)
WHOLE = Box(0, 0, SMALL.width, SMALL.height)
EXACT = PixelModel(threshold_spread=0.0, noise=0.0, background_hz=0.0, hot_pixels=0)
INSTANT = Readout(row_us=0.0, peak_mev_per_s=1e9, sustained_mev_per_s=1e9)
NOTHING_BEFORE = np.empty((0, 3, 3)), np.empty(0), np.empty(0, np.int64)
PIXEL_M = 5.0 / SMALL.focal_px  # what a pixel covers on a wall at 5 m


def before(wall, camera, *markers, model=EXACT, **settings):
    """Return a scene before a wall, with nothing by chance."""
    return Scene(
        markers=markers, camera=camera, wall=wall, optics=SMALL, pixel_model=model, readout=INSTANT, **settings
    )


def sideways(px_per_s):
    """Return a camera that moves to the right by so many pixels of the wall per second."""
    return Moving(velocity_m_per_s=(px_per_s * PIXEL_M, 0.0, 0.0))


def noisy_wall(seed=0, shape=(64, 96), **settings):
    rng = np.random.default_rng(seed)
    smooth = ndimage.gaussian_filter(rng.normal(size=shape), 1.0, mode="wrap")
    image = (smooth / smooth.std() * 0.3).astype(np.float32)
    return Wall(**({"log_image": image, "texel_m": PIXEL_M} | settings))


# -- sampling


@pytest.mark.parametrize("camera", [Pose(), pan(0.3, 1.0, start_deg=15).pose_at(0.2)])
def test_the_wall_is_read_as_scipy_reads_it(camera):
    wall = noisy_wall()
    view = wall.from_pixels(camera, SMALL)
    y, x = np.mgrid[3:80, 5:100]
    u = np.stack([x, y, np.ones_like(x)], -1) @ view.T
    columns, rows = u[..., 0] / u[..., 2], u[..., 1] / u[..., 2]
    expected = ndimage.map_coordinates(wall.log_image.astype(float), [rows, columns], order=1, mode="grid-wrap")
    np.testing.assert_allclose(wall.log_reflectance(view, Box.between(5, 3, 100, 80)), expected, atol=1e-5)


def test_a_point_of_the_wall_is_where_it_projects():
    wall = noisy_wall(distance_m=4.0, texel_m=0.01)
    camera = Pose(pan(0.1, 1.0, start_deg=7).pose_at(0).rotation, np.array([0.3, -0.2, 0.5]))
    view = wall.from_pixels(camera, SMALL)
    origin = np.array([wall.log_image.shape[1] / 3, wall.log_image.shape[0] / 3])
    for column, row in [(0, 0), (10, -5), (-20.5, 33)]:
        on_wall = np.array([[column * 0.01, row * 0.01, 4.0]])
        x, y = SMALL.project(camera.inverse().apply(on_wall))[0]
        u = view @ [x, y, 1]
        np.testing.assert_allclose(u[:2] / u[2] - origin, [column, row], atol=1e-6)


@pytest.mark.parametrize("name", ["camera", "brick"])
def test_a_bundled_picture_has_the_contrast_asked_for_and_no_seam(name):
    wall = textured_wall(name, contrast=0.4)
    assert wall.log_image.mean() == pytest.approx(0, abs=1e-4)
    assert wall.log_image.std() == pytest.approx(0.4, rel=1e-4)
    steps = np.abs(np.diff(wall.log_image, axis=1))
    assert np.abs(wall.log_image[:, -1] - wall.log_image[:, 0]).max() <= steps.max()


@pytest.mark.parametrize("way_px", [0.0, 0.6, 5.0])
def test_extremes_are_those_of_every_path_of_a_span(way_px):
    wall = noisy_wall(texel_m=0.4 * PIXEL_M)
    starts = Pose(turn_about("z", 20)), Pose(turn_about("z", 20) @ turn_about("y", 3))
    for start in starts:
        poses = [Pose(start.rotation, np.array([x * PIXEL_M, 0.2 * x * PIXEL_M, 0])) for x in np.linspace(0, way_px, 9)]
        views = np.stack([wall.from_pixels(pose, SMALL) for pose in poses])
        lowest, highest = wall.extremes(views, SMALL)
        seen = np.stack([wall.log_reflectance(view, WHOLE) for view in views])
        y, x = np.mgrid[: SMALL.height, : SMALL.width]
        u = np.stack([x, y, np.ones_like(x)], -1) @ views[len(views) // 2].T
        column, row = (np.floor(u[..., i] / u[..., 2]).astype(int) % wall.log_image.shape[1 - i] for i in (0, 1))
        assert (lowest[row, column] <= seen.min(0) + 1e-6).all()
        assert (highest[row, column] >= seen.max(0) - 1e-6).all()
        # They are no wider than they need to be: the light's own range on a path, and a few points more.
        assert np.mean(highest[row, column] - lowest[row, column]) < np.mean(np.ptp(seen, axis=0)) + 1.0


def test_beyond_a_long_way_every_pixel_is_followed():
    wall = noisy_wall(texel_m=0.1 * PIXEL_M)
    views = np.stack([wall.from_pixels(Pose(position_m=np.array([x * PIXEL_M, 0, 0])), SMALL) for x in range(6)])
    lowest, highest = wall.extremes(views, SMALL)
    assert np.isneginf(lowest).all()
    assert np.isposinf(highest).all()


# -- pixels


@pytest.mark.parametrize("texel_px", [1.0, 0.25], ids=["a point a pixel", "four points a pixel"])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_wall_pixels_behave_as_lit_pixels_do(noise, texel_px):
    """Compare the kernel of the wall, row by row and with skipped pixels, with the kernel of the marker."""
    # Lively stripes in a calm wall. At four points a pixel the 5 px of a span lead from a calm place
    # across a whole stripe, so the short cut must not be taken.
    image = noisy_wall(3, shape=(64, 160)).log_image
    image = np.where(np.arange(160) // 8 % 5 == 2, 2 * image, 0)
    wall, n, stretches = Wall(log_image=image, texel_m=texel_px * PIXEL_M), SMALL.width * SMALL.height, 20
    model = PixelModel(threshold_spread=0.03, noise=noise)
    signal = np.exp(wall.log_reflectance(wall.from_pixels(Pose(), SMALL), WHOLE))
    found = []
    for kind in ("wall", "lit"):
        state = start_pixels(signal.ravel(), model, np.random.default_rng(0))
        memory = (state.level, state.reference, state.free_us, state.threshold_on, state.threshold_off)
        settings = (np.uint64(99), noise, 150.0, 50.0, 20.0, 30.0)
        events, skipped, before = [], np.zeros(n, bool), NOTHING_BEFORE
        for span in range(4):  # state is carried from span to span
            edges = np.linspace(0, 10_000, stretches + 1) + 10_000 * span
            moments = np.round(edges[:-1] * 16).astype(np.int64)
            poses = [Pose(position_m=np.array([0.25 * PIXEL_M * (k + stretches * span), 0, 0])) for k in range(20)]
            views = np.stack([wall.from_pixels(pose, SMALL) for pose in poses])
            pixels, times = np.empty(1 << 20, np.uint32), np.empty(1 << 20)
            if kind == "wall":
                done, count = fire_wall_pixels(
                    0, SMALL.width, np.zeros(n, bool), skipped, wall.repeated, *wall.extremes(views, SMALL), 0.0,
                    before, views, edges, moments, *memory, *settings, pixels, times, 0,
                )  # fmt: skip
                before = views, edges, moments
                assert 0.05 < skipped.mean() < 0.95
            else:
                seen = [wall.log_reflectance(v, WHOLE).ravel() for v in views]
                done, count = fire_lit_pixels(
                    0, np.arange(n, dtype=np.int32), np.exp(np.stack(seen)), np.zeros((stretches, 1, n), np.float32),
                    edges, moments, np.zeros((stretches, 1), np.float32), np.arange(stretches, dtype=np.int32),
                    *memory, *settings, pixels, times, 0,
                )  # fmt: skip
            assert done == n
            events.append(np.stack([pixels[:count], times[:count]]))
        events = np.concatenate(events, axis=1)
        found.append(events[:, np.lexsort((events[1], events[0]))])
    wall_events, lit_events = found
    assert wall_events.shape[1] > 500
    # The short cut leaves a calm pixel on its light, a lag of 150 us and its noise aside: a pixel in a
    # thousand may fire otherwise when it wakes up.
    # A pixel that slept wakes up with the level that it would have had, so both do the same at the same time; the
    # lit ones' signal is rounded to 32 bits, and a pixel that only just reaches its threshold is late by more.
    assert wall_events.shape == lit_events.shape
    np.testing.assert_array_equal(wall_events[0], lit_events[0])
    away_us = np.abs(wall_events[1] - lit_events[1])
    assert np.median(away_us) < 1e-3
    assert away_us.max() < 5


def test_wall_pixels_that_run_out_of_room_go_on_where_they_ended():
    wall, n = noisy_wall(5), SMALL.width * SMALL.height
    model = PixelModel()
    poses = [Pose(position_m=np.array([0.25 * PIXEL_M * k, 0, 0])) for k in range(20)]
    views = np.stack([wall.from_pixels(pose, SMALL) for pose in poses])
    edges = np.linspace(0, 4_000, 21)
    signal = np.exp(wall.log_reflectance(views[0], WHOLE)).ravel()
    found = []
    for room in (1 << 20, 70_000):  # a few hundred pixels that may fire 6 times in each of 20 stretches
        state = start_pixels(signal, model, np.random.default_rng(0))
        memory = (state.level, state.reference, state.free_us, state.threshold_on, state.threshold_off)
        taken, skipped, done, calls, events = np.zeros(n, bool), np.zeros(n, bool), 0, 0, []
        while done < n:
            pixels, times = np.empty(room, np.uint32), np.empty(room)
            done, count = fire_wall_pixels(
                done, SMALL.width, taken, skipped, wall.repeated, *wall.extremes(views, SMALL), 0.0, NOTHING_BEFORE,
                views, edges, np.round(edges[:-1] * 16).astype(np.int64), *memory,
                np.uint64(99), 0.05, 150.0, 50.0, 20.0, 30.0, pixels, times, 0,
            )  # fmt: skip
            calls += 1
            events.append(np.stack([pixels[:count], times[:count]]))
        events = np.concatenate(events, axis=1)
        found.append((events[:, np.lexsort(events)], state.level, skipped, calls))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[0][1], found[1][1])
    np.testing.assert_array_equal(found[0][2], found[1][2])
    assert found[0][0].shape[1] > 100
    assert found[1][3] > found[0][3]


def test_a_ramp_of_light_makes_the_events_that_fit_into_it():
    # Log light rises by 0.02 a px; 60 px of way are 1.2 = 4.8 thresholds: 4 ON events a pixel, no OFF.
    middle = 1024 / 3  # is straight ahead
    ramp = np.tile(0.02 * (np.arange(1024) - middle).astype(np.float32), (16, 1))
    wall = Wall(log_image=ramp, texel_m=PIXEL_M)
    model = replace(EXACT, refractory_us=0.0)
    events = record(before(wall, sideways(600), model=model), 0.1, 0)
    check_events(events, SMALL.width, SMALL.height)
    assert (events["p"] == 1).all()
    assert events.size == 4 * SMALL.width * SMALL.height
    back = record(before(wall, sideways(-600), model=model), 0.1, 0)
    assert (back["p"] == 0).all()
    assert back.size == events.size
    # The k-th fires after 12.5 k px, at 600 px/s; the light moves in steps of a quarter pixel, 417 us.
    for k, when in enumerate(np.sort(events["t"]).reshape(4, -1), start=1):
        assert np.abs(when - 12.5 * k / 600e-6).max() < 417 + 1000


def test_a_still_camera_sees_no_wall():
    wall = noisy_wall()
    model = PixelModel(threshold_spread=0.03, noise=0.0, background_hz=0.0, hot_pixels=0)
    assert record(before(wall, Still(), model=model), 0.03, 0).size == 0
    # Nor beside a marker that moves across it, where the marker's light does not reach.
    path = Moving(start=Pose.facing(5.0), velocity_m_per_s=(0.2, 0.0, 0.0))
    events = record(before(wall, Still(), PlacedMarker(path=path), model=model), 0.03, 0)
    assert events.size > 1000
    assert np.abs(events["x"].astype(float) - 59.5).max() < 8.3 + 2 + 24
    assert np.abs(events["y"].astype(float) - 44.5).max() < 8.3 + 24


@pytest.mark.parametrize("faster", [4, 16])
def test_events_follow_the_way_not_the_time(faster):
    # 48 px each, at 60 px/s and faster, over texture of 4 px a point, twice the usual contrast.
    wall = Wall(log_image=2 * noisy_wall(5).log_image, texel_m=4 * PIXEL_M)
    # A dead time would swallow more light the faster it moves.
    model = replace(EXACT, refractory_us=0.0, time_constant_us=150.0)
    slow = record(before(wall, sideways(60), model=model), 0.8, 0)
    fast = record(before(wall, sideways(60 * faster), model=model), 0.8 / faster, 0)
    # A pixel lags by 150 us, at 960 px/s by 0.14 px: 0.3 % of the way is not seen by the end. Between its
    # points the texture is straight; where it turns, at slopes of about 0.1 / px, the lag rounds 0.014 off
    # swings of about 1: 1.4 %.
    assert slow.size > 5000
    assert fast.size == pytest.approx(slow.size, rel=0.02)


def test_the_cost_follows_the_way_not_the_time():
    wall = noisy_wall()

    def steps(px_per_s, seconds):
        recorder = Recorder(before(wall, sideways(px_per_s)), seconds, np.random.default_rng(0))
        chunks = range(0, recorder.duration_us, 10_000)
        return sum(recorder._motion_steps(t, t + 10_000).size - 1 for t in chunks), len(chunks)

    for speed in (1.0, 10.0, 100.0, 1000.0):
        made, chunks = steps(speed, 10.0 / speed if speed > 10 else 1.0)
        way = 10.0 if speed > 10 else speed
        assert 4 * way <= made + 1e-9
        assert made <= 4 * way + chunks  # a border of a chunk may cut a step


def test_a_plate_hides_the_wall():
    # Camera and marker move together before the wall; the LED is off.
    start = Pose.facing(1.0)
    velocity = (0.2, 0.0, 0.0)
    dark = PlacedMarker(marker=Marker(current_ma=0.0), path=Moving(start=start, velocity_m_per_s=velocity))
    camera = Moving(velocity_m_per_s=velocity)
    events = record(before(noisy_wall(7), camera, dark), 0.3, 0)
    half = 0.025 * SMALL.focal_px / 1.0  # 41 px
    away = np.maximum(np.abs(events["x"] - 59.5), np.abs(events["y"] - 44.5))
    # The plate's blurred border ends 4 sigma inside; the halo lets 3 % of the wall through, far below a threshold.
    assert np.count_nonzero(away < half - 5) == 0
    assert np.count_nonzero(away > half + 5) > 1000


def test_a_marker_before_a_moving_wall_still_blinks():
    marker = PlacedMarker(path=Moving(start=Pose.facing(2.5), velocity_m_per_s=(0.2, 0.0, 0.0)))
    camera = Moving(velocity_m_per_s=(0.2, 0.0, 0.0))
    light = Light(led_to_ambient=1.4)
    both = record(before(noisy_wall(), camera, marker, light=light), 0.03, 0)
    plain = record(before(None, camera, marker, light=light), 0.03, 0)
    inside = [e[np.maximum(np.abs(e["x"] - 59.5), np.abs(e["y"] - 44.5)) < 10] for e in (both, plain)]
    assert inside[0].size == pytest.approx(inside[1].size, rel=0.02)  # the plate hides the wall there
    check_events(both, SMALL.width, SMALL.height)


def test_a_camera_that_looks_away_does_not_see_the_wall():
    away = Moving(start=pan(0.1, 1.0, start_deg=180).pose_at(0), velocity_m_per_s=(0.5, 0.0, 0.0))
    assert record(before(noisy_wall(), away), 0.05, 0).size == 0


# -- misuse


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Wall(log_image=np.zeros(5, np.float32)), ["two-dimensional"]),
        (lambda: Wall(log_image=np.full((16, 16), np.nan, np.float32)), ["finite"]),
        (lambda: Wall(log_image=np.zeros((5, 50), np.float32)), ["(5, 50)", "8 x 8"]),
        (lambda: Wall(log_image=np.zeros((16, 16), np.float32), distance_m=0.0), ["distance_m=0.0", "more than 0"]),
        (lambda: textured_wall("mona lisa"), ["'mona lisa'", "brick"]),
        (lambda: textured_wall(contrast=-1.0), ["contrast=-1.0", "0 or more"]),
    ],
)
def test_settings_that_cannot_be_are_refused(make, words):
    with pytest.raises(ValueError) as refused:
        make()
    assert all(word in str(refused.value) for word in words), refused.value
