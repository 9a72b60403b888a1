"""Accuracies with their 95 % intervals, and ranges: each is defined here once, for all studies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

Z_95 = 1.96  # half the width of a 95 % interval, in standard deviations of a normal distribution
DRAWS = 2000  # of a bootstrap
HALF = 0.5  # a range ends where the accuracy falls below this

Floats = npt.NDArray[np.float64]


def wilson(right: npt.ArrayLike, n: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return the 95 % Wilson score interval of a share.

    The interval assumes independent results. Periods of one recording are not quite independent, so accuracies over
    several recordings have their interval from `bootstrap`.

    Parameters
    ----------
    right : array_like
        Number of right results, 0 .. n; need not be whole.
    n : array_like
        Number of all results, more than 0; same shape as `right`.

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
    ``(k + z^2/2 -+ z sqrt(k (n - k) / n + z^2/4)) / (n + z^2)`` with k right results and z = 1.96 (Wilson 1927,
    J. Am. Stat. Assoc. 22, 209).

    Examples
    --------
    >>> [[round(float(end), 3) for end in ends] for ends in wilson([9, 0], [10, 10])]
    [[0.596, 0.0], [0.982, 0.278]]
    """
    k, of = np.asarray(right, float), np.asarray(n, float)
    if not (of > 0).all():
        raise ValueError("n=0 results have no share and no interval; give one or more, or record for longer")
    share, weight = k / of, Z_95**2 / (of + Z_95**2)
    middle = share + (0.5 - share) * weight
    half = Z_95 * np.sqrt(share * (1 - share) * of + Z_95**2 / 4) / (of + Z_95**2)
    # The ends are exactly 0 without a right result, and 1 without a wrong one, whatever the rounding.
    low = np.where(k > 0, np.maximum(middle - half, 0.0), 0.0)
    high = np.where(k < of, np.minimum(middle + half, 1.0), 1.0)
    return low[()], high[()]  # numbers for numbers, arrays for arrays


def bootstrap(shares: Floats, n_periods: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % interval of the mean over seeds.

    The seeds are drawn with replacement, as many as there are, `DRAWS` times; the interval holds 95 % of the means.
    Where all seeds have the same share, all draws would be the same; then the interval is that of `wilson` over all
    periods.

    Parameters
    ----------
    shares : ndarray, shape (seeds,)
        Share of right periods of each seed, 0 .. 1.
    n_periods : int
        Number of periods of all seeds together.
    rng : numpy.random.Generator
        Chance for the draws.

    Returns
    -------
    low, high : float
        Ends of the interval, 0 .. 1.
    """
    if (shares == shares[0]).all():
        low, high = wilson(shares[0] * n_periods, n_periods)
        return float(low), float(high)
    means = rng.choice(shares, (DRAWS, shares.size)).mean(axis=1)
    return float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


def over_seeds(table: pd.DataFrame, by: list[str], right: str = "id_right") -> pd.DataFrame:
    """Return the accuracy of each condition with its 95 % interval over seeds.

    Parameters
    ----------
    table : DataFrame
        One row for each trial: the columns `by`, ``periods`` (count), and `right` (count of right periods).
        Trials without periods are left out.
    by : list of str
        Columns that tell conditions apart.
    right : str
        Column that counts right periods.

    Returns
    -------
    DataFrame
        One row for each condition, in the order of the table: the columns `by`; ``seeds`` and ``periods`` (counts);
        ``accuracy``, the mean of the seeds' shares; ``low`` and ``high``. The draws are the same every time.
    """
    rng = np.random.default_rng(0)
    seen = table[table["periods"] > 0]
    rows = []
    for key, group in seen.groupby(by, sort=False, dropna=False):
        shares = (group[right] / group["periods"]).to_numpy(float)
        periods = int(group["periods"].sum())
        low, high = bootstrap(shares, periods, rng)
        numbers = {"seeds": shares.size, "periods": periods, "accuracy": shares.mean(), "low": low, "high": high}
        rows.append({**dict(zip(by, key, strict=True)), **numbers})
    return pd.DataFrame(rows, columns=[*by, "seeds", "periods", "accuracy", "low", "high"])


def accuracy_curves(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Return the accuracy curves of the blinker and of the 2D marker from the trials of an experiment.

    Parameters
    ----------
    table : DataFrame
        As `over_seeds` takes it, with ``receiver``, ``frame_rule_2d``, ``id_right`` and ``marker_2d_right``.
    by : list of str
        Columns that tell conditions apart, ``distance_m`` among them.

    Returns
    -------
    DataFrame
        ``kind`` ("blinker" or "2d"), ``receiver``, ``frame_rule_2d``, and the columns of `over_seeds`.
    """
    both = {"blinker": "id_right", "2d": "marker_2d_right"}
    keys = ["receiver", "frame_rule_2d", *by]
    parts = [over_seeds(table, keys, right).assign(kind=kind) for kind, right in both.items()]
    return pd.concat(parts, ignore_index=True)[["kind", *parts[0].columns.drop("kind")]]


def last_reached(accuracies: Floats) -> npt.NDArray[np.int64]:
    """Return how many of the tested distances lie within the range.

    Parameters
    ----------
    accuracies : ndarray, shape (n, distances)
        Accuracies over rising distance, 0 .. 1.

    Returns
    -------
    ndarray of int, shape (n,)
        Number of distances up to the last one with an accuracy of one half or more; 0 where there is none.
    """
    above = accuracies >= HALF
    return np.asarray(np.where(above.any(axis=1), above.shape[1] - above[:, ::-1].argmax(axis=1), 0))


def ranges_m(distances_m: Floats, accuracies: Floats) -> Floats:
    """Return the range of each curve: the distance at which its accuracy falls below one half.

    It lies between the last tested distance with an accuracy of one half or more and the next tested distance, where
    the straight line between their accuracies crosses one half. The paper says of a distance that a marker "could be
    recognized" there (IV-A); we read that as an accuracy of one half or more.

    Parameters
    ----------
    distances_m : ndarray, shape (d,)
        Tested distances, rising [m].
    accuracies : ndarray, shape (n, d)
        One curve in each row, 0 .. 1.

    Returns
    -------
    ndarray, shape (n,)
        Ranges [m]; 0 where no distance reaches one half, the last distance where that one reaches it.

    Examples
    --------
    >>> ranges_m(np.array([1.0, 2.0, 4.0]), np.array([[1, 0.75, 0.25], [1, 1, 0.6], [0.2, 0.1, 0]]))
    array([3., 4., 0.])
    """
    n = last_reached(accuracies)
    rows = np.arange(len(accuracies))
    inner = (n > 0) & (n < distances_m.size)
    here, there = np.maximum(n - 1, 0), np.minimum(n, distances_m.size - 1)
    above, below = accuracies[rows, here], accuracies[rows, there]
    step = np.where(inner, (above - HALF) / np.where(inner, above - below, 1), 0)
    return np.asarray(np.where(n > 0, distances_m[here] + step * (distances_m[there] - distances_m[here]), 0.0))
