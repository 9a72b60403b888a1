"""The interval of an accuracy over seeds whose periods may be alike to any degree.

The periods of one seed share its payload, its place on the pixels and their thresholds, so they are right or wrong
together more often than those of different seeds: they have an intra-seed correlation rho. With m seeds of n_i
periods, the mean share of right periods varies as that of N independent periods would, with

    1 / N = rho / m + (1 - rho) sum(1 / n_i) / m^2,

which is Kish's design effect: N is the number of all periods for rho = 0, and that of the seeds for rho = 1. If rho
were known, the interval would be the exact binomial one of N periods (Clopper and Pearson; Korn and Graubard 1998,
Survey Methodology 24, 193), with half of the probability of what was seen itself ("mid-p": Lancaster 1961, J. Am.
Stat. Assoc. 56, 223). It is not known, so each accuracy that may be the true one is tried with many values of rho, and
the tail probabilities are averaged with the likelihood of each rho as weight. Two families of seeds are tried, since
either alone misleads where the other is true:

    seeds differ by degrees   the shares of seeds have a beta distribution (beta-binomial counts)
    all or nothing            a seed is all right or all wrong with probability rho, else its periods are independent

Where nothing contradicts rho = 1, as with no right period at all, this value has the largest likelihood, and the
interval is nearly that of m independent results: ten seeds without an error say little more than ten periods. A single
right period speaks against rho = 1, so the interval would be shorter with it than without it, and a verdict could be
certain only because the result is worse. So no upper end lies below that of seeds without a right period, and no lower
end above that of seeds without a wrong one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.special import betainc, betaln, expit, logit, xlog1py, xlogy
from scipy.stats import beta

from bicode_studies.statistics.intervals import LEVEL

Floats = npt.NDArray[np.float64]

N_RHO = 24  # values of rho for each family of seeds
# They lie at equal steps of a beta distribution, dense near 0: the likelihood of n alike periods changes within 1/n.
RHO: Floats = np.maximum(beta.ppf((np.arange(N_RHO) + 0.5) / N_RHO, 0.15, 0.5), 1e-6)
LEAST_SHARE = 1e-9  # accuracies are tried from here to 1 less this


def interval_over_seeds(right: npt.ArrayLike, periods: npt.ArrayLike, level: float = LEVEL) -> tuple[float, float]:
    """Return the interval of the mean share of right periods over seeds.

    Parameters
    ----------
    right : array_like, shape (seeds,)
        Number of right periods of each seed; need not be whole.
    periods : array_like of int, shape (seeds,)
        Number of periods of each seed, one or more.
    level : float
        Share of all such intervals that hold the true accuracy; each end fails in about half of the rest, or less.

    Returns
    -------
    low, high : float
        Ends of the interval, 0 .. 1. They enclose the mean share of right periods.

    Raises
    ------
    ValueError
        If there is no seed, or a seed without periods.

    Examples
    --------
    Ten seeds of 20 periods: none right; one right; nine right in each seed; five seeds all right, five all wrong:

    >>> seeds = ([0] * 10, [1] + [0] * 9, [9] * 10, [20] * 5 + [0] * 5)
    >>> [[round(end, 2) for end in interval_over_seeds(right, [20] * 10)] for right in seeds]
    [[0.0, 0.25], [0.0, 0.25], [0.38, 0.53], [0.22, 0.78]]
    """
    k, n = np.asarray(right, float), np.asarray(periods, float)
    if not (n.size and (n > 0).all()):
        raise ValueError(f"periods={n.tolist()} holds no seed, or one without periods; leave out seeds without periods")
    low, high = _ends(tuple(sorted(zip(k.tolist(), n.tolist(), strict=True))), level)
    _, least = _ends(tuple((0.0, each) for each in sorted(n.tolist())), level)  # the upper end of none right
    return min(low, 1 - least), max(high, least)


@lru_cache(maxsize=4096)  # many conditions have all periods right, or none
def _ends(seeds: tuple[tuple[float, float], ...], level: float) -> tuple[float, float]:
    """Return the interval of seeds, each given by its right periods and its periods, as its own counts have it."""
    k, n = np.array(seeds).T
    share, at_most = float((k / n).mean()), probability_up_to(k, n)
    low, high = (_accuracy_with(at_most, (1 + sign * level) / 2) for sign in (1, -1))
    return min(low, share), max(high, share)


def _accuracy_with(at_most: Callable[[float], float], probability: float) -> float:
    """Return the true accuracy with which shares up to ours have a probability, which falls with the accuracy."""
    if at_most(LEAST_SHARE) <= probability:
        return 0.0
    if at_most(1 - LEAST_SHARE) >= probability:
        return 1.0
    furthest = logit(1 - LEAST_SHARE)
    return float(expit(brentq(lambda x: at_most(expit(x)) - probability, -furthest, furthest, xtol=1e-6)))


def probability_up_to(right: Floats, periods: Floats) -> Callable[[float], float]:
    """Return the function that tells how likely a mean share up to ours is, given the true accuracy.

    Parameters
    ----------
    right, periods : ndarray, shape (seeds,)
        Numbers of right periods and of all periods of each seed.

    Returns
    -------
    callable
        From an accuracy between 0 and 1 to a probability, in which our share itself counts half.
    """
    seeds, counts = np.unique(np.column_stack([right, periods]), axis=0, return_counts=True)
    k, n = seeds.T
    m, share = periods.size, float((right / periods).mean())
    alike = 1 / (RHO / m + (1 - RHO) * (1 / periods).sum() / m**2)  # N for each rho
    many, x = np.tile(alike, 2), np.tile(alike * share, 2)
    more = many - x

    def at_most(accuracy: float) -> float:
        chance = np.concatenate([_by_degrees(k, n, accuracy), _all_or_nothing(k, n, accuracy)]) @ counts
        weights = np.exp(chance - chance.max())
        below = betainc(more + 1, x, 1 - accuracy) if share > 0 else np.zeros_like(x)
        up_to = betainc(more, x + 1, 1 - accuracy) if share < 1 else np.ones_like(x)
        return float(weights @ (below + up_to) / 2 / weights.sum())

    return at_most


def _by_degrees(k: Floats, n: Floats, accuracy: float) -> Floats:
    """Return the log likelihood of k of n right periods for each rho, shape (N_RHO, k), if shares are beta distributed.

    Binomial coefficients are left out, here and in `_all_or_nothing`: they are the same for all rho.
    """
    total = (1 / RHO - 1)[:, None]
    a, b = accuracy * total, (1 - accuracy) * total
    return np.asarray(betaln(k + a, n - k + b) - betaln(a, b))


def _all_or_nothing(k: Floats, n: Floats, accuracy: float) -> Floats:
    """Return the same log likelihood if a seed is all right or all wrong with probability rho, else independent."""
    independent = xlogy(k, accuracy) + xlog1py(n - k, -accuracy)
    atom = np.where(k == n, accuracy, np.where(k == 0, 1 - accuracy, 0.0))
    rho = RHO[:, None]
    return np.asarray(np.log((1 - rho) * np.exp(independent) + rho * atom + np.finfo(float).tiny))
