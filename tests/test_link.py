"""Tests of the whole link from marker over camera to receiver, scored period by period."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bicode_lab.camera import PlacedMarker, Pose, Recorder, Scene, Still, stream_over, truth_at
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.recordings import open_recording
from bicode_studies.cli.main import main
from bicode_studies.score import Periods, score

PERIOD_US = 33_000
FOCAL_PX = 1646.09


def some_scene(distance_m: float, rng: np.random.Generator) -> Scene:
    """Return the default marker with a payload, a phase and a sub-pixel place of its own."""
    marker = Marker(payload=int(rng.integers(256)), phase_us=float(rng.uniform(0, 14_000)))
    x, y = rng.uniform(-0.5, 0.5, 2) * distance_m / FOCAL_PX
    return Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(distance_m, x_m=x, y_m=y))),))


def judged(scene: Scene, n_periods: int, rng: np.random.Generator) -> pd.DataFrame:
    """Record, decode and score a scene; the receiver sees nothing but the events."""
    chunks = Recorder(scene, n_periods * PERIOD_US * 1e-6, rng)
    sightings = recognise(chunks, ReceiverSettings(), t0_us=0)
    return score(sightings, lambda t_us: truth_at(scene, t_us), Periods(start_us=0, count=n_periods))


@pytest.mark.parametrize(("distance_m", "n_periods"), [(0.5, 5), (1, 10), (2.5, 20), (5, 30), (7.5, 30), (10, 30)])
def test_default_scene_is_read_in_every_period(distance_m: float, n_periods: int) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        scores = judged(some_scene(distance_m, rng), n_periods, rng)
        assert len(scores) == n_periods
        assert scores["id_right"].all()


def test_marker_2d_is_right_in_95_percent_of_periods_at_1_m() -> None:
    scores = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        scores.append(judged(some_scene(1.0, rng), 10, rng))
    assert pd.concat(scores)["marker_2d_right"].mean() >= 0.95


def five_markers(rng: np.random.Generator) -> Scene:
    """Return a scene of five markers with IDs, patterns, phases and clocks of their own, 1 .. 8 m away."""
    payloads = rng.choice(256, 5, replace=False)
    places = [(1, -0.25, 0.1), (2, -0.2, -0.2), (3.5, 0.3, 0.25), (5, 0.9, -0.6), (8, -1.6, 0.8)]
    markers = []
    for number, (payload, (distance, x, y)) in enumerate(zip(payloads, places, strict=True)):
        marker = Marker(
            payload=int(payload),
            board=Board(aruco_id=number),
            phase_us=float(rng.uniform(0, 14_000)),
            clock_error_ppm=float(rng.uniform(-400, 400)),
        )
        markers.append(PlacedMarker(marker=marker, path=Still(Pose.facing(distance, x_m=x, y_m=y))))
    return Scene(markers=tuple(markers))


def test_five_markers_are_read_and_never_swapped() -> None:
    rng = np.random.default_rng(1)
    scores = judged(five_markers(rng), 20, rng)
    assert scores.groupby("marker")["id_right"].mean().min() >= 0.95
    wrong = [ids for ids, payload in zip(scores["ids"], scores["payload"], strict=True) if set(ids) - {payload}]
    assert wrong == []


def test_marker_in_a_real_scene_is_read(real_recordings: Path) -> None:
    recording = open_recording(real_recordings / "evk4_scene_evt3.raw")
    rng = np.random.default_rng(0)
    scene = some_scene(2.5, rng)
    start_us, end_us = 11_200_224, 21_968_221
    count = (end_us - start_us) // PERIOD_US
    sightings = recognise(stream_over(recording.chunks(), scene, rng), ReceiverSettings(detect_2d=False))
    scores = score(sightings, lambda t: truth_at(scene, t, start_us), Periods(start_us=start_us, count=count))
    assert len(scores) == count == 326
    assert scores["id_right"].mean() >= 0.95


NO_MARKER = ["evk4_scene_evt3.raw", "evk3_short_evt3.raw", "sparklers_evt2.raw", "davis346.aedat4"]


@pytest.mark.parametrize("name", NO_MARKER)
def test_real_recordings_without_a_marker_give_no_id(real_recordings: Path, name: str) -> None:
    recording = open_recording(real_recordings / name)
    events = recording.read()
    for checksum, convention in itertools.product(("sum", "crc3"), ("ieee", "thomas", "auto")):
        settings = ReceiverSettings(
            packet_format=PacketFormat(checksum=checksum),
            manchester=convention,
            width=recording.width,
            height=recording.height,
            detect_2d=False,
        )
        found = [s for s in recognise(events, settings) if s.id is not None]
        assert found == []


def test_commands_simulate_and_decode(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "marker.npz"
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(out), "--payload", "0xC3", "--distance-m", "5", "--seconds", "0.5", "--seed", "3"])
    assert ended.value.code == 0
    truth = json.loads(out.with_suffix(".npz.truth.json").read_text())
    assert truth["markers"][0]["id"] == 0xC3
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(["decode", str(out), "--format", "jsonl"])
    assert ended.value.code == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    first_us = int(open_recording(out).read()["t"][0])
    assert [row["t_us"] for row in rows] == [first_us + k * PERIOD_US for k in range(len(rows))]
    # The last period of half a second is 5 ms long and holds no packet.
    assert [row["id"] for row in rows[:15]] == [0xC3] * 15
    assert {row["reason"] for row in rows[:15]} == {None}


def test_packets_are_those_of_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "marker.npz"
    with pytest.raises(SystemExit):
        main(["simulate", str(out), "--distance-m", "2.5", "--seconds", "0.4", "--seed", "4"])
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["decode", str(out), "--packets", "--format", "jsonl"])
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    starts = np.array(json.loads(out.with_suffix(".npz.truth.json").read_text())["markers"][0]["packet_starts_us"])
    events = open_recording(out).read()
    # A packet can be read where its off time is seen to begin and its last edge is in the recording.
    whole = starts[(starts > events["t"][0]) & (starts + 14_000 < events["t"][-1])]
    times = np.array([row["t_us"] for row in rows])
    assert all(row["checksum_ok"] and row["id"] == 0x25 for row in rows)
    assert len(np.unique(times)) == times.size
    # Edges are known to a bin of 250 us, and the pixels answer within 200 us.
    for start in whole[1:-1]:
        assert np.abs(times - start).min() <= 250 + 200


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["decode", "nowhere.raw"], "nowhere.raw"),
        (["decode", "{file}", "--delta-t-id-us", "600"], "500"),
        (["decode", "{file}", "--manchester", "auto", "--payload-bits", "7"], "auto"),
        (["decode", "{file}", "--formt", "csv"], "--format"),
        (["simulate", "out.mp4"], ".npz"),
        (["simulate", "{out}", "--payload", "300"], "payload"),
        (["simulate", "{out}", "--distance-m", "-1"], "distance_m"),
        (["simulate", "{out}", "--payload", "abc"], "abc"),
        (["simulate", "{out}", "--current-ma", "inf"], "'inf' is not a number; write for example 2.5"),
        (["simulate", "{out}", "--x-m", "nan"], "'nan' is not a number; write for example 2.5"),
        (["decode", "{file}", "--f-id-hz", "300", "--receiver", "paper"], "choose --f-id-hz 425 or more"),
        (["decode", "{file}", "--f-id-hz", "200", "--packets", "--receiver", "paper"], "choose --f-id-hz 213 or more"),
        (["decode", "{file}", "--rate-hz", "504"], "--line-code uart"),
        (["decode", "{file}", "--line-code", "uart", "--rate-hz", "504", "--packets"], "leave it out"),
    ],
)
def test_misuse_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    file, out = tmp_path / "marker.npz", tmp_path / "out.npz"
    with pytest.raises(SystemExit):
        main(["simulate", str(file), "--distance-m", "10", "--seconds", "0.05"])
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main([a.format(file=file, out=out) for a in arguments])
    captured = capsys.readouterr()
    assert ended.value.code == 2
    assert captured.err.count("\n") == 1
    assert words in captured.err
    assert "Traceback" not in captured.err
