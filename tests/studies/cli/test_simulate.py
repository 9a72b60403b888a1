"""Tests of ``bicode simulate``: what each option changes in the events and in the ground truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bicode_lab.events import Events, make_events
from bicode_lab.recordings import open_recording, write_npz
from bicode_studies.cli.main import main

DISTANCE_M, FOCAL_PX, PACKET_US = 4.0, 1646.09, 14_000

Simulate = Callable[..., tuple[Events, dict[str, Any]]]


@pytest.fixture
def simulate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Simulate:
    """Return a function that simulates with some options, and returns the events and the ground truth."""

    def run(*options: str) -> tuple[Events, dict[str, Any]]:
        out = tmp_path / "marker.npz"
        with pytest.raises(SystemExit) as ended:
            main(["simulate", str(out), "--distance-m", str(DISTANCE_M), "--seconds", "0.04", "--force", *options])
        assert ended.value.code == 0, capsys.readouterr().err
        return open_recording(out).read(), json.loads(out.with_suffix(".npz.truth.json").read_text(encoding="utf-8"))

    return run


def middle_px(events: Events) -> np.ndarray[Any, Any]:
    """Return the median column and row of the events [px]."""
    return np.array([np.median(events["x"]), np.median(events["y"])])


def corners_px(truth: dict[str, Any]) -> np.ndarray[Any, Any]:
    """Return the corners of the pattern in each sample, shape (samples, 4, 2)."""
    return np.array([sample["corners_px"] for sample in truth["markers"][0]["samples"]])


def test_x_and_y_move_the_marker_right_and_down(simulate: Simulate) -> None:
    here, _ = simulate()
    there, truth = simulate("--x-m", "0.5", "--y-m", "0.25")
    right_px = FOCAL_PX * 0.5 / DISTANCE_M
    assert middle_px(there) - middle_px(here) == pytest.approx([right_px, right_px / 2], abs=2)
    assert truth["markers"][0]["samples"][0]["tvec"] == pytest.approx([0.5, 0.25, DISTANCE_M])


def test_yaw_makes_the_marker_narrower(simulate: Simulate) -> None:
    (facing, turned) = (corners_px(simulate("--yaw-deg", yaw_deg)[1]) for yaw_deg in ("0", "60"))
    assert np.ptp(turned[..., 0]) == pytest.approx(np.ptp(facing[..., 0]) * np.cos(np.radians(60)), rel=0.03)
    assert np.ptp(turned[..., 1]) == pytest.approx(np.ptp(facing[..., 1]), rel=0.03)


def test_rpm_spins_the_marker(simulate: Simulate) -> None:
    _, truth = simulate("--rpm", "300")
    times_us = np.array([sample["t_us"] for sample in truth["markers"][0]["samples"]])
    top = corners_px(truth)[:, 1] - corners_px(truth)[:, 0]
    turned_deg = np.degrees(np.unwrap(np.arctan2(top[:, 1], top[:, 0])))
    assert times_us.size > 3
    assert abs(np.polyfit(times_us * 1e-6, turned_deg, 1)[0]) == pytest.approx(300 / 60 * 360, rel=0.01)


def test_more_ambient_light_leaves_fewer_events(simulate: Simulate) -> None:
    dim, bright = (simulate("--lux", lux)[0].size for lux in ("350", "20000"))
    assert bright < 0.7 * dim


def test_a_slow_clock_makes_longer_packets(simulate: Simulate) -> None:
    _, truth = simulate("--clock-error-ppm", "-20000")
    assert truth["markers"][0]["packet_us"] == pytest.approx(PACKET_US / 0.98)
    assert np.diff(truth["markers"][0]["packet_starts_us"]) == pytest.approx(PACKET_US / 0.98, abs=0.01)


def test_the_marker_is_added_to_a_background(simulate: Simulate, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    n = 2000
    x, y, t_us = rng.integers(0, 40, n), rng.integers(0, 30, n), np.sort(rng.integers(0, 50_000, n)) + 7_000_000
    write_npz(tmp_path / "background.npz", make_events(x, y, rng.integers(0, 2, n), t_us), 320, 240)
    events, truth = simulate("--background", str(tmp_path / "background.npz"))
    recording = open_recording(tmp_path / "marker.npz")
    in_corner = (events["x"] < 40) & (events["y"] < 30)
    marker = middle_px(events[~in_corner])
    assert (recording.width, recording.height) == (320, 240)
    assert np.count_nonzero(in_corner) == n
    assert marker == pytest.approx([160, 120], abs=2)
    assert truth["t0_us"] == t_us[0]
    assert truth["duration_us"] == pytest.approx(50_000, abs=200)  # that of the background: --seconds is not used
