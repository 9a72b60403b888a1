"""Tests of the mystery: it can be solved, it reveals nothing, and the notebook checks the shipped recording's IDs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bicode_lab import ReceiverSettings, open_recording, recognise
from bicode_studies.cli.main import main
from bicode_studies.own_recording.mystery import PLACES, fingerprint_ids, make_mystery_scene

ROOT = Path(__file__).resolve().parents[3]
SEED = int(
    re.findall(r"bicode simulate data/mystery.npz --mystery (\d+)", (ROOT / "data" / "README.md").read_text())[0]
)


@pytest.mark.parametrize("seed", range(20))
def test_every_seed_gives_markers_side_by_side_of_which_one_is_odd(seed: int) -> None:
    scene = make_mystery_scene(seed)
    markers = [placed.marker for placed in scene.markers]
    assert len({marker.payload for marker in markers}) == len({m.board.aruco_id for m in markers}) == len(PLACES)
    assert sorted(marker.packet_format.manchester for marker in markers) == ["ieee", "ieee", "ieee", "thomas"]
    middles = [scene.optics.project(scene.marker_pose(i, 0).position_m[None])[0] for i in range(len(markers))]
    half_px = [m.board.size_m * scene.optics.focal_px / d / 2 for m, (d, _) in zip(markers, PLACES, strict=True)]
    for middle, half in zip(middles, half_px, strict=True):
        assert (middle - half > 20).all()
        assert (middle + half < [scene.optics.width - 20, scene.optics.height - 20]).all()
    order = np.argsort([middle[0] for middle in middles])
    gaps = np.diff(np.array(middles)[order, 0]) - np.array(half_px)[order][:-1] - np.array(half_px)[order][1:]
    assert gaps.min() > 50


def test_the_shipped_one_is_solved_by_trying_both_conventions_and_not_by_one() -> None:
    recording = open_recording(ROOT / "data" / "mystery.npz")
    ids = {placed.marker.payload for placed in make_mystery_scene(SEED).markers}
    found = {}
    for manchester in ("ieee", "auto"):
        sightings = recognise(recording, ReceiverSettings(manchester=manchester), t0_us=0)  # type: ignore[arg-type]
        found[manchester] = {sighting.id for sighting in sightings} - {None}
    assert found["auto"] == ids
    assert len(found["ieee"]) == 3


def test_the_notebook_checks_against_the_shipped_ones_fingerprint() -> None:
    (notebook,) = (ROOT / "notebooks").glob("17_*.ipynb")
    ids = {placed.marker.payload for placed in make_mystery_scene(SEED).markers}
    assert fingerprint_ids(ids) in notebook.read_text(encoding="utf-8")
    for number in ids:
        assert fingerprint_ids(ids - {number}) != fingerprint_ids(ids)


def test_the_command_writes_no_truth_and_names_a_fingerprint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(tmp_path / "m.npz"), "--mystery", "5"])
    assert ended.value.code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["m.npz"]
    said = capsys.readouterr().out
    scene = make_mystery_scene(5)
    assert fingerprint_ids(placed.marker.payload for placed in scene.markers) in said
    assert not re.search(rf"\b({'|'.join(str(p.marker.payload) for p in scene.markers)})\b", said.split("s;")[1])


@pytest.mark.parametrize("out", ["m.txt", "nowhere/m.npz"])
def test_a_place_it_cannot_write_to_is_refused_in_one_line(
    out: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(tmp_path / out), "--mystery", "0"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("option", ["--seed", "--distance-m"])
def test_it_takes_no_other_option(option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(tmp_path / "m.npz"), "--mystery", "0", option, "3"])
    assert ended.value.code == 2
    assert f"--mystery decides everything by its seed; leave {option} out" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
