"""Tests of whole scenes: what must not matter does not matter, and the statistics are those of the settings."""

import sys
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy import stats

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
    pan,
    record,
    spin,
)
from bicode_lab.camera.optics import ambient_signal
from bicode_lab.events import check_events, no_events
from bicode_lab.marker import Board, Marker

record_module = sys.modules[Recorder.__module__]  # its name in the package is that of its function

SMALL = Optics(width=200, height=150)
QUIET = PixelModel(background_hz=0.0, hot_pixels=0, time_constant_us=150.0)
EXACT = replace(QUIET, threshold_spread=0.0, noise=0.0)
INSTANT = Readout(row_us=0.0, peak_mev_per_s=1e9, sustained_mev_per_s=1e9)
LIGHT = Light(led_to_ambient=1.43)


def scene(*placed, **settings):
    """Return a scene on a small sensor, with no chance but what is asked for."""
    defaults = {"optics": SMALL, "pixel_model": EXACT, "readout": INSTANT, "light": LIGHT}
    return Scene(markers=placed, **(defaults | settings))


def at(distance_m, x_px=0.0, y_px=0.0, *, path=None, **marker):
    """Return a marker whose middle is so many pixels to the right of and below the middle of the image."""
    scale = distance_m / SMALL.focal_px
    pose = Pose.facing(distance_m, x_m=x_px * scale, y_m=y_px * scale)
    return PlacedMarker(marker=Marker(**marker), path=path(pose) if path else Still(pose))


def as_set(events):
    """Return events as a sorted array, so that order within a microsecond does not matter."""
    return np.sort(events, order=["t", "y", "x", "p"])


def counts(events):
    """Count the events of each pixel of the small sensor, shape (height, width)."""
    places = events["y"].astype(int) * SMALL.width + events["x"]
    return np.bincount(places, minlength=SMALL.height * SMALL.width).reshape(SMALL.height, SMALL.width)


@dataclass(frozen=True)
class Unmoving:
    """A trajectory that says it moves, and does not."""

    pose: Pose = field(default_factory=Pose)
    is_still: bool = False

    def pose_at(self, t_s):
        return self.pose


# -- order, bounds, repetition


@pytest.mark.parametrize(
    "placed",
    [
        at(1.0),
        at(2.5, path=lambda p: spin(p, 64)),
        at(2.5, -90, path=lambda p: Moving(start=p, velocity_m_per_s=(2.0, 0.5, 0.0))),
        at(1.0, 100, 70),
    ],
    ids=["near", "spinning", "passing", "in the corner"],
)
def test_events_are_sorted_and_on_the_sensor(placed):
    recorder = Recorder(scene(placed, optics=SMALL, pixel_model=PixelModel(), readout=Readout()), 0.03, _rng(3))
    chunks = list(recorder)
    events = np.concatenate(chunks)
    assert events.size > 500
    check_events(events, SMALL.width, SMALL.height)
    assert recorder.queue.lost == 0
    for number, chunk in enumerate(chunks):
        assert chunk["t"][0] >= number * record_module.CHUNK_US


def _rng(seed):
    return np.random.default_rng(seed)


def test_the_same_seed_is_the_same_recording_and_another_is_not():
    one = scene(at(5.0), pixel_model=PixelModel())
    first, again, other = (record(one, 0.02, seed) for seed in (1, _rng(1), 2))
    np.testing.assert_array_equal(first, again)
    assert first.tolist() != other.tolist()


def test_a_shorter_recording_is_the_beginning_of_a_longer_one():
    one = scene(at(5.0), pixel_model=PixelModel(background_hz=5.0))
    short, long = record(one, 0.02, 1), record(one, 0.05, 1)
    np.testing.assert_array_equal(long[: short.size], short)
    assert (long["t"][short.size :] >= short["t"][-1]).all()


def test_a_dark_marker_makes_no_events():
    assert record(scene(at(2.5, current_ma=0.0)), 0.03, 0).size == 0
    assert record(scene(), 0.03, 0).size == 0
    assert record(scene(at(2.5), optics=replace(SMALL, infrared_filter=True)), 0.03, 0).size == 0


@pytest.mark.parametrize(
    "pose",
    [
        Pose.facing(2.5, x_m=10.0),
        Pose(Pose.facing(1).rotation, np.array([0.0, 0.0, -2.5])),
        Pose(Pose.facing(1).rotation, np.zeros(3)),
    ],
    ids=["outside", "behind", "in the lens"],
)
def test_a_marker_out_of_sight_makes_no_events(pose):
    assert record(scene(PlacedMarker(path=Still(pose))), 0.03, 0).size == 0
    assert record(scene(PlacedMarker(path=Unmoving(pose))), 0.03, 0).size == 0


