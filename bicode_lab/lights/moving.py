"""Tell what is no light: an edge that moves over the pixels one after the other, and events that come by chance."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2

from bicode_lab.events import Events

LEAST_EVENTS = 8
MOST_EVENTS = 2_000
Z_999 = 3.29
EVENTS_A_BIN = 4
FREE = 3  # parameters of a plane: time at a place, and how it changes along x and y


def moving_gain(events: Events) -> float:
    """Return by how much the place of the events tells their times: a log-likelihood ratio, 0 or more.

    For each polarity a plane t = a + b x + c y is fitted. A light that blinks as a whole has the same times at all
    places, and gains nothing.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)

    Returns
    -------
    float
        Natural logarithm; what the free parameters gain by chance is taken off.
    """
    gain = 0.0
    for polarity in (0, 1):
        mine = events[events["p"] == polarity]
        mine = mine[:: math.ceil(mine.size / MOST_EVENTS)] if mine.size else mine
        if mine.size < LEAST_EVENTS:
            continue
        t_us = mine["t"] - mine["t"].mean()
        places = np.column_stack([mine["x"] - mine["x"].mean(), mine["y"] - mine["y"].mean()])
        planes, *_ = np.linalg.lstsq(places, t_us, rcond=None)
        whole = float(t_us @ t_us)
        rest = float(np.square(t_us - places @ planes).sum())
        if whole > 0:
            n_times = np.unique(mine["t"]).size  # events of one time say it once
            least = 1.0 / n_times  # the times are whole microseconds, and a fit of few is never perfect
            gain += max(0.0, -0.5 * n_times * math.log(max(rest / whole, least)) - 0.5 * FREE * math.log(n_times))
    return gain


def comes_by_chance(events: Events) -> bool:
    """Return whether the events may come by chance: their polarities in any order, and as many in each stretch of time.

    Two tests at the level of 1 in 1000 each: the number of runs of one polarity (Wald and Wolfowitz), and the index of
    dispersion of the counts.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)

    Returns
    -------
    bool

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> t = np.arange(0, 4000, 20)
    >>> comes_by_chance(make_events(t * 0, t * 0, t // 200 % 2, t))
    False
    """
    n, n_on = events.size, int(np.count_nonzero(events["p"] > 0))
    product = 2.0 * n_on * (n - n_on)
    if product > 0 and n > 2:
        runs = 1 + int(np.count_nonzero(np.diff(events["p"])))
        spread = math.sqrt(max(product * (product - n) / (n * n * (n - 1.0)), 1e-9))
        if abs(runs - product / n - 1) > Z_999 * spread + 1:
            return False
    n_bins = n // EVENTS_A_BIN
    if n_bins < 2:
        return True
    span_us = int(events["t"][-1] - events["t"][0]) + 1
    counts = np.bincount((events["t"] - events["t"][0]) * n_bins // span_us, minlength=n_bins)
    dispersion = float(np.square(counts - counts.mean()).sum() / counts.mean())
    return bool(dispersion < chi2.ppf(0.999, n_bins - 1))
