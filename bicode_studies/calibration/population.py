"""Approximate Bayesian computation by a sequence of populations (Drovandi and Pettitt 2011, Biometrics 67).

A point of the prior is accepted if its distance from what was observed is within a tolerance. The first population is
the best of many draws from the prior. Each later one has a smaller tolerance: the points beyond it are dropped, copies
of the others take their place, and all points are moved by a Markov chain that leaves the prior within the tolerance
unchanged. So all points weigh the same; copies that are still equal at the end are one point with their joint weight.

In a move, coordinates change by a normal distribution with the covariance of the population, and a category stays with
probability `KEEP` and is drawn from the prior else. A move is accepted with the ratio of the priors, and only if the
distance there is within the tolerance. What the prior rejects is not tried.

All moves of a round are tried before anything is decided, so the result does not depend on how many are tried at a
time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bicode_studies.calibration.prior import Floats, Ints, Points, Prior

KEEP = 0.8  # probability that a category stays


@dataclass(frozen=True, kw_only=True)
class Rule:
    """The schedule of a run.

    Attributes
    ----------
    first_draws : int
        Number of draws from the prior.
    first_tolerance : float
        Their tolerance; a draw beyond it is never accepted.
    size : int
        Number of points of a population, copies included.
    rounds, last_rounds : int
        How often each point is moved in a generation, and in the last one.
    share : float
        The next tolerance is this quantile of the population's distances.
    last_tolerance : float
        No tolerance is smaller; the population that has it is the last.
    most_tried : int
        Number of points after which no generation is begun.
    """

    first_draws: int
    first_tolerance: float
    size: int
    rounds: int
    last_rounds: int
    share: float
    last_tolerance: float
    most_tried: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Population:
    """The different points of a generation.

    Attributes
    ----------
    generation : int
        From 0.
    tolerance : float
    tried : int
        Number of points that were tried so far, in all generations.
    points : Points
    numbers : ndarray of int, shape (n,)
        Number of each point, in the order in which all points were tried; rising.
    distances, weights : ndarray, shape (n,)
        A weight is the share of the population that are copies of the point; the weights sum to 1.
    moved : float
        Share of the moves that were accepted, 0 .. 1; nan in the first generation.
    """

    generation: int
    tolerance: float
    tried: int
    points: Points
    numbers: Ints
    distances: Floats
    weights: Floats
    moved: float = np.nan

    @property
    def effective_size(self) -> float:
        """Number of points of equal weight that would tell as much, ``1 / sum(weights ** 2)``."""
        return float(1 / (self.weights**2).sum())


Distances = Callable[[Points, float, int], Floats]
"""Takes points, the tolerance and the number of the first point; returns distances, which may be infinite where they
pass the tolerance."""


def populations(prior: Prior, distances: Distances, rule: Rule, seed: int) -> Iterator[Population]:
    """Run the generations.

    Parameters
    ----------
    prior : Prior
    distances : callable
        See `Distances`.
    rule : Rule
    seed : int
        Seed of all draws; each generation has its own generator.

    Yields
    ------
    Population
        Each generation; the last one is the posterior.

    Raises
    ------
    ValueError
        If fewer than two draws from the prior are within the first tolerance.
    """
    points = prior.draw(rule.first_draws, np.random.default_rng([seed, 0]))
    found = distances(points, rule.first_tolerance, 0)
    best = np.argsort(found, kind="stable")[: min(rule.size, int((found <= rule.first_tolerance).sum()))]
    if best.size < 2:
        raise ValueError(f"{best.size} of {rule.first_draws} draws are within {rule.first_tolerance:g}; draw more")
    best = np.sort(best)
    now = Population(
        generation=0, tolerance=float(found[best].max()), tried=rule.first_draws, points=points.take(best),
        numbers=best, distances=found[best], weights=np.full(best.size, 1 / best.size),
    )  # fmt: skip
    yield now
    while now.tolerance > rule.last_tolerance and now.tried < rule.most_tried:
        now = _next_population(now, prior, distances, rule, seed)
        yield now


def _next_population(now: Population, prior: Prior, distances: Distances, rule: Rule, seed: int) -> Population:
    """Return the next population."""
    generation, tried = now.generation + 1, now.tried
    rng = np.random.default_rng([seed, generation])
    tolerance = max(_quantile(now, rule.share), rule.last_tolerance)
    rows = _replenished(now, tolerance, rule.size, rng)
    points, numbers, found = now.points.take(rows), now.numbers[rows], now.distances[rows]
    covariance = np.atleast_2d(np.cov(points.x.T))
    rounds, n_moved = rule.last_rounds if tolerance <= rule.last_tolerance else rule.rounds, 0
    for _ in range(rounds):
        there = propose(points, covariance, prior, rng)
        ratio = np.exp(np.minimum(prior.log_density(there.x) - prior.log_density(points.x), 0.0))
        asked = np.flatnonzero(rng.random(rule.size) < ratio)
        apart = distances(there.take(asked), tolerance, tried) if asked.size else np.empty(0)
        within = apart <= tolerance
        accepted = asked[within]
        points.x[accepted], points.k[accepted] = there.x[accepted], there.k[accepted]
        numbers[accepted], found[accepted] = tried + np.flatnonzero(within), apart[within]
        tried, n_moved = tried + asked.size, n_moved + accepted.size
    different, first, copies = np.unique(numbers, return_index=True, return_counts=True)
    return Population(
        generation=generation, tolerance=tolerance, tried=tried, points=points.take(first), numbers=different,
        distances=found[first], weights=copies / rule.size, moved=n_moved / (rounds * rule.size),
    )  # fmt: skip


def _quantile(now: Population, share: float) -> float:
    """Return the smallest distance within which this share of a population lies."""
    order = np.argsort(now.distances, kind="stable")
    within = np.cumsum(now.weights[order])
    return float(now.distances[order[np.searchsorted(within, share * within[-1] * (1 - 1e-9))]])


def _replenished(now: Population, tolerance: float, size: int, rng: np.random.Generator) -> Ints:
    """Return the rows of the points within the tolerance, with their copies, and of copies of them, `size` in all."""
    copies = np.maximum(np.round(now.weights * size), 1).astype(np.int64)
    kept = np.repeat(np.arange(len(copies)), copies * (now.distances <= tolerance))[:size]
    return np.concatenate([kept, rng.choice(kept, size - kept.size)])


def propose(points: Points, covariance: Floats, prior: Prior, rng: np.random.Generator) -> Points:
    """Draw a move of each point.

    Parameters
    ----------
    points : Points
    covariance : ndarray, shape (coordinates, coordinates)
        Of the changes of the coordinates.
    prior : Prior
        Where categories are drawn from.
    rng : numpy.random.Generator

    Returns
    -------
    Points
        They may lie outside the prior.
    """
    n, coordinates = points.x.shape
    moved = points.x + rng.multivariate_normal(np.zeros(coordinates), covariance, n)
    drawn = rng.integers(0, prior.categories, (n, len(prior.categories)))
    return Points(moved, np.where(rng.random(drawn.shape) < KEEP, points.k, drawn))


def medoid(now: Population) -> int:
    """Return the row of the point with the smallest mean distance from all points, by weight.

    The distance of two points is the sum over coordinates of their difference in standard deviations of the population,
    plus one for each kind in which their categories differ.

    Parameters
    ----------
    now : Population

    Returns
    -------
    int
    """
    x, k = now.points.x, now.points.k
    scale = np.sqrt(np.diag(np.atleast_2d(np.cov(x.T, aweights=now.weights))))
    apart = (np.abs(x[:, None] - x[None]) / scale).sum(axis=2) + (k[:, None] != k[None]).sum(axis=2)
    return int((apart @ now.weights).argmin())
