"""Fits of poses to images that the light model itself made, and their halo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.marker import Board
from bicode_lab.pose.fit import Fit, Look, fit_pose, halo_of, model_image, start_light
from bicode_lab.pose.light_model import N_IMAGE, draw
from bicode_lab.pose.response import N_ALL, LightPriors
from bicode_lab.pose.search import search, variance_of
from bicode_lab.pose.starts import mirrored

from .plates import CAMERA, THICKNESS, Floats, drawn, pose


def look_at(rotation: Floats, place: Floats, noise: float = 0.0, seed: int = 0) -> tuple[Look, Fit]:
    """Return a look at a plate in the usual light, with white noise, and the fit that is the truth."""
    _, x0, y0 = drawn(rotation, place)
    size = (60, 60)
    cells = Board(aruco_id=17).cells().astype(float)
    look = Look(
        seen=np.zeros(size), variance=np.zeros(size), x=x0, y=y0, step_px=1, camera=CAMERA, cells=cells,
        thickness=THICKNESS, priors=LightPriors(),
    )  # fmt: skip
    true = Fit(rotation=rotation, place=place, light=start_light(look.priors), cost=0.0, matrix=np.eye(N_ALL))
    model, _ = model_image(look, true)
    seen = model + np.random.default_rng(seed).normal(0, noise, size) * (model > 0.05)
    return replace(look, seen=seen), true


def turned_deg(first: Floats, second: Floats) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(first.T @ second) - 1) / 2, -1, 1))))


def test_the_halo_is_drawn_coarsely_and_is_the_same() -> None:
    look, true = look_at(*pose(30, 50, 20, 300))
    image = np.empty((60, 60, N_IMAGE))
    even = np.full((1, 1), look.cells.mean())
    draw(true.rotation, true.place / 6, CAMERA, look.x, look.y, 1, 8.0, even, 1e-6, np.zeros(2), False, image)
    assert image[..., 0].max() > 0.2
    assert np.abs(halo_of(look, true.rotation, true.place) - image[..., 0]).max() < 0.01


def test_a_fit_leads_from_a_start_beside_it_to_the_truth() -> None:
    look, true = look_at(*pose(35, 50, 20, 300))
    look = replace(look, variance=np.full((60, 60), 0.01))
    start, place = pose(28, 58, 24, 307)
    fit = fit_pose(look, start, place + [0.3, -0.4, 0], start_light(look.priors), 40)
    assert turned_deg(fit.rotation, true.rotation) < 0.1
    np.testing.assert_allclose(fit.place, true.place, rtol=1e-3, atol=0.02)
    assert fit.cost < 1


def test_parameters_that_are_kept_stay() -> None:
    look, true = look_at(*pose(35, 50, 20, 300))
    look = replace(look, variance=np.full((60, 60), 0.01))
    start, place = pose(28, 58, 24, 307)
    fit = fit_pose(look, start, place, start_light(look.priors), 10, (0, 1, 7, 8))
    np.testing.assert_allclose(fit.rotation[:, 2], start[:, 2], atol=1e-9)
    np.testing.assert_array_equal(fit.light[1:3], start_light(look.priors)[1:3])
    assert turned_deg(fit.rotation, true.rotation) > 1


def test_no_plate_is_seen_from_its_back() -> None:
    look, true = look_at(*pose(35, 50, 20, 300))
    back = true.rotation @ np.diag([1.0, -1, -1])
    look = replace(look, variance=np.full((60, 60), 0.01))
    assert fit_pose(look, back, true.place, true.light, 5).cost == np.inf
    assert search(replace(look, variance=np.zeros((60, 60))), [(back, true.place)], true.light) == []


def test_the_factor_of_the_variance_follows_the_residuals() -> None:
    rotation, place = pose(35, 50, 20, 300)
    quiet, true = look_at(rotation, place, 0.2)
    loud, _ = look_at(rotation, place, 0.8)
    ratio = variance_of(loud, true).max() / variance_of(quiet, true).max()
    assert 3 < ratio < 16


@pytest.mark.parametrize(("tilt_deg", "solutions"), [(0, 1), (45, 1)])
def test_a_plate_that_faces_the_camera_is_one_pose_with_much_doubt(tilt_deg: float, solutions: int) -> None:
    rotation, place = pose(tilt_deg, 50, 20, 300, x=0.1)
    look, _ = look_at(rotation, place, 0.4)
    near, _ = pose(tilt_deg + 12, 50, 20, 300)
    found = search(look, [(near, place), (mirrored(near, place), place)], start_light(look.priors))
    assert len(found) == solutions
    assert turned_deg(found[0].rotation, rotation) < (8 if tilt_deg == 0 else 1.5)
    doubt_deg = np.degrees(np.sqrt(np.linalg.eigvalsh(found[0].covariance[:3, :3]).max()))
    assert doubt_deg > 1.5 if tilt_deg == 0 else doubt_deg < 1


def test_the_covariance_is_in_camera_axes() -> None:
    rotation, place = pose(45, 0, 0, 300, x=0.1)  # tilted about the image's x axis
    look, _ = look_at(rotation, place, 0.4)
    found = search(look, [(rotation, place)], start_light(look.priors))[0]
    deviation = np.sqrt(np.diag(found.covariance))
    assert deviation[5] > 10 * deviation[3]  # the depth is known worse than the place in the image
    eight = np.linalg.eigvalsh(found.covariance)
    assert (eight > 0).all()
