"""The prior: draws have the stated shapes between the ends of the file, and the density is that of the draws."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bicode_lab.constants import all_constants, constant
from bicode_studies.calibration.candidates import NAMES, WHOLE
from bicode_studies.calibration.prior import (
    OPENINGS_PX,
    PATTERNS,
    SHAPES,
    Coordinate,
    Points,
    Prior,
    candidates_at,
    prior_of_constants,
    prior_table,
)

N = 4000
DRAWN = candidates_at(prior_of_constants().draw(N, np.random.default_rng(0)))


def values(name: str) -> np.ndarray:
    """Return the values of a constant in all draws."""
    return np.array([getattr(one, name) for one in DRAWN], float)


@pytest.mark.parametrize("name", NAMES)
def test_draws_lie_in_the_ranges_of_the_file_and_the_value_in_use_is_not_at_an_end(name: str) -> None:
    one = all_constants()[name]
    assert values(name).min() >= one.low * (1 - 1e-9)
    assert values(name).max() <= one.high * (1 + 1e-9)
    if name not in WHOLE:
        assert one.low < constant(name) < one.high


@pytest.mark.parametrize("name", SHAPES)
def test_draws_have_the_shape_that_is_stated(name: str) -> None:
    """The shares in four parts: quarters of the range, or of its logarithm, or below, within and above a deviation."""
    shape, middle, spread = SHAPES[name]
    x, ends = values(name), np.array([all_constants()[name].low, all_constants()[name].high])
    if name == "min_region_pixels":
        ends += (-0.5, 0.5)
    if shape.startswith("log"):
        x, ends = np.log(x), np.log(ends)
    if shape.endswith("uniform"):
        cuts, wanted = np.linspace(*ends, 5), np.full(4, 0.25)
    else:
        middle, spread = (np.log(middle), np.log(spread)) if shape == "log-normal" else (middle, spread)
        cuts, wanted = middle + spread * np.array([-9, -1, 0, 1, 9]), np.array([0.159, 0.341, 0.341, 0.159])
    found = np.histogram(x, np.sort(cuts))[0] / N
    assert np.abs(found - wanted).max() < 4 * np.sqrt(0.25 / N)


def test_categories_are_alike() -> None:
    for name, many, known in (("aruco_id", PATTERNS, range(PATTERNS)), ("opening_px", 5, OPENINGS_PX)):
        counts = np.array([(values(name) == each).sum() for each in known])
        assert counts.sum() == N
        assert np.abs(counts - N / many).max() < 4 * np.sqrt(N / many)


def test_every_least_region_has_the_same_share() -> None:
    """The first and the last, too: half of their shares would be seen at five standard deviations."""
    counts = np.bincount(values("min_region_pixels").astype(int), minlength=41)[1:]
    assert counts.sum() == N
    assert np.abs(counts - N / 40).max() < 4 * np.sqrt(N / 40)


def test_the_density_is_that_of_the_draws() -> None:
    prior = Prior(coordinates=(Coordinate(low=-1, high=2), Coordinate(low=-1, high=9, middle=1.0, spread=2.0)))
    x = np.array([[0.0, 1.0], [0.0, 3.0], [2.1, 1.0], [0.0, -1.1], [2.0, -1.0]])
    assert prior.log_density(x) == pytest.approx([0, -0.5, -np.inf, -np.inf, -0.5])
    drawn = prior.draw(2000, np.random.default_rng(1))
    assert np.isfinite(prior.log_density(drawn.x)).all()
    assert drawn.k.shape == (2000, 0)


def test_a_point_is_a_candidate() -> None:
    x = [0.0, 0.0, 0.05, np.log(200), 0.3, np.log(0.02), np.log(0.04), np.log(80), 6.4]
    (one,) = candidates_at(Points(np.array([x]), np.array([[3, 17]])))
    assert (one.led_to_ambient, one.blur_px, one.halo_fraction, one.time_constant_us) == (1.0, 1.0, 0.05, 200.0)
    assert (one.threshold, one.threshold_spread, one.noise, one.refractory_us) == (0.3, 0.02, 0.04, 80.0)
    assert (one.min_region_pixels, one.opening_px, one.aruco_id) == (6, 4, 17)


def test_the_prior_is_drawn_the_same_every_time() -> None:
    drawn = prior_table(30)
    pd.testing.assert_frame_equal(drawn, prior_table(30))
    assert set(drawn.columns) == set(NAMES)
    assert drawn["blur_px"].nunique() > 25
