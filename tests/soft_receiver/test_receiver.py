"""The soft receiver on simulated markers, compared with the paper's receiver, and on real light without a marker."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bicode_lab.camera import PlacedMarker, Pose, Scene, Still, pan, record, truth_at
from bicode_lab.events import Events, make_events, merge, no_events
from bicode_lab.marker import Marker, PacketFormat
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_lab.recordings import open_recording
from bicode_lab.soft_receiver import SoftSettings, find_faint_regions
from bicode_studies.cli.main import main
from bicode_studies.link_budget.paper_ranges import crossing_distance_m
from bicode_studies.score import Periods, score

from .light import light_events
from .test_repeated_packets import LINE

PERIOD_US = 33_000
PAPER = ReceiverSettings(detect_2d=False)
N_SEEDS, N_PERIODS = 16, 10


@cache
def seen(distance_m: float, seed: int, n_periods: int) -> tuple[Scene, Events]:
    """Record the default marker with a random payload, phase, clock and sub-pixel position."""
    rng = np.random.default_rng(seed)
    marker = Marker(
        payload=int(rng.integers(256)),
        phase_us=float(rng.uniform(0, 14_000)),
        clock_error_ppm=float(rng.uniform(-1000, 1000)),
    )
    x, y = rng.uniform(-0.5, 0.5, 2) * distance_m / 1646.09
    scene = Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(distance_m, x_m=x, y_m=y))),))
    return scene, record(scene, n_periods * PERIOD_US * 1e-6, rng)


def id_right(sightings: Iterable[Sighting], scene: Scene, n_periods: int) -> np.ndarray:
    """Return whether the ID of each period is right."""
    scores = score(sightings, lambda t_us: truth_at(scene, t_us), Periods(start_us=0, count=n_periods))
    return scores["id_right"].to_numpy(bool)


def papers_accuracy(distance_m: float) -> float:
    """Return the share of the periods that the paper's receiver reads at a distance."""
    shares = []
    for seed in range(N_SEEDS):
        scene, events = seen(distance_m, seed, N_PERIODS)
        shares.append(id_right(recognise(events, PAPER, t0_us=0), scene, N_PERIODS).mean())
    return float(np.mean(shares))


@cache
def papers_range_m() -> float:
    """Find the distance at which the paper's receiver reads half of the periods."""
    return crossing_distance_m(papers_accuracy, guess_m=20)


def wrong(rows: list[Sighting], scene: Scene) -> int:
    """Count the sightings with an ID that is not that of the marker."""
    return sum(row.id not in (None, scene.markers[0].marker.payload) for row in rows)


def test_one_period_is_read_1_25_times_as_far_as_by_the_papers_rule() -> None:
    """There are no more wrong IDs either, though the distance is larger."""
    soft, n_wrong, n_wrong_paper = [], 0, 0
    for seed in range(N_SEEDS):
        scene, events = seen(1.25 * papers_range_m(), seed, N_PERIODS)
        settings = SoftSettings(receiver=PAPER, evidence_periods=1)
        rows = list(recognise(events, settings, t0_us=0))
        soft.append(id_right(rows, scene, N_PERIODS).mean())
        n_wrong += wrong(rows, scene)
        scene, events = seen(papers_range_m(), seed, N_PERIODS)
        n_wrong_paper += wrong(list(recognise(events, PAPER, t0_us=0)), scene)
    scatter = np.std(soft) / np.sqrt(N_SEEDS)  # at this distance the seeds differ much
    assert np.mean(soft) + 2 * scatter >= 0.5
    assert n_wrong <= n_wrong_paper + 1


def test_one_second_is_read_1_5_times_as_far_as_by_the_papers_rule() -> None:
    n, soft = 40, []
    for seed in range(10):
        scene, events = seen(1.5 * papers_range_m(), seed, n)
        rows = list(recognise(events, SoftSettings(receiver=PAPER), t0_us=0))
        soft.append(id_right(rows, scene, n)[30:].mean())
        assert wrong(rows, scene) == 0
    assert np.mean(soft) >= 0.5


@pytest.mark.parametrize("evidence_periods", [1, 30])
@pytest.mark.parametrize("distance_m", [2.5, 10.0, 16.0])
def test_near_markers_are_read_as_well(distance_m: float, evidence_periods: int) -> None:
    scene, events = seen(distance_m, 1, 5)
    rows = list(recognise(events, SoftSettings(receiver=PAPER, evidence_periods=evidence_periods), t0_us=0))
    assert id_right(rows, scene, 5).all()
    # Packets are where they were sent, up to a latency.
    marker = scene.markers[0].marker
    starts = np.array([packet.start_us for row in rows for packet in row.packets])
    sent = marker.waveform.packet_starts(0, 5 * PERIOD_US)
    assert starts.size >= 5
    assert np.abs(starts[:, None] - sent).min(axis=1).max() < 600


