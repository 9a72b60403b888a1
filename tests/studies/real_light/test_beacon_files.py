"""Tests of the files of public beacons."""

from __future__ import annotations

from pathlib import Path

from scipy.io import savemat

from bicode_studies.real_light.beacon_files import read_beacon


def test_beacon_file_becomes_events(tmp_path: Path) -> None:
    path = tmp_path / "light.mat"
    savemat(path, {"event": [[1, -1, 1]], "event_t": [[0.5e-6, 3e-6, 2.0]]})
    events = read_beacon(path)
    assert events["t"].tolist() == [0, 3, 2_000_000]
    assert events["p"].tolist() == [1, 0, 1]
