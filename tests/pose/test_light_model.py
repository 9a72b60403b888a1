"""The drawn plate: against a picture made of points, and its derivatives against differences."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from bicode_lab.marker import Board
from bicode_lab.pose.light_model import N_IMAGE, draw

from .plates import CAMERA, THICKNESS, Floats, drawn, plainly_drawn, pose

POSES = [(0, 0, 0, 300), (20, 30, 75, 300), (45, 200, 160, 250), (60, 110, 290, 400), (40, 300, 20, 1200)]


@pytest.mark.parametrize("values", POSES)
@pytest.mark.parametrize("blur", [0.7, 1.2])
def test_a_picture_made_of_points_is_the_same(values: tuple[float, ...], blur: float) -> None:
    rotation, place = pose(*values)
    image, x0, y0 = drawn(rotation, place, blur=blur)
    seen = image[..., 0] + 0.3 * image[..., 8] + 0.6 * image[..., 9]
    plain = plainly_drawn(rotation, place, x0, y0, 60, blur, (0.3, 0.6), 17)
    assert plain.max() > 0.3
    assert np.abs(seen - plain).max() < 0.05
    assert seen.sum() == pytest.approx(plain.sum(), rel=0.01)


@pytest.mark.parametrize("values", POSES[1:])
@pytest.mark.parametrize("k", range(6))
def test_derivatives_of_the_pose_are_differences(values: tuple[float, ...], k: int) -> None:
    rotation, place = pose(*values)
    image, *_ = drawn(rotation, place)
    # The quadrature of the blur is held constant in the slopes, which a tilt far away changes most.
    step = 1e-4 if k < 3 else 1e-3 if k < 5 else 0.05

    def moved(by: float) -> Floats:
        one = np.eye(3)[k % 3] * by
        r = rotation @ cv2.Rodrigues(one)[0] if k < 3 else rotation
        t = place if k < 3 else place + rotation @ one
        x0, y0 = drawn(rotation, place)[1:]
        out = np.empty((60, 60, N_IMAGE))
        cells = Board(aruco_id=17).cells().astype(float)
        draw(r, t, CAMERA, x0, y0, 1, 0.9, cells, THICKNESS, np.array([0.3, 0.6]), False, out)
        return out[..., 0] + 0.3 * out[..., 8] + 0.6 * out[..., 9]

    slope = (moved(step) - moved(-step)) / (2 * step)
    assert np.abs(slope).max() > 0.1
    assert np.abs(slope - image[..., 1 + k]).max() < (0.2 if k < 2 else 0.08) * np.abs(slope).max()


def test_the_derivative_of_the_blur_is_a_difference() -> None:
    rotation, place = pose(*POSES[2])
    image, *_ = drawn(rotation, place)
    wide, narrow = (drawn(rotation, place, blur=0.9 * np.exp(s))[0] for s in (1e-3, -1e-3))
    slope = ((wide - narrow)[..., [0, 8, 9]] @ [1, 0.3, 0.6]) / 2e-3
    assert np.abs(slope - image[..., 7]).max() < 0.05 * np.abs(slope).max()


def test_the_back_of_a_plate_is_dark() -> None:
    rotation, place = pose(0, 0, 0, 300)
    image, *_ = drawn(rotation @ np.diag([1.0, -1, -1]), place)
    assert not image.any()


def test_pixels_between_are_left_out() -> None:
    rotation, place = pose(*POSES[1])
    image, x0, y0 = drawn(rotation, place)
    coarse = np.empty((20, 20, N_IMAGE))
    cells = Board(aruco_id=17).cells().astype(float)
    draw(rotation, place, CAMERA, x0, y0, 3, 0.9, cells, THICKNESS, np.array([0.3, 0.6]), True, coarse)
    np.testing.assert_allclose(coarse, image[::3, ::3])