def test_a_moving_marker_is_followed() -> None:
    scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),), camera=pan(0.3, 5.0))
    events = record(scene, 10 * PERIOD_US * 1e-6, 0)
    assert id_right(recognise(events, SoftSettings(receiver=PAPER), t0_us=0), scene, 10).mean() >= 0.9


def test_faint_light_is_found_among_noise_and_hot_pixels() -> None:
    """A light makes an event in two of ten edges, spread over nine pixels; hot pixels make as many events."""
    rng = np.random.default_rng(0)
    light = light_events(np.tile(LINE.encode(0x25), 70), 500.0, rng, on_per_edge=0.2, off_per_edge=0.2, error_ppm=800)
    light["x"], light["y"] = 100 + rng.integers(-1, 2, light.size), 60 + rng.integers(-1, 2, light.size)
    n = 60_000
    noise = make_events(
        rng.integers(0, 320, n), rng.integers(0, 240, n), rng.integers(0, 2, n), rng.integers(0, 10**6, n)
    )
    hot = [
        make_events(np.full(300, x), np.full(300, 200), rng.integers(0, 2, 300), rng.integers(0, 10**6, 300))
        for x in range(20, 300, 40)
    ]
    boxes = find_faint_regions(merge(light, noise, *hot), 500.0, 320, 240)
    x, y, w, h = boxes[0]
    assert x <= 99 < 101 < x + w
    assert y <= 59 < 61 < y + h
    assert max(w, h) <= 9
    assert find_faint_regions(merge(noise, *hot), 500.0, 320, 240) == []
    assert find_faint_regions(no_events(), 500.0, 320, 240) == []


@pytest.mark.parametrize(
    "name", ["evk4_scene_evt3.raw", "evk3_short_evt3.raw", "sparklers_evt2.raw", "davis346.aedat4"]
)
def test_real_recordings_without_a_marker_give_no_id(real_recordings: Path, name: str) -> None:
    recording = open_recording(real_recordings / name)
    events = recording.read()
    for evidence_periods, checksum in ((1, "sum"), (30, "crc3")):
        receiver = ReceiverSettings(
            packet_format=PacketFormat(checksum=checksum),
            manchester="auto",
            width=recording.width,
            height=recording.height,
            detect_2d=False,
        )
        settings = SoftSettings(receiver=receiver, evidence_periods=evidence_periods)
        assert [row for row in recognise(events, settings) if row.id is not None] == []


def test_a_quiet_gap_costs_nothing_and_loses_nothing() -> None:
    """The evidence after a gap has a clock of its own: evidence from before the gap is not added to it."""
    scene, events = seen(10.0, 2, 4)
    later = events.copy()
    later["t"] += 5000 * PERIOD_US + 4711
    rows = list(recognise(np.concatenate([events, later]), SoftSettings(receiver=PAPER), t0_us=0))
    ids = [row.id for row in rows if row.t_us >= 5001 * PERIOD_US]
    assert ids
    assert set(ids) == {scene.markers[0].marker.payload}


def test_reading_some_periods_only_changes_nothing_in_those() -> None:
    scene, events = seen(16.0, 3, 24)
    settings = SoftSettings(receiver=PAPER)
    every = list(recognise(events, settings, t0_us=0))
    some = list(recognise(events, replace(settings, read_every=4, read_from=8), t0_us=0))
    assert some == [row for row in every if row.t_us // PERIOD_US in (11, 15, 19, 23)]
    assert {row.id for row in some} == {scene.markers[0].marker.payload}


def test_command_reads_with_the_soft_receiver(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "marker.npz"
    far = f"{1.25 * papers_range_m():.2f}"
    with pytest.raises(SystemExit):
        main(["simulate", str(out), "--distance-m", far, "--seconds", "0.4", "--seed", "3", "--payload", "0xC3"])
    found = {}
    for receiver in ("paper", "soft"):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main(["decode", str(out), "--receiver", receiver, "--packets", "--format", "csv"])
        assert ended.value.code == 0
        rows = capsys.readouterr().out.splitlines()[1:]
        found[receiver] = sum(row.split(",")[2:] == ["195", "True"] for row in rows)
    assert found["soft"] >= 10 > found["paper"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"evidence_periods": 0}, "evidence_periods"),
        ({"region_periods": -1}, "region_periods"),
        ({"read_every": 0}, "read_every"),
        ({"read_from": -1}, "read_from"),
        ({"search_every": 0}, "search_every"),
        ({"receiver": ReceiverSettings(packet_format=PacketFormat(f_id_hz=40_000), delta_t_id_us=10)}, "f_id_hz"),
    ],
)
def test_impossible_settings_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        SoftSettings(**changes)
