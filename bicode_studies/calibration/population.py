"""Approximate Bayesian computation by population Monte Carlo (Beaumont, Cornuet, Marin, Robert 2009, Biometrika 96).

A point of the prior is accepted if its distance from what was observed is within a tolerance. The first population is
the best of many draws from the prior. Each later one is proposed from the one before, with a smaller tolerance: a point
is chosen by its weight and moved; the weight of what is accepted is the density of the prior over that of the proposal.

Coordinates are moved by a normal distribution with twice the weighted covariance of the population. A category stays
with probability `KEEP` and is drawn from the prior else. A point that would leave the prior is drawn anew.

All of a batch is tried before anything is decided, so the result does not depend on how many are tried at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

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
        A population is complete when it has at least as many points; all that are accepted of a batch count.
    batch : int
        Number of points that are tried before the population is counted again.
    share : float
        The next tolerance is this quantile of the population's distances.
    last_tolerance : float
        No tolerance is smaller; the population that has it is the last.
    most_tried : int
        Number of points after which no batch is begun. An incomplete population is dropped.
    """

    first_draws: int
    first_tolerance: float
    size: int
    batch: int
    share: float
    last_tolerance: float
    most_tried: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Population:
    """The accepted points of a generation.

    Attributes
    ----------
    generation : int
        From 0.
    tolerance : float
    tried : int
        Number of points that were tried so far, in all generations.
    points : Points
    numbers : ndarray of int, shape (n,)
        Number of each point, in the order in which all points were tried.
    distances, weights : ndarray, shape (n,)
        The weights sum to 1.
    """

    generation: int
    tolerance: float
    tried: int
    points: Points
    numbers: Ints
    distances: Floats
    weights: Floats

    @property
    def effective_size(self) -> float:
        """Number of points of equal weight that would tell as much, ``1 / sum(weights ** 2)``."""
        return float(1 / (self.weights**2).sum())


Distances = Callable[[Points, float, int], Floats]
"""Takes points, the tolerance and the number of the first point; returns distances, which may be infinite where they
pass the tolerance."""


def populations(prior: Prior, distances: Distances, rule: Rule, seed: int) -> Iterator[Population]:
    """Run the generations of population Monte Carlo.

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
        Each generation that is complete; the last one is the posterior.
    """
    points = prior.draw(rule.first_draws, np.random.default_rng([seed, 0]))
    found = distances(points, rule.first_tolerance, 0)
    best = np.argsort(found, kind="stable")[: min(rule.size, int((found <= rule.first_tolerance).sum()))]
    if best.size < 2:
        raise ValueError(f"{best.size} of {rule.first_draws} draws are within {rule.first_tolerance:g}; draw more")
    now = Population(
        generation=0, tolerance=float(found[best].max()), tried=rule.first_draws, points=points.take(best),
        numbers=best, distances=found[best], weights=np.full(best.size, 1 / best.size),
    )  # fmt: skip
    yield now
    while now.tolerance > rule.last_tolerance:
        following = _next_population(now, prior, distances, rule, seed)
        if following is None:
            return
        now = following
        yield now


def _next_population(now: Population, prior: Prior, distances: Distances, rule: Rule, seed: int) -> Population | None:
    """Return the next population; None where the budget ends first."""
    generation, tried = now.generation + 1, now.tried
    tolerance = max(float(np.quantile(now.distances, rule.share)), rule.last_tolerance)
    rng = np.random.default_rng([seed, generation])
    x, k, numbers = [np.empty((0, now.points.x.shape[1]))], [now.points.k[:0]], [np.empty(0, np.int64)]
    kept = [np.empty(0)]
    while sum(each.size for each in kept) < rule.size:
        if tried >= rule.most_tried:
            return None
        points = propose(now, prior, rule.batch, rng)
        found = distances(points, tolerance, tried)
        accepted = np.flatnonzero(found <= tolerance)
        x.append(points.x[accepted])
        k.append(points.k[accepted])
        numbers.append(tried + accepted)
        kept.append(found[accepted])
        tried += rule.batch
    points = Points(np.concatenate(x), np.concatenate(k))
    return Population(
        generation=generation, tolerance=tolerance, tried=tried, points=points, numbers=np.concatenate(numbers),
        distances=np.concatenate(kept), weights=weights_of(points, now, prior),
    )  # fmt: skip


def propose(now: Population, prior: Prior, n: int, rng: np.random.Generator) -> Points:
    """Draw proposals for the next population.

    Parameters
    ----------
    now : Population
    prior : Prior
    n : int
    rng : numpy.random.Generator

    Returns
    -------
    Points
    """
    covariance = _kernel_covariance(now)
    x, k = np.empty((0, now.points.x.shape[1])), now.points.k[:0]
    while len(x) < n:
        chosen = rng.choice(len(now.weights), n, p=now.weights)
        moved = now.points.x[chosen] + rng.multivariate_normal(np.zeros(x.shape[1]), covariance, n)
        drawn = rng.integers(0, prior.categories, (n, len(prior.categories)))
        category = np.where(rng.random(drawn.shape) < KEEP, now.points.k[chosen], drawn)
        inside = np.isfinite(prior.log_density(moved))
        x, k = np.concatenate([x, moved[inside]]), np.concatenate([k, category[inside]])
    return Points(x[:n], k[:n])


def weights_of(points: Points, before: Population, prior: Prior) -> Floats:
    """Return the weights of accepted points: the density of the prior over the density of their proposal.

    Parameters
    ----------
    points : Points
    before : Population
        The one that they were proposed from.
    prior : Prior

    Returns
    -------
    ndarray, shape (n,)
        They sum to 1.
    """
    kernel = multivariate_normal(cov=_kernel_covariance(before))
    log = np.log(before.weights) + np.array([kernel.logpdf(x - before.points.x).reshape(-1) for x in points.x])
    for kind, many in enumerate(prior.categories):
        same = points.k[:, kind, None] == before.points.k[None, :, kind]
        log = log + np.log(KEEP * same + (1 - KEEP) / many)
    log_weights = prior.log_density(points.x) - logsumexp(log, axis=1)
    return np.asarray(np.exp(log_weights - logsumexp(log_weights)))


def _kernel_covariance(now: Population) -> Floats:
    """Return the covariance by which coordinates are moved: twice the weighted covariance of the population."""
    return 2 * np.atleast_2d(np.cov(now.points.x.T, aweights=now.weights))


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
    scale = np.sqrt(np.diag(_kernel_covariance(now)) / 2)
    apart = (np.abs(x[:, None] - x[None]) / scale).sum(axis=2) + (k[:, None] != k[None]).sum(axis=2)
    return int((apart @ now.weights).argmin())
