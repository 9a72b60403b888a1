"""Intervals of shares of independent results, of means, and of sums and differences of what has an interval."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import norm, t

LEVEL = 0.95  # of every interval that is shown

Floats = npt.NDArray[np.float64]


def wilson(right: npt.ArrayLike, n: npt.ArrayLike, level: float = LEVEL) -> tuple[Floats, Floats]:
    """Return the Wilson score interval of a share.

    The interval assumes independent results. Periods of one recording are not independent, so accuracies over several
    recordings have their interval from `interval_over_seeds`.

    Parameters
    ----------
    right : array_like
        Number of right results, 0 .. n; need not be whole.
    n : array_like
        Number of all results, more than 0; same shape as `right`.
    level : float
        Share of all such intervals that hold the true share.

    Returns
    -------
    low, high : ndarray
        Ends of the interval, 0 .. 1; shape of the arguments, or numbers.

    Raises
    ------
    ValueError
        If an n is 0.

    Notes
    -----
    ``(k + z^2/2 -+ z sqrt(k (n - k) / n + z^2/4)) / (n + z^2)`` with k right results and z = 1.959964 for 95 %
    (Wilson 1927, J. Am. Stat. Assoc. 22, 209).

    Examples
    --------
    >>> [[round(float(end), 3) for end in ends] for ends in wilson([9, 0], [10, 10])]
    [[0.596, 0.0], [0.982, 0.278]]
    """
    k, of = np.asarray(right, float), np.asarray(n, float)
    if not (of > 0).all():
        raise ValueError("n=0 results have no share and no interval; give one or more, or record for longer")
    z = float(norm.ppf((1 + level) / 2))
    share, weight = k / of, z**2 / (of + z**2)
    middle = share + (0.5 - share) * weight
    half = z * np.sqrt(share * (1 - share) * of + z**2 / 4) / (of + z**2)
    # The ends are exactly 0 without a right result, and 1 without a wrong one, whatever the rounding.
    low = np.where(k > 0, np.maximum(middle - half, 0.0), 0.0)
    high = np.where(k < of, np.minimum(middle + half, 1.0), 1.0)
    return low[()], high[()]  # numbers for numbers, arrays for arrays


def interval_of_mean(values: npt.ArrayLike, level: float = LEVEL) -> tuple[float, float]:
    """Return Student's interval of a mean.

    Parameters
    ----------
    values : array_like, shape (n,)
        Independent values; n is 2 or more.
    level : float
        Share of all such intervals that hold the true mean.

    Returns
    -------
    low, high : float
        Ends of the interval; nan for a single value, which does not tell how far values scatter.

    Examples
    --------
    >>> [round(end, 3) for end in interval_of_mean([9, 10, 11])]  # 10 -+ 4.303 / sqrt(3)
    [7.516, 12.484]
    """
    numbers = np.asarray(values, float)
    if numbers.size < 2:
        return np.nan, np.nan
    half = float(t.ppf((1 + level) / 2, numbers.size - 1) * numbers.std(ddof=1) / np.sqrt(numbers.size))
    return float(numbers.mean()) - half, float(numbers.mean()) + half


def interval_of_sum(factors: npt.ArrayLike, values: npt.ArrayLike, ends: npt.ArrayLike) -> tuple[float, float]:
    """Return the interval of a sum of independent estimates, each times a factor, from their own intervals.

    Each end of the sum is as far from it as the root of the summed squares of the distances from each estimate to that
    end of its interval which moves the sum this way (MOVER: Zou and Donner 2008, Stat. Med. 27, 1693; for the
    difference of two shares, Newcombe 1998, Stat. Med. 17, 873).

    Parameters
    ----------
    factors, values : array_like, shape (n,)
        The sum is ``sum(factors * values)``.
    ends : array_like, shape (n, 2)
        Lower and upper ends of the values' intervals, all of one level.

    Returns
    -------
    low, high : float
        Ends of the interval of the sum, of the same level.

    Examples
    --------
    >>> low, high = interval_of_sum([1, -1], [0.8, 0.5], [[0.5, 0.9], [0.1, 0.6]])  # 0.8 - 0.5
    >>> round(low, 3), round(high, 3)  # 0.3 - root(0.3^2 + 0.1^2), 0.3 + root(0.1^2 + 0.4^2)
    (-0.016, 0.712)
    """
    by, middle = np.asarray(factors, float)[:, None], np.asarray(values, float)[:, None]
    moves = np.sort(by * (np.asarray(ends, float) - middle), axis=1)
    down, up = np.hypot.reduce(moves, axis=0)
    total = float((by * middle).sum())
    return total - float(down), total + float(up)
