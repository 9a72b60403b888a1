"""Tests of lamps: their light over time, their image, and the events that they make."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.boxes import Box
from bicode_lab.camera import Flicker, Lamp, Light, Moving, Optics, PixelModel, Pose, Scene, Still, record, truth_at
from bicode_lab.camera.lamp import LampImage

SMALL = Optics(width=60, height=40)
QUIET = PixelModel(background_hz=0.0, hot_pixels=0)

flickers = st.builds(
    Flicker,
    rate_hz=st.floats(20, 5000),
    shape=st.sampled_from(["sine", "square"]),
    depth=st.floats(0, 1),
    duty=st.floats(0.05, 0.95),
    phase_us=st.floats(-1e5, 1e5),
)


def level_at(flicker: Flicker, span: tuple[float, float], t_us: np.ndarray) -> np.ndarray:
    times, levels = flicker.steps(*span)
    assert times[0] == span[0]
    assert (np.diff(times) > 0).all()
    return levels[np.searchsorted(times, t_us, side="right") - 1]


@given(flickers, st.floats(0, 1e7))
def test_a_span_cut_in_two_shows_the_same_light(flicker: Flicker, start_us: float) -> None:
    t_us = start_us + np.linspace(101, 29_907, 97)
    whole = level_at(flicker, (start_us, start_us + 30_000), t_us)
    cut_us = start_us + 15_000.5
    early, late = t_us < cut_us, t_us >= cut_us
    halves = [
        level_at(flicker, (start_us, cut_us), t_us[early]),
        level_at(flicker, (cut_us, start_us + 3e4), t_us[late]),
    ]
    assert np.array_equal(whole, np.concatenate(halves))
    assert ((whole >= 1 - flicker.depth - 1e-9) & (whole <= 1)).all()


def test_a_ripple_is_smooth_and_its_mean_is_half_its_depth_below_full() -> None:
    times, levels = Flicker(rate_hz=100, depth=0.6).steps(0, 10_000)
    assert np.abs(np.diff(levels)).max() < 0.6 * np.pi / 40
    assert levels @ np.diff(np.append(times, 10_000)) / 10_000 == pytest.approx(0.7)


def test_the_lens_spreads_a_lamps_light_and_keeps_its_sum() -> None:
    optics = Optics(width=301, height=301)
    px = 5.0 / optics.focal_px
    lamp = Lamp(path=Still(Pose.facing(5.0)), width_m=6.4 * px, height_m=3.5 * px)
    image = LampImage(lamp, optics, Light())
    pose = lamp.path.pose_at(0)
    everywhere, cover = image.image(pose, Box(0, 0, 301, 301))
    assert everywhere.sum() == pytest.approx(6.4 * 3.5, rel=1e-3)
    assert not cover.any()
    assert np.unravel_index(everywhere.argmax(), everywhere.shape) == (150, 150)
    reach = image.reach([pose])
    assert everywhere[reach.y : reach.bottom, reach.x : reach.right].sum() == pytest.approx(everywhere.sum(), rel=1e-3)


def test_a_mains_lamp_brightens_and_darkens_a_hundred_times_a_second() -> None:
    lamp = Lamp(flicker=Flicker(rate_hz=100, depth=0.95), brightness=5)
    events = record(Scene(markers=(), lamps=(lamp,), optics=SMALL, pixel_model=QUIET), 0.5, 0)
    events = events[events["t"] > 50_000]
    at = events["t"] % 10_000
    rising = (at > 300) & (at < 5_300)  # the light is darkest at 0, and pixels follow within 300 us
    assert (events["p"][rising] == 1).mean() > 0.95
    assert (events["p"][~rising] == 0).mean() > 0.95
    assert np.abs(events["x"] - 29.5).max() < 16


def test_a_lamp_is_none_of_the_truth_and_goes_its_way() -> None:
    lamp = Lamp(flicker=Flicker(rate_hz=1000, shape="square"), width_m=0.01, height_m=0.01)
    moving = replace(lamp, path=Moving(start=Pose.facing(5.0, x_m=-0.06), velocity_m_per_s=(0.12, 0, 0)))
    scene = Scene(markers=(), lamps=(moving,), optics=SMALL, pixel_model=QUIET)
    assert truth_at(scene, 0) == []
    assert not scene.is_still
    events = record(scene, 1.0, 0)
    early, late = events["x"][events["t"] < 2e5].mean(), events["x"][events["t"] > 8e5].mean()
    assert late - early == pytest.approx(0.8 * 0.12 / 5 * SMALL.focal_px, abs=1.5)


@pytest.mark.parametrize(
    "wrong", [{"rate_hz": 0}, {"depth": 1.5}, {"duty": 0}, {"duty": 1}, {"shape": "saw"}, {"rate_hz": float("nan")}]
)
def test_what_is_no_flicker_is_refused(wrong: dict) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Flicker(**wrong)


def test_what_is_no_lamp_is_refused() -> None:
    with pytest.raises(ValueError, match="brightness"):
        Lamp(brightness=0)
