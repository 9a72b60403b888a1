"""Tests of poses and trajectories: laws of rigid motions, and the paper's pan and spin."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import Moving, Optics, Pose, Still, pan, spin
from bicode_lab.camera.motion import turn_about
from bicode_lab.marker import Board

angles = st.floats(-180, 180)
places = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5)).map(np.array)


@st.composite
def rigid(draw):
    rotation = np.eye(3)
    for axis in "xyz":
        rotation = rotation @ turn_about(axis, draw(angles))
    return Pose(rotation, draw(places))


POINTS = np.random.default_rng(0).normal(size=(6, 3))


@given(rigid())
def test_a_pose_is_undone_by_its_inverse(pose):
    np.testing.assert_allclose(pose.inverse().apply(pose.apply(POINTS)), POINTS, atol=1e-9)
    np.testing.assert_allclose(pose.inverse().inverse().apply(POINTS), pose.apply(POINTS), atol=1e-9)
    assert np.linalg.det(pose.rotation) == pytest.approx(1)


@given(rigid(), rigid(), rigid())
def test_poses_chain(a, b, c):
    np.testing.assert_allclose(a.after(b).apply(POINTS), b.apply(a.apply(POINTS)), atol=1e-9)
    np.testing.assert_allclose(a.after(b).after(c).apply(POINTS), a.after(b.after(c)).apply(POINTS), atol=1e-8)


@given(st.floats(-179, 179))  # half a turn either way is the same
def test_the_rotation_vector_is_axis_times_angle(angle):
    np.testing.assert_allclose(
        Pose(turn_about("z", angle)).rvec(), [0, 0, np.deg2rad(angle)], atol=2e-5
    )  # OpenCV: tiny is 0


@given(st.floats(-85, 85), st.floats(-180, 180))
def test_the_rotation_vector_of_a_facing_marker_is_its_rotation(yaw_deg, roll_deg):
    pose = Pose.facing(1.0, yaw_deg=yaw_deg, roll_deg=roll_deg)
    angle = np.linalg.norm(pose.rvec())
    x, y, z = pose.rvec() / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])  # Rodrigues' formula
    turned = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    # Facing is half a turn, where OpenCV takes the axis from a difference of numbers that nearly cancel:
    # measured up to 2e-5 rad, a thousandth of a degree.
    assert np.abs(turned - pose.rotation).max() < 5e-5


def test_a_facing_marker_is_upright_and_looks_at_the_camera():
    corners = Optics().project(Pose.facing(2.0).apply(Board().plate_corners_m()))
    top_left, top_right, bottom_right, bottom_left = corners
    assert top_left[0] < top_right[0]
    assert top_left[1] < bottom_left[1]  # rows run downwards
    assert bottom_right[0] > bottom_left[0]
    outwards = Pose.facing(2.0).rotation @ [0, 0, 1]
    np.testing.assert_allclose(outwards, [0, 0, -1])


@given(st.floats(0.5, 20), st.floats(-170, 170))
def test_roll_turns_counter_clockwise_as_the_camera_sees_it(distance_m, roll_deg):
    axis = np.array([[0, 0, 0], [0.01, 0, 0.0]])
    middle, right = Optics().project(Pose.facing(distance_m, roll_deg=roll_deg).apply(axis))
    across, up = right[0] - middle[0], middle[1] - right[1]
    assert np.rad2deg(np.arctan2(up, across)) == pytest.approx(roll_deg, abs=1e-6)


@given(st.floats(5, 85), st.sampled_from([-1, 1]))
def test_yaw_is_the_angle_between_normal_and_optical_axis(yaw_deg, sign):
    pose = Pose.facing(3.0, yaw_deg=sign * yaw_deg, roll_deg=33)
    normal = pose.rotation @ [0, 0, 1]
    assert np.rad2deg(np.arccos(-normal[2])) == pytest.approx(yaw_deg)
    assert normal[1] == pytest.approx(0)  # about the vertical axis


@given(st.floats(0, 5), st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2)), st.floats(-500, 500))
def test_a_moving_path_keeps_its_rates(t_s, velocity, rate):
    path = Moving(start=Pose.facing(4.0), velocity_m_per_s=velocity, axis="z", rate_deg_per_s=rate)
    pose = path.pose_at(t_s)
    np.testing.assert_allclose(pose.position_m, np.array([0, 0, 4.0]) + np.array(velocity) * t_s)
    turned = path.start.rotation.T @ pose.rotation
    np.testing.assert_allclose(turned, turn_about("z", rate * t_s), atol=1e-9)
    assert path.is_still == (rate == 0 and not any(velocity))


def test_a_spin_is_half_done_after_30_seconds_over_rpm():
    # IV-F: 180 degrees at 16, 32 and 64 rpm take 1.875, 0.9375 and 0.46875 s.
    for rpm, seconds in [(16, 1.875), (32, 0.9375), (64, 0.46875)]:
        path = spin(Pose.facing(1.0), rpm)
        assert seconds == 30 / rpm
        corners = Board().plate_corners_m()
        turned = path.pose_at(seconds).apply(corners)
        np.testing.assert_allclose(turned, np.roll(path.start.apply(corners), 2, axis=0), atol=1e-12)
        # A quarter of it: counter-clockwise, the top left corner goes to the bottom left.
        quarter = path.pose_at(seconds / 2).apply(corners)
        np.testing.assert_allclose(quarter[0], path.start.apply(corners)[3], atol=1e-12)


@given(st.floats(0.05, 1), st.floats(0.3, 30))
def test_a_pan_passes_a_marker_at_the_tangential_speed(speed, distance_m):
    path = pan(speed, distance_m)
    optics, step_s = Optics(), 1e-4
    x = []
    for t in (-step_s, step_s):
        seen = Pose.facing(distance_m).after(path.pose_at(t).inverse())
        x.append(optics.project(seen.position_m[None])[0, 0])
    # In the middle of the image: v / d radians a second times f pixels a radian, to the left.
    assert (x[1] - x[0]) / (2 * step_s) == pytest.approx(-speed / distance_m * optics.focal_px, rel=1e-4)


def test_a_pan_starts_to_the_right():
    looks = pan(0.1, 1.0, start_deg=20).pose_at(0).rotation @ [0, 0, 1]
    np.testing.assert_allclose(looks, [np.sin(np.deg2rad(20)), 0, np.cos(np.deg2rad(20))], atol=1e-12)


def test_still_is_still():
    path = Still(Pose.facing(2))
    assert path.is_still
    assert path.pose_at(1e6) is path.pose


def test_wrong_settings_are_refused():
    with pytest.raises(ValueError, match=r"distance_m=0 is not in front of the camera; choose more than 0"):
        Pose.facing(0)
    with pytest.raises(ValueError, match=r"axis='w' is not known; choose 'x', 'y' or 'z'"):
        Moving(axis="w")


def test_a_pan_at_no_distance_is_refused():
    with pytest.raises(ValueError, match="distance_m=0"):
        pan(1.0, 0.0)
