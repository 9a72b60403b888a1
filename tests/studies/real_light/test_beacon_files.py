"""Tests of the files of public beacons."""

from __future__ import annotations

from pathlib import Path

import pytest
from scipy.io import savemat

from bicode_studies.real_light.beacon_files import read_beacon


def test_beacon_file_becomes_events(tmp_path: Path) -> None:
    path = tmp_path / "light.mat"
    savemat(path, {"event": [[1, -1, 1]], "event_t": [[0.5e-6, 3e-6, 2.0]]})
    events = read_beacon(path)
    assert events["t"].tolist() == [0, 3, 2_000_000]
    assert events["p"].tolist() == [1, 0, 1]


def test_times_in_microseconds_are_told_from_times_in_seconds(tmp_path: Path) -> None:
    path = tmp_path / "light.mat"
    savemat(path, {"event": [[1, -1, 1]], "event_t": [[1_001_922.0, 2_000_000.0, 3_583_079.0]]})
    with pytest.raises(ValueError, match="event_t spans 30 days; it is to be in seconds"):
        read_beacon(path)
    savemat(path, {"event": [[1, -1]], "event_t": [[0.0, 86_000.0]]})
    assert read_beacon(path)["t"].tolist() == [0, 86_000_000_000]


def test_a_struct_is_no_beacon(tmp_path: Path) -> None:
    path = tmp_path / "light.mat"
    savemat(path, {"event": [[1]], "event_t": {"seconds": 1.0}})
    with pytest.raises(ValueError, match="there must be as many of both"):
        read_beacon(path)