def test_a_marker_partly_outside_is_the_part_inside():
    # What a wider sensor sees in the same columns: the marker's middle is on column 199.5 of both.
    thin = Board(thickness_m=1e-9)  # off the axis a thick plate shows a side
    wide = replace(SMALL, width=SMALL.width + 100)
    whole = record(scene(at(2.5, x_px=50, board=thin), optics=wide), 0.02, 0)
    part = record(scene(at(2.5, x_px=100, board=thin)), 0.02, 0)
    inside = whole[whole["x"] < SMALL.width]
    assert 0.3 * whole.size < part.size < 0.7 * whole.size
    # One-ulp differences of the drawing move a border sample here and there, see the shift below.
    assert np.abs(counts(part) - counts(inside)).sum() <= 2e-3 * inside.size


# -- what must not matter


def moving_scene(model=EXACT):
    return scene(at(2.5, -20, path=lambda p: Moving(start=p, velocity_m_per_s=(1.0, 0.0, 0.0))), pixel_model=model)


def test_an_unmoving_path_is_still():
    model = QUIET
    still = record(scene(at(2.5), pixel_model=model), 0.03, 4)
    moving = record(scene(PlacedMarker(path=Unmoving(Pose.facing(2.5))), pixel_model=model), 0.03, 4)
    slow = Moving(start=Pose.facing(2.5), velocity_m_per_s=(1e-12, 0.0, 0.0))
    assert not slow.is_still
    crawling = record(scene(PlacedMarker(path=slow), pixel_model=model), 0.03, 4)
    np.testing.assert_array_equal(moving, still)
    np.testing.assert_array_equal(crawling, still)


def test_how_many_drawings_are_held_at_once_does_not_matter(monkeypatch):
    # 1 m/s at 2.5 m are 6.6 px in 10 ms: 27 steps, so spans of 20, 7 and 40 cut them differently.
    expected = record(moving_scene(), 0.03, 0)
    for steps in (7, 40):
        monkeypatch.setattr(record_module, "STEPS_PER_SPAN", steps)
        found = record(moving_scene(), 0.03, 0)
        # Light below all thresholds is not followed, and settles: a level wrong by less than one
        # threshold where a pixel wakes up. So a few events at the rim may move or go.
        assert found.size == pytest.approx(expected.size, rel=2e-3)
        same = set(found.tolist()) & set(expected.tolist())
        assert len(same) > 0.99 * expected.size


@pytest.mark.parametrize("chunk_us", [3_300, 7_000, 30_000])
def test_where_chunks_are_cut_does_not_matter(monkeypatch, chunk_us):
    # Noise included: a stretch cut by a border keeps that of the moment it began.
    pair = scene(at(5.0, -10), at(5.0, 10, payload=0xC3, phase_us=123.0), pixel_model=QUIET)
    expected = as_set(record(pair, 0.03, 0))
    monkeypatch.setattr(record_module, "CHUNK_US", chunk_us)
    found = as_set(record(pair, 0.03, 0))
    assert found.size == expected.size
    # At a border the state is rounded to float32: a crossing moves by about 1e-5 us, and one in 1e5
    # into the next whole microsecond.
    assert np.mean(found == expected) > 0.998


class Vanishing:
    """A trajectory that leaves the view between two moments."""

    is_still = False

    def pose_at(self, t_s):
        return Pose.facing(5.0, x_m=0.0 if t_s < 0.02 else 50.0)


def test_pixels_go_dark_when_a_lit_marker_is_gone():
    # At 20 ms the LED (0xFF, a packet later) is on or was within 0.5 ms; nothing may stay lit.
    marker = Marker(payload=0xFF, phase_us=20_000 - 3750)
    assert marker.waveform.state(19_999) == marker.waveform.state(20_001) == 1
    gone = record(scene(PlacedMarker(marker=marker, path=Vanishing())), 0.04, 0)
    after = gone[gone["t"] >= 20_030]  # those on their way are late by 20 us
    assert after.size > 100
    assert (after["p"] == 0).all()
    assert after["t"].max() < 20_000 + 5 * 150 * 2  # five time constants in the dark, and some


