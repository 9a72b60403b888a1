"""Tests of the link budget: its events and its accuracy agree with those of recordings."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.marker import Marker, encode_packet
from bicode_lab.paper import RANGES
from bicode_studies.link_budget.budget import at_most, budget_of, edge_detected, link_budget
from bicode_studies.link_budget.paper_ranges import crossing_distance_m
from bicode_studies.paper_experiments.scenes import WINDOW_RECEIVER, window_scene
from bicode_studies.trial import run


def test_pixels_are_geometry() -> None:
    facing = link_budget(distance_m=5.0)
    assert facing.side_px == pytest.approx(0.05 * 8e3 / 4.86 / 5.0)
    assert facing.area_px == pytest.approx(facing.side_px**2, rel=0.01)
    turned = link_budget(distance_m=5.0, yaw_deg=80.0)
    share = np.cos(np.deg2rad(80)) + 0.1 * np.sin(np.deg2rad(80))  # the 5 mm edge of a 50 mm plate is seen, too
    assert turned.area_px / turned.side_px**2 == pytest.approx(share, rel=0.02)


def test_the_papers_ranges_lie_near_one_line() -> None:
    light = [
        link_budget(current_ma=r.current_ma, size_m=r.size_m, yaw_deg=r.yaw_deg, distance_m=r.distance_m).light
        for r in RANGES
    ]
    # Range goes as the root of the light: 20 m predicts the other four within a third.
    assert np.sqrt(np.array(light) / light[0]) == pytest.approx(1.0, abs=0.35)


def test_four_times_the_current_is_as_light_at_twice_the_distance() -> None:
    assert link_budget(current_ma=10.0, distance_m=15.0).light == pytest.approx(
        link_budget(current_ma=40.0, distance_m=30.0).light, rel=0.01
    )


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        ({"distance_m": 10.0}, {"distance_m": 20.0}),
        ({"current_ma": 20.0}, {"current_ma": 10.0}),
        ({"illuminance_lux": 350.0}, {"illuminance_lux": 2000.0}),
        ({"yaw_deg": 0.0}, {"yaw_deg": 80.0}),
        ({"optics": Optics(blur_px=1.0)}, {"optics": Optics(blur_px=2.0)}),
    ],
    ids=lambda value: next(iter(value)),
)
def test_contrast_and_events_order_as_they_must(better: dict[str, float], worse: dict[str, float]) -> None:
    a, b = link_budget(**{"distance_m": 15.0, **better}), link_budget(**{"distance_m": 15.0, **worse})
    assert a.contrast > b.contrast
    assert a.events_on > b.events_on
    assert a.accuracy >= b.accuracy


def test_red_behind_the_infrared_filter_and_no_current_give_nothing() -> None:
    for dark in (link_budget(optics=Optics(infrared_filter=True)), link_budget(current_ma=0.0)):
        assert (dark.contrast, dark.events_on, dark.accuracy) == (0, 0, 0)
    assert link_budget(distance_m=2.5, optics=Optics(infrared_filter=True, f_number=2.0), band="infrared").accuracy > 0


def test_contrast_of_a_near_plate_is_led_over_ambient() -> None:
    scene = Scene()
    near = budget_of(replace(scene, markers=(PlacedMarker(path=Still(Pose.facing(0.5))),)))
    whole = np.log1p(scene.light.led_to_ambient / scene.light.plate_reflectance)
    assert 0.85 * whole < near.contrast <= whole + 1e-6  # the halo takes its share; images are of float32


def test_events_of_an_edge_are_those_of_recordings() -> None:
    """The mean of ten recordings without noise events agrees within three standard errors and 5 % for late events."""
    distance_m, packets = 10.0, 20
    counts = []
    for seed in range(10):
        scene = window_scene(distance_m, seed)
        scene = replace(scene, pixel_model=replace(scene.pixel_model, background_hz=0.0, hot_pixels=0))
        packet_us = scene.markers[0].marker.waveform.packet_us
        events = record(scene, (packets + 1) * packet_us * 1e-6, np.random.default_rng(seed))
        events = events[events["t"] >= packet_us]
        bits = encode_packet(scene.markers[0].marker.payload, scene.markers[0].marker.packet_format).astype(int)
        counts.append((events["p"] == 1).sum() / (packets * (np.diff(bits) > 0).sum()))
    expected = budget_of(scene).events_on
    error = np.std(counts, ddof=1) / np.sqrt(len(counts))
    assert abs(expected - np.mean(counts)) < 3 * error + 0.05 * expected


@pytest.mark.slow
def test_accuracy_is_that_of_recordings() -> None:
    """Where the budget expects 90 % of periods to be right, most recorded ones are; where it expects 10 %, few are."""
    for share, is_right in ((0.9, True), (0.1, False)):
        distance_m = crossing_distance_m(lambda d: link_budget(distance_m=d).accuracy, guess_m=20.0, level=share)
        trials = [
            run(window_scene(distance_m, seed), {"paper": WINDOW_RECEIVER}, periods=15, seed=seed, warm_up=1)
            for seed in range(12)
        ]
        right = [row.id_right / row.periods for trial in trials for row in trial.itertuples()]
        assert (np.mean(right) > 0.5) == is_right


def test_the_same_seed_gives_the_same_budget_and_another_one_nearly() -> None:
    one, again, other = (link_budget(distance_m=15.0, seed=seed) for seed in (0, 0, 1))
    assert one == again
    assert other.events_on == pytest.approx(one.events_on, rel=0.1)
    assert other.events_on != one.events_on


def test_what_is_not_in_view_says_so() -> None:
    with pytest.raises(ValueError, match="not in view"):
        budget_of(Scene(markers=(PlacedMarker(marker=Marker(), path=Still(Pose.facing(2.5, x_m=5.0))),)))


@given(st.lists(st.floats(0.0, 1.0), max_size=6), st.integers(0, 6))
def test_at_most_is_what_enumeration_gives(probabilities: list[float], most: int) -> None:
    total = 0.0
    for outcome in itertools.product((0, 1), repeat=len(probabilities)):
        if sum(outcome) <= most:
            total += np.prod([p if happens else 1 - p for p, happens in zip(probabilities, outcome, strict=True)])
    assert at_most(np.array(probabilities), most) == pytest.approx(total, abs=1e-9)


def test_a_gate_makes_an_edge_harder_to_detect() -> None:
    fires = np.full((2, 30), 0.3)
    detected = [edge_detected(fires, gate) for gate in (0.0, 0.3, 0.8)]
    assert detected == sorted(detected, reverse=True)
    assert edge_detected(np.zeros((2, 30)), 0.2) == 0.0
