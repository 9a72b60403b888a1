"""The link budget is the camera's own physics, counted: its events and its accuracy are those of recordings."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import Optics, PlacedMarker, Pose, Scene, Still, record, truth_at
from bicode_lab.marker import Marker, PacketFormat, encode_packet
from bicode_lab.paper import RANGES
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_studies.link_budget import budget as module
from bicode_studies.link_budget.budget import at_most, budget_of, edge_seen, link_budget, rises_of
from bicode_studies.link_budget.paper_ranges import range_m
from bicode_studies.robustness.stressors import OPTICS, stress_scene
from bicode_studies.score import Periods, score

PERIOD_US = 33_000
SETTINGS = ReceiverSettings(width=OPTICS.width, height=OPTICS.height, detect_2d=False)


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
    # Range goes as the root of the light: 20 m foretells the other four within a third.
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


def recorded(distance_m: float, seed: int, periods: int) -> tuple[Scene, np.ndarray]:
    scene = stress_scene(distance_m, seed)
    return scene, record(scene, (periods + 1) * PERIOD_US * 1e-6, np.random.default_rng([seed, 2]))


def test_events_of_an_edge_are_those_of_recordings() -> None:
    """Mean of ten recordings without noise events; within three standard errors, and a twentieth for late events."""
    distance_m, packets = 10.0, 20
    counts = []
    for seed in range(10):
        scene = stress_scene(distance_m, seed)
        scene = replace(scene, pixel_model=replace(scene.pixel_model, background_hz=0.0, hot_pixels=0))
        packet_us = scene.markers[0].marker.waveform.packet_us
        events = record(scene, (packets + 1) * packet_us * 1e-6, np.random.default_rng(seed))
        events = events[events["t"] >= packet_us]
        bits = encode_packet(scene.markers[0].marker.payload, scene.markers[0].marker.packet_format).astype(int)
        counts.append((events["p"] == 1).sum() / (packets * (np.diff(bits) > 0).sum()))
    foretold = budget_of(scene).events_on
    error = np.std(counts, ddof=1) / np.sqrt(len(counts))
    assert abs(foretold - np.mean(counts)) < 3 * error + 0.05 * foretold


@pytest.mark.slow
def test_accuracy_is_that_of_recordings() -> None:
    """Where the budget says nine of ten most recordings' periods are right, where it says one of ten most are not."""
    for share, is_right in ((0.9, True), (0.1, False)):
        distance_m = range_m(lambda d: link_budget(distance_m=d).accuracy, guess_m=20.0, share=share)
        right = []
        for seed in range(12):
            scene, events = recorded(distance_m, seed, periods=15)
            periods = Periods(start_us=PERIOD_US, count=15)
            sightings = recognise(events, SETTINGS, t0_us=0)
            right.append(score(sightings, lambda t_us, s=scene: truth_at(s, t_us), periods)["id_right"].mean())
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
def test_at_most_is_what_enumeration_gives(odds: list[float], most: int) -> None:
    total = 0.0
    for outcome in itertools.product((0, 1), repeat=len(odds)):
        if sum(outcome) <= most:
            total += np.prod([p if happens else 1 - p for p, happens in zip(odds, outcome, strict=True)])
    assert at_most(np.array(odds), most) == pytest.approx(total, abs=1e-9)


def test_a_gate_makes_an_edge_harder_to_see() -> None:
    odds = np.full((2, 30), 0.3)
    seen = [edge_seen(odds, gate) for gate in (0.0, 0.3, 0.8)]
    assert seen == sorted(seen, reverse=True)
    assert edge_seen(np.zeros((2, 30)), 0.2) == 0.0


@pytest.mark.parametrize("packet_format", [PacketFormat(), PacketFormat(payload_bits=5, checksum="crc3")])
def test_rises_are_those_of_every_packet(packet_format: PacketFormat) -> None:
    rises = rises_of(packet_format)
    assert rises.size == 2**packet_format.payload_bits
    for payload, n in enumerate(rises):
        text = "".join(map(str, encode_packet(payload, packet_format)))
        assert text.count("01") == n
        assert n <= packet_format.data_bits


@given(st.floats(0.1, 9.9))
def test_whole_packets_are_those_of_a_fine_grid_of_phases(periods: float) -> None:
    shares = module.whole_packets(periods)
    assert sum(share for _, share in shares) == pytest.approx(1.0)
    phases = (np.arange(4000) + 0.5) / 4000
    held = np.maximum(np.floor(periods - phases), 0)
    assert sum(k * share for k, share in shares) == pytest.approx(held.mean(), abs=2e-3)


def test_a_range_that_is_not_there_says_so() -> None:
    with pytest.raises(ValueError, match="another guess_m"):
        range_m(lambda distance_m: 1.0, guess_m=10.0)