def test_the_room_for_events_does_not_matter(monkeypatch):
    expected = record(scene(at(2.5), pixel_model=QUIET), 0.03, 0)
    monkeypatch.setattr(record_module, "BUFFER_EVENTS", 16)
    np.testing.assert_array_equal(record(scene(at(2.5), pixel_model=QUIET), 0.03, 0), expected)


def test_a_camera_that_moves_along_with_the_marker_sees_it_still():
    still = record(scene(at(2.5)), 0.03, 0)
    along = Moving(start=Pose(), velocity_m_per_s=(0.5, 0.2, 0.1))
    path = Moving(start=Pose.facing(2.5), velocity_m_per_s=(0.5, 0.2, 0.1))
    moving = record(scene(PlacedMarker(path=path), camera=along), 0.03, 0)
    assert moving.size == pytest.approx(still.size, rel=1e-3)


def test_a_shift_by_whole_pixels_shifts_the_events():
    thin = Board(thickness_m=1e-9)  # off the axis a thick plate shows a side
    here = record(scene(at(5.0, board=thin)), 0.03, 0)
    there = record(scene(at(5.0, 31, -17, board=thin)), 0.03, 0)
    moved = here.copy()
    moved["x"] += 31
    moved["y"] -= 17
    # One-ulp differences of the drawing move a border sample (1/16 px) here and there: a per mille of
    # events may come or go, and all others within 1 us of microsecond rounding or so.
    assert np.abs(counts(moved) - counts(there)).sum() <= 2e-3 * here.size
    assert np.median(np.abs(moved["t"][: there.size] - there["t"][: moved.size])) <= 1


def test_a_later_phase_shifts_the_times():
    # 0x03 ends in a 0 (IEEE: ON, OFF), so 137 us before its packet the LED is off, as at rest.
    now, later = (record(scene(at(5.0, payload=0x03, phase_us=phase)), 0.03, 0) for phase in (0.0, 137.0))
    a, b = as_set(now[now["t"] < 29_800]), as_set(later[later["t"] < 29_937])
    assert a.size == b.size > 5000
    for name in "xyp":
        assert np.mean(a[name] == b[name]) > 0.999
    # The spans are cut elsewhere, where the state is kept in float32: microseconds may round the other way.
    shift = b["t"] - a["t"]
    assert np.abs(shift - 137).max() <= 1
    assert np.mean(shift == 137) > 0.995


@pytest.mark.parametrize("model", [EXACT, QUIET], ids=["exact", "noise and spread"])
def test_markers_far_apart_do_not_know_of_each_other(model):
    left = at(5.0, -60, payload=0x25)
    right = at(4.0, 60, payload=0xC3, phase_us=777.0, clock_error_ppm=350.0)
    both = record(scene(left, right, pixel_model=model), 0.03, 7)
    alone = [record(scene(one, pixel_model=model), 0.03, 7) for one in (left, right)]
    np.testing.assert_array_equal(as_set(both), as_set(np.concatenate(alone)))
    assert min(e.size for e in alone) > 1000


def test_markers_whose_light_meets_share_a_patch():
    left, right = at(5.0, -12, payload=0x25), at(5.0, 12, payload=0xC3, phase_us=777.0)
    lower = at(2.5, 60, 60)
    recorder = Recorder(scene(left, lower, right), 0.01, _rng(0))
    for _ in recorder:
        pass
    patches = recorder._patches
    places = np.concatenate([patch.index for patch in patches])
    assert np.unique(places).size == places.size  # no pixel is in two patches
    assert sorted(len(patch.waveforms) for patch in patches) in ([3], [1, 2])
    # Between them the light adds: more than from either alone.
    both = record(scene(left, right), 0.03, 0)
    alone = [record(scene(one), 0.03, 0) for one in (left, right)]
    check_events(both, SMALL.width, SMALL.height)
    assert abs(both.size / sum(e.size for e in alone) - 1) < 0.25
    # Far out to the left only the left one shines (its halo ends 24 px on).
    edge = 200 / 2 - 12 - 8
    own = [e[e["x"] < edge - 2] for e in (both, alone[0])]
    assert own[0].size == pytest.approx(own[1].size, rel=0.1)


# -- physics of the whole


def test_a_brighter_marker_reaches_more_pixels():
    sizes = [record(scene(at(5.0, current_ma=i)), 0.02, 0) for i in (2.7, 5.5, 10.7, 21.3, 42.6)]
    areas = [np.unique(e["y"].astype(int) * 1000 + e["x"]).size for e in sizes]
    assert areas == sorted(areas)
    assert areas[-1] > 1.2 * areas[2]  # the halo swells it (Fig. 13c)


