"""The response of pixels, and the normal equations of a fit."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.pose.fit import LIGHT_LIMITS
from bicode_lab.pose.light_model import N_POSE
from bicode_lab.pose.response import N_ALL, N_LIGHT, LightPriors, expected, normal_equations, respond

from .plates import drawn, pose

LIGHT = LightPriors().table()[:, 0].copy()


def test_no_event_below_the_threshold_and_more_with_more_light() -> None:
    values = [respond(share, LIGHT)[0] for share in np.linspace(0, 3, 50)]
    assert values[0] < 0.01
    assert (np.diff(values) > 0).all()
    threshold = np.expm1(LIGHT[1]) / np.exp(LIGHT[0])
    assert respond(threshold, LIGHT)[0] == pytest.approx(1, abs=0.05)  # half of the edges have one event


def test_without_loss_an_event_needs_one_threshold_each() -> None:
    light = LIGHT.copy()
    light[2], light[3] = 0.0, -5.5
    share = np.expm1(3.5 * light[1]) / np.exp(light[0])
    assert respond(share, light)[0] == pytest.approx(6, abs=0.01)


@pytest.mark.parametrize("share", [0.1, 0.18, 0.4, 0.9, 2.0])
def test_slopes_are_differences(share: float) -> None:
    slopes = respond(share, LIGHT)[1:6]
    for k, slope in enumerate(slopes):
        high, low = LIGHT.copy(), LIGHT.copy()
        up, down = share, share
        if k == 0:
            up, down = share + 1e-5, share - 1e-5
        else:
            high[k - 1] += 1e-5
            low[k - 1] -= 1e-5
        assert slope == pytest.approx((respond(up, high)[0] - respond(down, low)[0]) / 2e-5, rel=1e-3, abs=1e-4)


def test_the_doubt_is_largest_on_a_step() -> None:
    threshold = np.expm1(LIGHT[1]) / np.exp(LIGHT[0])
    assert respond(threshold, LIGHT)[6] == pytest.approx(1, abs=0.05)
    assert respond(0.3 * threshold, LIGHT)[6] < 0.1


def test_the_vector_is_the_slope_of_the_cost() -> None:
    rng = np.random.default_rng(0)
    image, *_ = drawn(*pose(35, 20, 100, 300))
    image = np.ascontiguousarray(image)
    halo = np.full(image.shape[:2], 0.02)
    light = LIGHT + rng.normal(0, 0.02, N_LIGHT)
    light[5] = 0.03
    seen, doubt = np.empty(image.shape[:2]), np.empty(image.shape[:2])
    light[6:] = 0.3, 0.6
    expected(image, halo, light, seen, doubt)
    seen += rng.normal(0, 0.3, seen.shape)
    variance = np.full(seen.shape, 0.1)
    priors = LightPriors().table()
    matrix, vector = np.empty((N_ALL, N_ALL)), np.empty(N_ALL)
    normal_equations(image, halo, seen, variance, light, priors, matrix, vector)
    np.testing.assert_allclose(matrix, matrix.T)
    room = np.empty_like(matrix), np.empty_like(vector)
    for k in range(N_LIGHT):
        if k == 4:
            continue  # the blur changes the image
        costs = []
        for step in (1e-5, -1e-5):
            other = light.copy()
            other[k] += step
            costs.append(normal_equations(image, halo, seen, variance, other, priors, *room))
        assert -vector[N_POSE + k] == pytest.approx((costs[0] - costs[1]) / 2e-5, rel=2e-2, abs=0.05)
    for k in range(1, 8):
        costs = []
        for step in (1e-5, -1e-5):
            other_image = image.copy()
            other_image[..., 0] += step * image[..., k]
            costs.append(normal_equations(other_image, halo, seen, variance, light, priors, *room))
        at, prior = (k - 1, 0.0) if k < 7 else (N_POSE + 4, (light[4] - priors[4, 0]) / priors[4, 1] ** 2)
        assert -vector[at] - prior == pytest.approx((costs[0] - costs[1]) / 2e-5, rel=2e-2, abs=0.5)


def test_a_pixel_far_off_counts_less() -> None:
    image, *_ = drawn(*pose(35, 20, 100, 300))
    halo, seen = np.zeros(image.shape[:2]), np.zeros(image.shape[:2])
    doubt = np.empty_like(seen)
    expected(image, halo, LIGHT, seen, doubt)
    costs = []
    for off in (0.0, 10.0, 11.0):
        other = seen.copy()
        other[0, 0] += off
        costs.append(
            normal_equations(
                image,
                halo,
                other,
                np.ones_like(seen),
                LIGHT,
                LightPriors().table(),
                np.empty((N_ALL, N_ALL)),
                np.empty(N_ALL),
            )
        )
    assert costs[1] - costs[0] == pytest.approx(3 * (10 - 1.5), abs=0.01)
    assert costs[2] - costs[1] == pytest.approx(3, abs=0.01)


def test_priors_without_a_deviation_are_refused() -> None:
    with pytest.raises(ValueError, match=r"halo=.*deviation"):
        LightPriors(halo=(0.1, 0))
    with pytest.raises(ValueError, match="halo_px=0"):
        LightPriors(halo_px=0)
    assert LightPriors().table().shape == (N_LIGHT, 2) == LIGHT_LIMITS.shape
