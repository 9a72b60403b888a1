"""Tests of the light path: OpenCV projects the same points, and the paper's sizes and ratios come out."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.camera import Light, Optics, Pose
from bicode_lab.camera.optics import IR88_TRANSMITTANCE, ambient_signal, led_signal, plate_homography

positive = st.floats(0.01, 100)
lights = st.builds(
    Light,
    illuminance_lux=st.floats(1, 1e5),
    reflectance=positive,
    led_to_ambient=st.floats(0, 10),
    infrared_led_to_ambient=st.floats(0, 10),
    infrared_share=st.floats(0, 5),
)
poses = st.builds(
    Pose.facing,
    st.floats(0.3, 50),
    x_m=st.floats(-2, 2),
    y_m=st.floats(-2, 2),
    yaw_deg=st.floats(-85, 85),
    roll_deg=st.floats(-180, 180),
)


def test_the_papers_camera():
    optics = Optics()
    assert (optics.width, optics.height) == (1280, 720)
    assert optics.focal_px == pytest.approx(8e-3 / 4.86e-6)  # 1646 px
    field_of_view = 2 * np.rad2deg(np.arctan(1280 / 2 / optics.focal_px))
    assert field_of_view == pytest.approx(42.5, abs=0.05)


@pytest.mark.parametrize(("distance_m", "side_px"), [(0.5, 164.6), (2.5, 32.9), (5, 16.5), (20, 4.1)])
def test_how_large_five_centimetres_are(distance_m, side_px):
    ends = Optics().project([[-0.025, 0, distance_m], [0.025, 0, distance_m]])
    assert np.ptp(ends[:, 0]) == pytest.approx(side_px, abs=0.05)


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 50)), min_size=1, max_size=20))
def test_opencv_projects_the_same(points):
    optics = Optics()
    theirs = cv2.projectPoints(np.array(points), np.zeros(3), np.zeros(3), optics.matrix, None)[0].reshape(-1, 2)
    np.testing.assert_allclose(optics.project(points), theirs, rtol=1e-9, atol=1e-6)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-50, 0))
def test_nothing_behind_the_camera_has_an_image(x, y, z):
    assert np.isnan(Optics().project([[x, y, z]])).all()


@given(poses, st.lists(st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)), min_size=1, max_size=8))
def test_the_homography_of_a_plane_projects_its_points(pose, points):
    optics = Optics()
    flat = np.array([[x, y, 1.0] for x, y in points]) @ plate_homography(pose, optics).T
    space = pose.apply(np.array([[x, y, 0.0] for x, y in points]))
    np.testing.assert_allclose(flat[:, :2] / flat[:, 2:], optics.project(space), rtol=1e-9, atol=1e-6)


# -- light: only ratios count


def test_the_signal_is_1_in_the_papers_office():
    assert ambient_signal(Light(), Optics()) == pytest.approx(1)
    light = Light(led_to_ambient=1.4)
    assert led_signal(1.0, "visible", light, Optics()) == pytest.approx(1.4)


@given(lights, st.floats(0.5, 22), st.floats(0.1, 5), st.sampled_from(["visible", "infrared"]), st.booleans())
def test_the_leds_share_does_not_depend_on_the_opening(light, f_number, ratio, band, filtered):
    def both(n):
        optics = Optics(f_number=n, infrared_filter=filtered)
        return ambient_signal(light, optics), led_signal(ratio, band, light, optics)

    (wall, led), (wall_5_6, led_5_6) = both(f_number), both(5.6)
    assert wall == pytest.approx(wall_5_6 * (5.6 / f_number) ** 2)
    assert led == pytest.approx(led_5_6 * (5.6 / f_number) ** 2)


@given(lights, st.floats(0.1, 10), st.booleans())
def test_ambient_light_goes_as_illuminance(light, factor, filtered):
    optics = Optics(infrared_filter=filtered)
    more = replace(light, illuminance_lux=light.illuminance_lux * factor)
    assert ambient_signal(more, optics) == pytest.approx(factor * ambient_signal(light, optics))


def test_the_infrared_filter():
    filtered, light = Optics(infrared_filter=True), Light(infrared_led_to_ambient=1.2, infrared_share=0.02)
    assert led_signal(1.0, "visible", light, filtered) == 0  # it blocks the red LED
    assert led_signal(1.0, "infrared", light, filtered) == pytest.approx(1.2 * 0.8)  # III-A: 80 % at 940 nm
    # An office lamp has almost no infrared: of the ambient light 0.8 x 0.02 / 1.02 is left.
    assert ambient_signal(light, filtered) == pytest.approx(0.8 * 0.02 / 1.02)


@given(st.floats(0, 5), st.floats(1, 1e5))
def test_infrared_light_adds_to_visible_light(share, lux):
    # By definition the share is what 940 nm adds relative to the visible. So with the visible part
    # held (same lux), the filtered signal goes as the share, and the unfiltered one is the sum of both.
    office = Light().infrared_share
    visible = lux / 350 / (1 + office)
    light = Light(illuminance_lux=lux, infrared_share=share)
    assert ambient_signal(light, Optics()) == pytest.approx(visible * (1 + share))
    assert ambient_signal(light, Optics(infrared_filter=True)) == pytest.approx(visible * share * IR88_TRANSMITTANCE)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Optics(width=0), ["width=0", "1 .. 65536"]),
        (lambda: Optics(height=70_000), ["height=70000", "1 .. 65536"]),
        (lambda: Optics(blur_px=0.0), ["blur_px=0.0", "more than 0"]),
        (lambda: Optics(f_number=-1.0), ["f_number=-1.0", "more than 0"]),
        (lambda: Optics(halo_fraction=1.0), ["halo_fraction=1.0", "0 .. 1"]),
        (lambda: Light(illuminance_lux=0.0), ["illuminance_lux=0.0", "more than 0"]),
        (lambda: Light(led_to_ambient=-0.1), ["led_to_ambient=-0.1", "0 or more"]),
    ],
)
def test_settings_that_cannot_be_are_refused(make, words):
    with pytest.raises(ValueError) as refused:
        make()
    assert all(word in str(refused.value) for word in words), refused.value
