"""Tests of the ground truth against another way of projecting."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import (
    Moving,
    Optics,
    PixelModel,
    PlacedMarker,
    Pose,
    Scene,
    Still,
    packet_starts_us,
    pan,
    record,
    spin,
    truth_at,
    truth_table,
)
from bicode_lab.camera.plate_image import reach_px
from bicode_lab.marker import Board, Marker

OPTICS = Optics()
poses = st.builds(
    Pose.facing,
    st.floats(0.4, 30),
    x_m=st.floats(-0.2, 0.2),
    y_m=st.floats(-0.1, 0.1),
    yaw_deg=st.floats(-85, 85),
    roll_deg=st.floats(-170, 170),
)


# Near half a turn, which "facing" is, OpenCV's rotation vector is up to 2e-5 rad wrong: 0.01 px at 250 px.
CLOSE_PX = 0.02


def projected(points_m, pose):
    """Project by OpenCV's rotation vector and translation."""
    image = cv2.projectPoints(points_m, pose.rvec(), pose.position_m, OPTICS.matrix, None)[0]
    return image.reshape(-1, 2)


@given(poses, st.sampled_from(["black", "white"]), st.floats(0.02, 0.12))
def test_corners_and_box_are_opencvs_projection(pose, glow, size_m):
    board = Board(size_m=size_m, glow=glow)
    truth = truth_at(Scene(markers=(PlacedMarker(marker=Marker(board=board), path=Still(pose)),)), 0)[0]
    half = size_m / 2
    inner = half * (1 if glow == "black" else 6 / 8)
    pattern = np.array([[-inner, inner, 0], [inner, inner, 0], [inner, -inner, 0], [-inner, -inner, 0]])
    np.testing.assert_allclose(truth.corners_px, projected(pattern, pose), atol=CLOSE_PX)
    block = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (0, -0.005)])
    image = projected(block, pose)
    x, y, w, h = truth.box_px
    np.testing.assert_allclose([x, y, x + w, y + h], [*image.min(0), *image.max(0)], atol=CLOSE_PX)
    spare = min(image.min(), *([1279, 719] - image.max(0)))
    assert truth.in_view == (spare >= 0) or abs(spare) < CLOSE_PX


def test_opencvs_pose_from_the_true_corners_is_the_true_pose():
    pose = Pose.facing(1.5, x_m=0.1, yaw_deg=30, roll_deg=20)
    truth = truth_at(Scene(markers=(PlacedMarker(path=Still(pose)),)), 0)[0]
    _, rvec, tvec = cv2.solvePnP(
        Board().pattern_corners_m(), truth.corners_px, OPTICS.matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    np.testing.assert_allclose(tvec.ravel(), pose.position_m, atol=1e-5)
    np.testing.assert_allclose(rvec.ravel(), pose.rvec(), atol=1e-4)


@pytest.mark.parametrize("distance_m", [1.0, 5.0])
def test_events_lie_in_the_true_box_and_what_its_light_reaches(distance_m):
    model = PixelModel(background_hz=0.0, hot_pixels=0)
    scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(distance_m, x_m=0.03, yaw_deg=20))),), pixel_model=model)
    x, y, w, h = truth_at(scene, 0)[0].box_px
    events = record(scene, 0.02, 0)
    reach = reach_px(OPTICS) + 1
    # The box has the side face in it, which is dark this far off its normal.
    side = Board().thickness_m * np.sin(np.deg2rad(20)) * OPTICS.focal_px / distance_m
    assert x - reach <= events["x"].min() <= x + side + 2
    assert x + w - side - 2 <= events["x"].max() <= x + w + reach
    assert y - reach <= events["y"].min() <= y + 2
    assert y + h - 2 <= events["y"].max() <= y + h + reach


