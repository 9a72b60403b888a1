"""The range of a curve of accuracy over distance."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

HALF = 0.5  # a range ends where the accuracy falls below this

Floats = npt.NDArray[np.float64]


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
    # Where the last distance is reached, it is also the next one: no step. Where none is reached, this is not used.
    here, there = n - 1, np.minimum(n, distances_m.size - 1)
    above, below = accuracies[rows, here], accuracies[rows, there]
    step = np.divide(above - HALF, above - below, out=np.zeros(n.shape), where=above != below)
    return np.asarray(np.where(n > 0, distances_m[here] + step * (distances_m[there] - distances_m[here]), 0.0))


def range_with_ends(distances_m: Floats, accuracies: npt.ArrayLike, ends: npt.ArrayLike) -> tuple[float, float, float]:
    """Return the range of a curve with its interval.

    An end of the interval is the range of the curve through the lower, or the upper, ends of the accuracies: these
    distances cannot be told from the true range by the accuracies measured there.

    Parameters
    ----------
    distances_m : ndarray, shape (d,)
        Tested distances, rising [m].
    accuracies : array_like, shape (d,)
        Accuracies, 0 .. 1.
    ends : array_like, shape (d, 2)
        Lower and upper ends of their intervals.

    Returns
    -------
    range_m, low_m, high_m : float
        As `ranges_m` defines them [m]; the level of the interval is that of the accuracies.

    Examples
    --------
    >>> range_with_ends(np.array([1.0, 2.0, 4.0]), [1, 0.75, 0.25], [[0.8, 1], [0.5, 0.9], [0.1, 0.4]])
    (3.0, 2.0, 3.6)
    """
    curves = np.column_stack([np.asarray(accuracies, float), np.asarray(ends, float)]).T
    middle, low, high = ranges_m(distances_m, curves).tolist()
    return middle, low, high