def test_brighter_surroundings_hide_it():
    # 1.43 x 350 / 2000 = 0.25: log contrast 0.22 on 2000 lx, under the threshold of 0.25.
    indoors = record(scene(at(1.0)), 0.02, 0)
    outdoors = record(scene(at(1.0), light=replace(LIGHT, illuminance_lux=2000.0)), 0.02, 0)
    assert np.log(1 + 1.43 * 350 / 2000) == pytest.approx(0.22, abs=0.005)
    assert indoors.size > 10_000
    assert outdoors.size == 0
    assert ambient_signal(replace(LIGHT, illuminance_lux=2000.0), SMALL) == pytest.approx(2000 / 350)


def test_the_opening_changes_the_speed_not_the_contrast():
    # Four times the light, a quarter of the time constant. With four times the time constant at light 1
    # it is the same recording, but for the rounding of the logarithm: 1e-7.
    slow = record(scene(at(2.5), optics=replace(SMALL, f_number=5.6)), 0.02, 0)
    fast = record(scene(at(2.5), optics=replace(SMALL, f_number=2.8)), 0.02, 0)
    model = replace(EXACT, time_constant_us=4 * EXACT.time_constant_us)
    same = record(scene(at(2.5), optics=replace(SMALL, f_number=2.8), pixel_model=model), 0.02, 0)
    assert np.abs(counts(same) - counts(slow)).sum() <= 1e-3 * slow.size
    assert np.abs(counts(fast) - counts(slow)).sum() > 0.05 * slow.size


def test_events_follow_the_leds_edges():
    marker = Marker(payload=0x25)
    events = record(scene(at(5.0), pixel_model=QUIET), 0.028, 0)
    times, levels = marker.waveform.steps(0, 28_000)
    edge = np.searchsorted(times, events["t"] - 20, side="right") - 1  # 20 us is the shorter latency
    agrees = events["p"] == levels[edge]
    # Behind a rising edge only ON, behind a falling one only OFF; some pixels may lag by a chip.
    assert agrees.mean() > 0.999
    late = events["t"] - times[edge]
    assert late.min() >= 20
    assert np.median(late) < 250  # half a chip


@pytest.mark.parametrize("thresholds", [(0.25, 0.25), (0.2, 0.3), (0.35, 0.2)])
def test_without_a_dead_time_events_add_up_to_the_light(thresholds):
    on, off = thresholds
    model = replace(EXACT, threshold_on=on, threshold_off=off, refractory_us=0.0)
    events = record(scene(at(2.5), pixel_model=model), 0.06, 0)
    # Each event moves the reference by its threshold, and it stays between dark and full light.
    moved = counts(events[events["p"] == 1]) * on - counts(events[events["p"] == 0]) * off
    assert moved.min() >= -1e-6
    assert moved.max() <= np.log(1 + 1.43 * 1.05)  # the halo makes no pixel brighter than the face
    # So the ratio of their numbers is the inverse of the thresholds', to one rise a pixel.
    ons, offs = (np.count_nonzero(events["p"] == p) for p in (1, 0))
    assert ons * on == pytest.approx(offs * off, abs=np.count_nonzero(counts(events)) * np.log(2.5))
    assert ons / offs == pytest.approx(off / on, rel=0.1)


def test_a_spun_marker_after_half_a_turn_is_its_mirror_through_the_middle():
    # 64 rpm: half a turn takes 0.46875 s; the chips are the same a whole number of packets (14 ms) later.
    first = record(scene(at(2.0)), 0.014, 0)
    turned = record(scene(PlacedMarker(path=Still(Pose.facing(2.0, roll_deg=180)))), 0.014, 0)
    one, other = counts(first), counts(turned)
    assert np.abs(one[::-1, ::-1] - other).sum() <= 0.01 * first.size
    assert np.abs(one - other).sum() > 0.1 * first.size  # and not its own


# -- chance


