"""Population Monte Carlo: a posterior that is known, whole batches, a budget, and the weights of proposals."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bicode_studies.calibration.population import (
    KEEP,
    Population,
    Rule,
    medoid,
    populations,
    propose,
    weights_of,
)
from bicode_studies.calibration.prior import Coordinate, Floats, Points, Prior

PRIOR = Prior(coordinates=(Coordinate(low=-10, high=10), Coordinate(low=-8, high=8, spread=2.0)), categories=(4,))
SIGMA, SEEN = 1.0, 1.5
RULE = Rule(
    first_draws=1500, first_tolerance=10.0, size=600, batch=300, share=0.5, last_tolerance=0.2, most_tried=200_000
)  # fmt: skip


def toy(points: Points, tolerance: float, first: int) -> Floats:
    """Observe both coordinates with noise; the categories 2 and 3 are never right, and 1 is a third as often as 0.

    The distance is uniform within the tolerance if the simulation matches: |x0 + noise - SEEN|, with x1 unobserved.
    """
    rng = np.random.default_rng([5, first])
    off = np.abs(points.x[:, 0] + SIGMA * rng.standard_normal(len(points)) - SEEN)
    lucky = rng.random(len(points)) < np.array([0.9, 0.3, 0.0, 0.0])[points.k[:, 0]]
    return np.where(lucky, off, np.inf)


@pytest.fixture(scope="module")
def last() -> Population:
    """Return the last population of the toy."""
    *_, found = populations(PRIOR, toy, RULE, seed=1)
    return found


def test_the_posterior_of_the_toy_is_found(last: Population) -> None:
    """With a flat prior the first coordinate is normal about what was seen; a box of +- 0.2 adds 0.2^2 / 3."""
    assert last.tolerance == RULE.last_tolerance
    assert last.weights.sum() == pytest.approx(1)
    n = last.effective_size
    assert n > 0.5 * len(last.points)
    mean = last.weights @ last.points.x
    spread = np.sqrt(last.weights @ (last.points.x - mean) ** 2)
    wanted = np.array([np.sqrt(SIGMA**2 + 0.2**2 / 3), 2.0])
    assert (np.abs(mean - [SEEN, 0.0]) < 4 * wanted / np.sqrt(n)).all()
    assert (np.abs(spread / wanted - 1) < 4 / np.sqrt(2 * n)).all()


def test_categories_have_their_shares(last: Population) -> None:
    shares = np.bincount(last.points.k[:, 0], weights=last.weights, minlength=4)
    assert shares[0] == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / last.effective_size))
    assert shares[2:].sum() == 0


def test_tolerances_fall_to_the_last_and_distances_are_within(last: Population) -> None:
    found = list(populations(PRIOR, toy, RULE, seed=1))
    tolerances = [each.tolerance for each in found]
    assert tolerances == sorted(tolerances, reverse=True)
    for before, after in pairwise(found):
        assert after.tolerance == max(np.quantile(before.distances, 0.5), RULE.last_tolerance)
        assert (after.distances <= after.tolerance).all()
        assert (after.tried - before.tried) % RULE.batch == 0
        assert len(after.points) >= RULE.size
        assert after.numbers.min() >= before.tried
    assert found[-1].generation == len(found) - 1
    assert (found[-1].points.x == last.points.x).all()  # the same seed, the same result


def test_the_first_population_is_the_best_of_the_draws() -> None:
    def by_place(points: Points, tolerance: float, first: int) -> Floats:
        return np.where(np.arange(len(points)) % 2 == 0, np.arange(len(points)) / 10, np.inf)

    found = next(populations(PRIOR, by_place, replace(RULE, first_draws=20, size=3), seed=0))
    assert found.numbers.tolist() == [0, 2, 4]
    assert found.tolerance == pytest.approx(0.4)
    few = next(populations(PRIOR, by_place, replace(RULE, first_draws=20, first_tolerance=0.3), seed=0))
    assert few.numbers.tolist() == [0, 2]
    with pytest.raises(ValueError, match=r"1 of 20 draws are within 0\.1"):
        next(populations(PRIOR, by_place, replace(RULE, first_draws=20, first_tolerance=0.1), seed=0))


def test_the_budget_ends_before_a_batch_and_drops_what_is_incomplete() -> None:
    asked: list[int] = []

    def counted(points: Points, tolerance: float, first: int) -> Floats:
        assert first == sum(asked)
        asked.append(len(points))
        return toy(points, tolerance, first)

    found = list(populations(PRIOR, counted, replace(RULE, most_tried=4000), seed=1))
    assert 4000 <= sum(asked) < 4000 + RULE.batch
    assert found[-1].tolerance > RULE.last_tolerance
    assert found[-1].tried < sum(asked)


def population(x: list[list[float]], k: list[list[int]], weights: list[float]) -> Population:
    """Return a population with some points."""
    points = Points(np.array(x, float), np.array(k, np.int64))
    n = np.arange(len(points))
    return Population(
        generation=0, tolerance=1.0, tried=9, points=points, numbers=n, distances=n * 0.1, weights=np.array(weights)
    )  # fmt: skip


def test_proposals_move_by_twice_the_covariance_and_keep_their_category() -> None:
    now = population([[0, 0], [2, 0], [0, 1], [2, 1]], [[0], [0], [0], [0]], [0.25] * 4)
    made = propose(now, PRIOR, 4000, np.random.default_rng(3))
    variance = np.array([1.0, 0.25])  # of the four points
    sample = variance * 4 / 3  # as it is estimated from four
    assert np.allclose(made.x.var(axis=0), variance + 2 * sample, rtol=5 * np.sqrt(2 / 4000))
    kept = (made.k[:, 0] == 0).mean()
    right = KEEP + (1 - KEEP) / 4
    assert kept == pytest.approx(right, abs=4 * np.sqrt(right * (1 - right) / 4000))
    edge = population([[9.9, 0], [9.9, 1], [9.0, 1]], [[0], [1], [2]], [0.5, 0.5, 0.0])
    assert propose(edge, PRIOR, 200, np.random.default_rng(3)).x[:, 0].max() <= 10


def test_weights_are_the_prior_over_the_proposal() -> None:
    now = population([[0, 0], [2, 1], [-1, 1]], [[0], [1], [1]], [0.5, 0.3, 0.2])
    points = Points(np.array([[0.5, 0.2], [1.0, -2.0]]), np.array([[0], [3]]))
    covariance = 2 * np.cov(now.points.x.T, aweights=now.weights)
    inverse = np.linalg.inv(covariance)
    wanted = []
    for x, k in zip(points.x, points.k[:, 0], strict=True):
        proposal = 0.0
        for w, centre, held in zip(now.weights, now.points.x, now.points.k[:, 0], strict=True):
            way = x - centre
            stays = KEEP + (1 - KEEP) / 4 if k == held else (1 - KEEP) / 4
            proposal += w * np.exp(-0.5 * way @ inverse @ way) * stays
        wanted.append(np.exp(-0.5 * (x[1] / 2.0) ** 2) / proposal)
    assert weights_of(points, now, PRIOR) == pytest.approx(np.array(wanted) / sum(wanted))


@pytest.mark.parametrize(
    ("kinds", "weights", "chosen"), [([0, 0, 0], [1, 1, 1], 1), ([0, 0, 0], [9, 1, 1], 0), ([0, 1, 0], [1, 1, 1], 0)]
)
def test_the_medoid_is_near_all(kinds: list[int], weights: list[float], chosen: int) -> None:
    """The second point lies between the others, unless weights or its three categories speak against it."""
    share = [w / sum(weights) for w in weights]
    assert medoid(population([[0, 0], [1, 0.5], [2, 1]], [[each] * 3 for each in kinds], share)) == chosen
