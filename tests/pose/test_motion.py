"""The motion of a plate in the image, and poses of plates that move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab import Board, Marker, PlacedMarker, Pose, ReceiverSettings, Scene, pan, recognise, record, spin
from bicode_lab.boxes import Box
from bicode_lab.camera import Moving, Trajectory, truth_at
from bicode_lab.pose import LedClock, PoseSettings, estimate_pose
from bicode_lab.pose.motion import ImageMotion, find_motion
from bicode_lab.pose.moving import moving_lock_in

BOARD = Board(aruco_id=17)


def flashes(
    velocity: tuple[float, float], rate: float, rng: np.random.Generator, far_off: int = 0
) -> tuple[np.ndarray, ...]:
    """Return x, y, t, number of the edge of events of an L-shaped plate that flashes 20 times while it moves."""
    shape = rng.uniform(-12, 12, (4000, 2))
    shape = shape[(shape[:, 0] < -4) | (shape[:, 1] < 0)]
    rows = []
    for number in range(20):
        t = number * 1600.0 + rng.exponential(50, 150)
        dt = (t - 16_000) * 1e-6
        u = shape[rng.integers(0, len(shape), 150)]
        c, s = np.cos(rate * dt), np.sin(rate * dt)
        x = 300 + velocity[0] * dt + c * u[:, 0] - s * u[:, 1]
        y = 200 + velocity[1] * dt + s * u[:, 0] + c * u[:, 1]
        x[:far_off], y[:far_off] = rng.uniform(0, 640, far_off), rng.uniform(0, 480, far_off)
        rows.append(np.stack([np.rint(x), np.rint(y), t, np.full(150, number)]))
    x, y, t, edge = np.concatenate(rows, 1)
    return x, y, t, edge.astype(np.int64)


def farthest_px(motion: ImageMotion, velocity: tuple[float, float], rate: float) -> float:
    """Return how far a point of the plate is from its place at the middle of the time, taken back from either end [px].

    Velocity and pivot are not compared: a pivot beside the true one and another velocity are the same motion.
    """
    corners = np.array([(-12.0, -12), (12, -12), (12, 12), (-12, 12)])
    worst = 0.0
    for t in (0.0, 8000.0, 32_000.0):
        dt = (t - 16_000) * 1e-6
        c, s = np.cos(rate * dt), np.sin(rate * dt)
        x = 300 + velocity[0] * dt + corners @ [c, -s]
        y = 200 + velocity[1] * dt + corners @ [s, c]
        u, v = motion.taken_back(x, y, np.full(4, t))
        worst = max(worst, float(np.hypot(u - 300 - corners[:, 0], v - 200 - corners[:, 1]).max()))
    return worst


@pytest.mark.parametrize("velocity", [(0, 0), (700, -300), (-2500, 900)])
@pytest.mark.parametrize("rate", [0, 7, -63, 300])
def test_velocity_and_rate_are_found(velocity: tuple[float, float], rate: float) -> None:
    events = flashes(velocity, rate, np.random.default_rng(1))
    motion = find_motion(*events, 16_000)
    assert motion is not None
    assert motion.rate == pytest.approx(rate, abs=3)
    assert farthest_px(motion, velocity, rate) < 1.5


def test_a_few_events_far_off_do_not_count() -> None:
    motion = find_motion(*flashes((700, -300), 20, np.random.default_rng(2), far_off=20), 16_000)
    assert motion is not None
    assert motion.rate == pytest.approx(20, abs=3)
    assert farthest_px(motion, (700, -300), 20) < 1.5


def test_points_are_taken_back_along_their_path() -> None:
    motion = ImageMotion(t_us=1000.0, pivot_px=np.array([10.0, 20]), velocity=np.array([100.0, 0]), rate=np.pi * 50)
    x, y = motion.taken_back(np.array([12.0]), np.array([20.0]), np.array([1000.0]))
    assert (x[0], y[0]) == pytest.approx((12, 20))
    # After 10 ms the plate moved by 1 px and turned by a quarter: what was to the right is below.
    x, y = motion.taken_back(np.array([11.0]), np.array([22.0]), np.array([11_000.0]))
    assert (x[0], y[0]) == pytest.approx((12, 20))


def test_too_few_edges_have_no_motion() -> None:
    x, y, t, edge = flashes((0, 0), 0, np.random.default_rng(3))
    few = edge < 3
    assert find_motion(x[few], y[few], t[few], edge[few], 16_000) is None
    clock = LedClock(start_us=0, packet_us=14_000, chips=(0, 0, 1, 0))
    nothing = record(Scene(markers=()), 0.01, 0)[:0]
    assert moving_lock_in(nothing, clock, Box(0, 0, 9, 9), 0, 9000) is None


@pytest.mark.parametrize(
    ("path", "camera", "turn_deg"),
    [
        (Moving(start=Pose.facing(2.5, x_m=-0.1, yaw_deg=40, roll_deg=10), velocity_m_per_s=(1.0, 0.5, 0)), None, 2.0),
        (Moving(start=Pose.facing(1.0, x_m=-0.1, yaw_deg=-35, roll_deg=80), velocity_m_per_s=(1.5, 0, 0)), None, 2.0),
        (Moving(start=Pose.facing(2.5, yaw_deg=40)), pan(1.0, 2.5, start_deg=-2), 2.0),
        (spin(Pose.facing(2.5), 600), None, 9.0),
        (spin(Pose.facing(1.0, yaw_deg=35), 64), None, 3.0),
    ],
    ids=["passing", "passing near", "panned", "spinning", "spinning near"],
)
def test_poses_of_moving_plates(path: Trajectory, camera: Trajectory | None, turn_deg: float) -> None:
    marker = Marker(payload=0x25, board=BOARD, phase_us=1234)
    scene = Scene(markers=(PlacedMarker(marker=marker, path=path),))
    scene = scene if camera is None else replace(scene, camera=camera)
    events = record(scene, 0.132, 0)
    sightings = [each for each in recognise(events, ReceiverSettings(detect_2d=False), t0_us=0) if each.id == 0x25]
    estimate = estimate_pose(events, sightings[-1], PoseSettings(board=BOARD), moving=True)
    assert estimate.pose is not None
    assert estimate.lock_in is not None
    truth = truth_at(scene, estimate.t_us)[0].pose
    cosine = (np.trace(estimate.pose.rotation.T @ truth.rotation) - 1) / 2
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))) < turn_deg
    assert estimate.pose.position_m[2] == pytest.approx(truth.position_m[2], rel=0.015)
    if camera is not None or not path.is_still:
        assert estimate.pose.covariance[3, 3] > 0


def test_fast_plates_are_in_doubt_along_their_way() -> None:
    path = Moving(start=Pose.facing(2.5, x_m=-0.1, yaw_deg=40), velocity_m_per_s=(1.0, 0, 0))
    scene = Scene(markers=(PlacedMarker(marker=Marker(payload=0x25, board=BOARD), path=path),))
    events = record(scene, 0.1, 0)
    sighting = [each for each in recognise(events, ReceiverSettings(detect_2d=False), t0_us=0) if each.id == 0x25][-1]
    image = estimate_pose(events, sighting, PoseSettings(board=BOARD), moving=True).lock_in
    assert image is not None
    assert image.doubt_px[0] == pytest.approx(60e-6 * 1646 / 2.5, rel=0.05)
    assert image.doubt_px[1] < 0.1 * image.doubt_px[0]
