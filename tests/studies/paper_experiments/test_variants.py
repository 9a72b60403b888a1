"""Trials of changed scenes: one recording serves all receivers. The sensor is small, so that they are quick."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.paper_experiments.variants import read_with, sample_frame_2d, with_pattern
from bicode_studies.statistics import accuracy_curves

WIDTH, HEIGHT = 160, 120
NEAR = Condition(figure="08", distance_m=2.5)


def small(scene):
    return replace(scene, optics=replace(scene.optics, width=WIDTH, height=HEIGHT))


def dark(scene):
    lightless = replace(scene.light, led_to_ambient=0.0)
    return replace(small(scene), light=lightless)


def settings(condition):
    return replace(receiver_settings(condition), width=WIDTH, height=HEIGHT)


def soft(condition):
    return SoftSettings(receiver=replace(settings(condition), detect_2d=False), evidence_periods=2, region_periods=0)


@pytest.fixture(scope="module")
def read():
    return read_with([NEAR], {"plain": settings, "soft": soft}, seeds=2, periods=2, changed=small)


def test_each_receiver_has_a_row_for_each_recording(read):
    assert list(zip(read["seed"], read["receiver"], strict=True)) == [
        (0, "plain"), (0, "soft"), (1, "plain"), (1, "soft")
    ]  # fmt: skip
    assert (read["periods"] == 2).all()
    counts = read[["id_right", "marker_2d_right", "axes_wrong"]].to_numpy()
    assert counts.min() >= 0
    assert counts.max() <= 2


def test_a_near_marker_is_read_and_one_without_light_is_not(read):
    assert (read[read["receiver"] == "plain"]["id_right"] == 2).all()
    unlit = read_with([NEAR], {"plain": settings}, seeds=1, periods=2, changed=dark)
    assert not unlit[["id_right", "marker_2d_right", "axes_wrong"]].to_numpy().any()


def test_the_same_again_is_the_same(read):
    again = read_with([NEAR], {"plain": settings, "soft": soft}, seeds=2, periods=2, changed=small)
    assert again.equals(read)


def test_curves_have_both_kinds_with_intervals(read):
    curves = accuracy_curves(read.assign(frame_rule_2d="any"), ["distance_m"])
    assert set(zip(curves["kind"], curves["receiver"], strict=True)) == {
        (kind, receiver) for kind in ("blinker", "2d") for receiver in ("plain", "soft")
    }
    assert (curves["seeds"] == 2).all()
    assert ((curves["low"] <= curves["accuracy"]) & (curves["accuracy"] <= curves["high"])).all()


def test_a_sample_is_of_the_first_frame_and_a_dark_one_is_empty():
    seen, unlit = (
        sample_frame_2d(NEAR),
        sample_frame_2d(NEAR, changed=lambda scene: replace(dark(scene), optics=scene.optics)),
    )
    assert seen.found is None or seen.found.id == seen.truth.aruco_id
    w = seen.box_px(10)[2]
    assert np.count_nonzero(seen.frame) > 0
    assert w == pytest.approx(seen.truth.box_px[2] + 20)
    assert 0.5 < seen.lit_share < 4
    assert unlit.lit_share < 0.05
    assert unlit.found is None


def test_another_pattern_is_all_that_is_other():
    scene = scene_of(NEAR, 0)
    other = with_pattern(scene, 34)
    assert other.markers[0].marker.board.aruco_id == 34
    assert with_pattern(other, scene.markers[0].marker.board.aruco_id) == scene
