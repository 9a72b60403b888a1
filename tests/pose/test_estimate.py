"""The whole way from events to a pose, with lights and sensors that differ from the usual ones."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bicode_lab import Board, Marker, PlacedMarker, Pose, ReceiverSettings, Scene, Still, recognise, record
from bicode_lab.camera import Light, Optics, PixelModel
from bicode_lab.events import Events
from bicode_lab.pose import POSE_REASONS, PlatePose, PoseEstimate, PoseSettings, estimate_pose, fit_clock
from bicode_lab.pose.estimate import look_of
from bicode_lab.recognition import Sighting

FIRST_US = 165_000
BOARD = Board(aruco_id=17)
TILTED = Pose.facing(2.5, x_m=0.2, y_m=-0.1, yaw_deg=40, roll_deg=70)


def recorded(pose: Pose, board: Board = BOARD, seed: int = 0, **changes: Any) -> tuple[Events, list[Sighting]]:
    """Record a still marker; return the events and the sightings of two periods, after five that warm up."""
    marker = Marker(payload=0x25, board=board, phase_us=1234, clock_error_ppm=200)
    scene = Scene(markers=(PlacedMarker(marker=marker, path=Still(pose)),), **changes)
    events = record(scene, 0.231, seed)
    sightings = list(recognise(events, ReceiverSettings(detect_2d=False), t0_us=0))
    return events, [sighting for sighting in sightings if sighting.t_us >= FIRST_US and sighting.id is not None]


@cache
def usual() -> tuple[Events, list[Sighting]]:
    return recorded(TILTED)


def errors(found: PlatePose, true: Pose) -> tuple[float, float]:
    """Return the errors of rotation [deg] and depth [%]."""
    cosine = (np.trace(found.rotation.T @ true.rotation) - 1) / 2
    depth = found.position_m[2] / true.position_m[2] - 1
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))), 100 * abs(float(depth))


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"optics": Optics(blur_px=1.3)},
        {"optics": Optics(halo_fraction=0.06)},
        {"edge_glow": 3.0},
        {"pixel_model": PixelModel(threshold_on=0.35, threshold_off=0.3)},
        {"pixel_model": PixelModel(threshold_spread=0.05, noise=0.08)},
        {"pixel_model": PixelModel(time_constant_us=120, refractory_us=150)},
        {"light": Light(led_to_ambient=3.0)},
    ],
    ids=str,
)
def test_a_tilted_plate_in_other_lights(changes: dict[str, Any]) -> None:
    events, sightings = recorded(TILTED, **changes)
    estimate = estimate_pose(events, sightings[0], PoseSettings(board=BOARD))
    assert estimate.reason is None
    assert estimate.pose is not None
    turn_deg, depth = errors(estimate.pose, TILTED)
    assert turn_deg < 1.5
    assert depth < 1.0
    assert estimate.is_sure


def test_the_covariance_holds_the_truth() -> None:
    distances = []
    for seed in range(6):
        events, sightings = recorded(TILTED, seed=seed)
        pose = estimate_pose(events, sightings[0], PoseSettings(board=BOARD)).pose
        assert pose is not None
        between = TILTED.rotation @ pose.rotation.T
        turn = (
            np.array([between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]) / 2
        )
        off = np.concatenate([turn, TILTED.position_m - pose.position_m])
        distances.append(off @ np.linalg.solve(pose.covariance, off))
    assert max(distances) < 25
    assert 2 < np.mean(distances) < 12  # 6 for normal errors in six directions


def test_far_away_both_mirrored_poses_are_given() -> None:
    true = Pose.facing(10, yaw_deg=40, roll_deg=70)
    events, sightings = recorded(true)
    estimate = estimate_pose(events, sightings, PoseSettings(board=BOARD))
    assert len(estimate.poses) >= 2
    assert sum(pose.probability for pose in estimate.poses) == pytest.approx(1)
    assert not estimate.is_sure
    probabilities = [pose.probability for pose in estimate.poses]
    assert probabilities == sorted(probabilities, reverse=True)
    turn_deg, depth = min(errors(pose, true) for pose in estimate.poses)
    assert turn_deg < 10
    assert depth < 4


def test_the_pattern_is_found_among_many() -> None:
    events, sightings = usual()
    pose = estimate_pose(events, sightings[0], PoseSettings(aruco_ids=(3, 10, 17, 23, 2))).pose
    assert pose is not None
    assert pose.aruco_id == 17
    assert errors(pose, TILTED)[0] < 1.5


def test_corners_are_those_of_the_pattern() -> None:
    events, sightings = usual()
    settings = PoseSettings(board=BOARD)
    pose = estimate_pose(events, sightings[0], settings).pose
    assert pose is not None
    true = Optics().project(TILTED.apply(BOARD.pattern_corners_m()))
    np.testing.assert_allclose(pose.corners_px(BOARD.pattern_corners_m(), settings.camera), true, atol=0.4)
    np.testing.assert_allclose(pose.rvec(), TILTED.rvec(), atol=0.02)


def test_events_and_camera_that_are_shifted_alike_give_the_same_pose() -> None:
    events, sightings = usual()
    moved = events.copy()
    moved["x"] += 3
    there = replace(sightings[0], x=sightings[0].x + 3)
    first = estimate_pose(events, sightings[0], PoseSettings(board=BOARD)).pose
    second = estimate_pose(moved, there, PoseSettings(board=BOARD, cx=642.5)).pose
    assert first is not None
    assert second is not None
    np.testing.assert_allclose(first.rotation, second.rotation, atol=1e-9)


def test_a_white_plate() -> None:
    board = Board(aruco_id=17, glow="white", size_m=0.08)
    true = Pose.facing(2.5, yaw_deg=-35, roll_deg=10)
    events, sightings = recorded(true, board=board, light=Light(led_to_ambient=3.3))
    pose = estimate_pose(events, sightings[0], PoseSettings(board=board)).pose
    assert pose is not None
    assert errors(pose, true)[0] < 1.5


def test_a_near_plate_is_seen_with_every_second_pixel() -> None:
    true = Pose.facing(0.9, yaw_deg=30, roll_deg=200)
    events, sightings = recorded(true)
    estimate = estimate_pose(events, sightings[0], PoseSettings(board=BOARD))
    assert estimate.pose is not None
    assert estimate.lock_in is not None
    assert look_of(estimate.lock_in, 17, PoseSettings(board=BOARD)).step_px > 1
    turn_deg, depth = errors(estimate.pose, true)
    assert turn_deg < 1
    assert depth < 0.5


def test_every_reason() -> None:
    events, sightings = usual()
    settings = PoseSettings(board=BOARD)
    unread = replace(sightings[0], id=None)
    reasons = [
        estimate_pose(events, unread, settings).reason,
        estimate_pose(events[:0], sightings[0], settings).reason,
        estimate_pose(events[events["x"] == sightings[0].x + 10], sightings[0], settings).reason,
    ]
    assert reasons == ["no_id", "no_edges", "no_light"]
    assert set(reasons) < set(POSE_REASONS)
    assert not PoseEstimate(t_us=0, reason="no_fit").is_sure
    assert estimate_pose(events, [], settings).reason == "no_id"


def test_the_clock_comes_from_all_packets_of_the_track() -> None:
    _, sightings = usual()
    packets = [packet for each in sightings for packet in (*each.border_packets, *each.packets)]
    clock = fit_clock(packets, 0x25, PoseSettings().packet_format)
    assert clock is not None
    assert clock.packet_us == pytest.approx(14_000 / 1.0002, abs=4)


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="focal_px=0"):
        PoseSettings(focal_px=0)
    with pytest.raises(ValueError, match="aruco_ids has 50"):
        PoseSettings(aruco_ids=(1, 50))
    with pytest.raises(ValueError, match="width=0"):
        PoseSettings(width=0)
    np.testing.assert_array_equal(PoseSettings(cx=1.0, cy=2.0, focal_px=3.0).camera, [3, 1, 2])