def test_background_events_come_at_the_rate_and_share_asked_for():
    model = PixelModel(background_hz=2.0, background_off_share=0.64, hot_pixels=0)
    events = record(scene(pixel_model=model), 2.0, 11)
    expected = 2.0 * SMALL.width * SMALL.height * 2.0
    assert abs(events.size - expected) < 4 * np.sqrt(expected)  # Poisson
    off = np.count_nonzero(events["p"] == 0)
    assert stats.binomtest(off, events.size, 0.64).pvalue > 1e-4
    assert stats.kstest(events["t"] / 2e6, "uniform").pvalue > 1e-4
    per_pixel = np.bincount(events["y"].astype(int) * SMALL.width + events["x"], minlength=SMALL.width * SMALL.height)
    # As Poisson per pixel: variance = mean, to 4 standard errors sqrt(2 / n).
    assert abs(per_pixel.var() / per_pixel.mean() - 1) < 4 * np.sqrt(2 / per_pixel.size) + 0.01


def test_hot_pixels_are_few_and_fast():
    model = PixelModel(background_hz=0.0, hot_pixels=40, hot_pixel_hz=200.0)
    events = record(scene(pixel_model=model), 2.0, 12)
    rates = np.unique(events["y"].astype(int) * SMALL.width + events["x"], return_counts=True)[1] / 2.0
    assert 35 <= rates.size <= 40
    assert rates.max() < 200 + 4 * np.sqrt(200 / 2)
    # Evenly in the logarithm over two decades: the median is a tenth of the fastest, +-4 x 1.25 x sigma / sqrt(n).
    spread = 4 * 1.25 * (2 / np.sqrt(12)) / np.sqrt(40)
    assert abs(np.log10(np.median(rates) / 200) + 1) < spread
    assert record(scene(pixel_model=replace(model, hot_pixels=0)), 2.0, 12).size == 0


def test_too_many_events_for_the_link_are_lost_and_counted():
    free = record(scene(at(1.0)), 0.02, 0)
    recorder = Recorder(scene(at(1.0), readout=Readout(sustained_mev_per_s=0.5, buffer_events=500)), 0.02, _rng(0))
    kept = np.concatenate([no_events(), *recorder])
    assert recorder.queue.lost == free.size - kept.size > 0
    assert kept.size <= 0.5 * 20_000 + 500 + 1
    assert recorder.queue.longest_wait_us > 0
    check_events(kept, SMALL.width, SMALL.height)


# -- steps follow the way


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.5, 2.0])
def test_a_step_is_a_quarter_pixel_of_way(speed):
    path = Moving(start=Pose.facing(2.5), velocity_m_per_s=(speed, 0.0, 0.0))
    recorder = Recorder(scene(PlacedMarker(path=path)), 0.1, _rng(0))
    for start in range(0, 100_000, 10_000):
        cuts = recorder._motion_steps(start, start + 10_000)
        way = speed * 0.01 / 2.5 * SMALL.focal_px
        assert cuts.size - 1 == max(1, int(np.ceil(way / 0.25)))
        assert (cuts[0], cuts[-1]) == (start, start + 10_000)
        np.testing.assert_allclose(np.diff(cuts), 10_000 / (cuts.size - 1), rtol=1e-3)


def test_the_fastest_point_counts():
    # A marker that spins about its middle: its corners go r x omega.
    recorder = Recorder(scene(at(1.0, path=lambda p: spin(p, 64))), 0.1, _rng(0))
    way = 0.025 * np.sqrt(2) / 1.0 * SMALL.focal_px * 64 / 60 * 2 * np.pi * 0.01
    assert recorder._motion_steps(0, 10_000).size - 1 == int(np.ceil(way / 0.25))


def test_a_pan_moves_the_marker_across_the_image():
    # 0.314 m/s at 1 m (IV-E) for 0.1 s: 51.7 px to the left.
    events = record(scene(at(1.0), camera=pan(0.314, 1.0), optics=replace(SMALL, width=400)), 0.1, 0)
    early, late = (events[(events["t"] > a) & (events["t"] < a + 14_000)] for a in (0, 84_000))
    moved = np.median(late["x"].astype(int)) - np.median(early["x"].astype(int))
    assert moved == pytest.approx(-0.314 * 0.084 * SMALL.focal_px, abs=3)


# -- misuse


@pytest.mark.parametrize("seconds", [0, -1.0, 2e6, float("nan")])
def test_a_length_that_cannot_be_is_refused(seconds):
    with pytest.raises(ValueError, match=f"duration_s={seconds} is not in 0"):
        Recorder(scene(), seconds, _rng(0))


def test_negative_light_is_refused():
    with pytest.raises(ValueError, match="edge_glow=-1"):
        Scene(edge_glow=-1.0)
