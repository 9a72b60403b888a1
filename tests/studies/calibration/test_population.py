"""Populations: a posterior that is known, moves, copies, and a budget."""

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
)
from bicode_studies.calibration.prior import Coordinate, Floats, Points, Prior

PRIOR = Prior(coordinates=(Coordinate(low=-10, high=10), Coordinate(low=-8, high=8, spread=2.0)), categories=(4,))
SIGMA, SEEN = 1.0, 1.5
RULE = Rule(
    first_draws=1500, first_tolerance=10.0, size=600, rounds=8, last_rounds=40, share=0.5, last_tolerance=0.2,
    most_tried=200_000,
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
        ranked = np.sort(np.repeat(before.distances, np.round(before.weights * RULE.size).astype(int)))
        assert after.tolerance == max(ranked[(ranked.size + 1) // 2 - 1], RULE.last_tolerance)
        assert (after.distances <= after.tolerance).all()
        rounds = RULE.last_rounds if after is found[-1] else RULE.rounds
        assert 0 < after.tried - before.tried <= rounds * RULE.size
        assert 0 < after.moved < 1
        assert after.numbers.max() < after.tried
        assert (np.diff(after.numbers) > 0).all()
        assert after.weights * RULE.size == pytest.approx(np.round(after.weights * RULE.size))
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


def test_no_generation_is_begun_after_the_budget() -> None:
    asked: list[int] = []

    def counted(points: Points, tolerance: float, first: int) -> Floats:
        assert first == sum(asked)
        asked.append(len(points))
        return toy(points, tolerance, first)

    found = list(populations(PRIOR, counted, replace(RULE, most_tried=4000), seed=1))
    assert found[-2].tried < 4000 <= found[-1].tried == sum(asked)
    assert found[-1].tolerance > RULE.last_tolerance


def test_without_a_move_the_nearer_half_stays_and_is_copied() -> None:
    """No move is ever within the tolerance."""
    rule = replace(RULE, first_draws=40, size=10, rounds=2, most_tried=41)

    def only_draws(points: Points, tolerance: float, first: int) -> Floats:
        return np.arange(len(points)) / 10 if first == 0 else np.full(len(points), np.inf)

    first, second = populations(PRIOR, only_draws, rule, seed=2)
    assert first.numbers.tolist() == list(range(10))
    assert second.tolerance == pytest.approx(0.4)
    assert second.numbers.tolist() == list(range(5))
    assert second.moved == 0
    assert second.weights.sum() == pytest.approx(1)
    assert second.weights.min() >= 0.1
    assert (second.points.x == first.points.x[:5]).all()


def population(x: list[list[float]], k: list[list[int]], weights: list[float]) -> Population:
    """Return a population with some points."""
    points = Points(np.array(x, float), np.array(k, np.int64))
    n = np.arange(len(points))
    return Population(
        generation=0, tolerance=1.0, tried=9, points=points, numbers=n, distances=n * 0.1, weights=np.array(weights)
    )  # fmt: skip


def test_moves_have_the_covariance_and_categories_stay_or_are_drawn() -> None:
    start = Points(np.tile([1.0, -2.0], (4000, 1)), np.zeros((4000, 1), np.int64))
    covariance = np.array([[1.0, 0.3], [0.3, 0.25]])
    made = propose(start, covariance, PRIOR, np.random.default_rng(3))
    way = made.x - start.x
    assert np.cov(way.T) == pytest.approx(covariance, abs=5 * np.sqrt(2 / 4000))
    assert way.mean(axis=0) == pytest.approx([0, 0], abs=5 / np.sqrt(4000))
    kept = (made.k[:, 0] == 0).mean()
    right = KEEP + (1 - KEEP) / 4
    assert kept == pytest.approx(right, abs=4 * np.sqrt(right * (1 - right) / 4000))


def test_what_the_prior_rejects_is_not_tried() -> None:
    """All points lie at the end of a narrow prior, so about half of the moves leave it."""
    narrow = Prior(coordinates=(Coordinate(low=0, high=1e-9),))
    asked: list[Floats] = []

    def seen(points: Points, tolerance: float, first: int) -> Floats:
        asked.append(points.x)
        return np.linspace(1, 2, len(points))

    rule = replace(RULE, first_draws=50, size=50, rounds=3, most_tried=51)
    *_, found = populations(narrow, seen, rule, seed=3)
    assert all(((x >= 0) & (x <= 1e-9)).all() for x in asked)
    assert found.tried == sum(len(x) for x in asked) < 50 + 3 * 50


@pytest.mark.parametrize(
    ("kinds", "weights", "chosen"), [([0, 0, 0], [1, 1, 1], 1), ([0, 0, 0], [9, 1, 1], 0), ([0, 1, 0], [1, 1, 1], 0)]
)
def test_the_medoid_is_near_all(kinds: list[int], weights: list[float], chosen: int) -> None:
    """The second point lies between the others, unless weights or its three categories speak against it."""
    share = [w / sum(weights) for w in weights]
    assert medoid(population([[0, 0], [1, 0.5], [2, 1]], [[each] * 3 for each in kinds], share)) == chosen