def test_the_truth_moves_with_marker_and_camera():
    spun = Scene(markers=(PlacedMarker(path=spin(Pose.facing(2.0), 60)),))
    # 60 rpm: a quarter turn in 0.25 s, counter-clockwise: the top left corner comes to the bottom left.
    start, quarter = truth_at(spun, 0)[0], truth_at(spun, 250_000)[0]
    np.testing.assert_allclose(quarter.corners_px[0], start.corners_px[3], atol=1e-6)
    panned = Scene(markers=(PlacedMarker(),), camera=pan(0.25, 2.5))
    later = truth_at(panned, 1_000_000)[0]
    # 0.1 rad: the middle of the face at f tan 0.1 to the left.
    assert later.corners_px.mean(0)[0] == pytest.approx(639.5 - OPTICS.focal_px * np.tan(0.1), abs=0.5)
    # On a recording's own clock.
    np.testing.assert_array_equal(truth_at(spun, 9_250_000, 9_000_000)[0].corners_px, quarter.corners_px)


def test_behind_the_camera_there_is_no_box():
    away = Scene(markers=(PlacedMarker(path=Still(Pose(Pose.facing(1).rotation, np.array([0, 0, -1.0])))),))
    truth = truth_at(away, 0)[0]
    assert np.isnan(truth.corners_px).all()
    assert np.isnan(truth.box_px).all()
    assert not truth.in_view


@given(st.floats(-1e5, 1e5), st.floats(-1000, 1000), st.integers(1, 200_000), st.integers(0, 10**9))
def test_packets_begin_where_the_led_goes_quiet(phase_us, ppm, duration_us, clock_us):
    marker = Marker(payload=0xFF, phase_us=phase_us, clock_error_ppm=ppm)
    scene = Scene(markers=(PlacedMarker(marker=marker),))
    starts = packet_starts_us(scene, 0, duration_us, clock_us) - clock_us
    assert ((starts >= -1e-6) & (starts < duration_us + 1e-6)).all()
    assert abs(starts.size - duration_us / marker.waveform.packet_us) <= 1
    # 0xFF (IEEE, sum 0): the last chip of a packet is OFF, the first 3 ms are, and after 3.5 ms it is ON.
    wave = marker.waveform
    assert not wave.state(np.add.outer(starts, [1.0, 1500.0, 2990.0])).any()
    assert wave.state(starts + 7.25 * wave.chip_us).all()


def test_the_table_is_plain_json_and_says_the_same():
    path = Moving(start=Pose.facing(2.0), velocity_m_per_s=(0.0, 0.0, 1.0))
    gone = PlacedMarker(path=Still(Pose(Pose.facing(1).rotation, np.array([0, 0, -1.0]))))
    moving = Scene(markers=(PlacedMarker(marker=Marker(payload=0xA5), path=path), gone))
    table = json.loads(json.dumps(truth_table(moving, 10_000, 500_000), allow_nan=False))
    assert (table["t0_us"], table["duration_us"], len(table["markers"])) == (500_000, 10_000, 2)
    first, second = table["markers"]
    assert (first["id"], first["aruco_id"], first["size_m"]) == (0xA5, 7, 0.05)
    assert [s["t_us"] for s in first["samples"]] == [500_000 + 1000 * k for k in range(10)]
    for sample in first["samples"]:
        truth = truth_at(moving, sample["t_us"], 500_000)[0]
        np.testing.assert_allclose(sample["box_px"], truth.box_px, atol=6e-4)
        np.testing.assert_allclose(sample["corners_px"], truth.corners_px, atol=6e-4)
        np.testing.assert_allclose(sample["tvec"], truth.pose.position_m, atol=6e-7)
        np.testing.assert_allclose(cv2.Rodrigues(np.array(sample["rvec"]))[0], truth.pose.rotation, atol=2e-6)
    assert second["samples"][0]["box_px"] == [None] * 4
    assert second["samples"][0]["in_view"] is False
    still = replace(moving, markers=(PlacedMarker(),))
    assert len(truth_table(still, 1_000_000)["markers"][0]["samples"]) == 1
    assert len(truth_table(still, 1_000_000)["markers"][0]["packet_starts_us"]) == 72  # 0, 14, .. 994 ms
