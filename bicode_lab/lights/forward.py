"""Add up the probability of all that a light may have done, by the forward algorithm of hidden Markov models."""

from __future__ import annotations

import math

import numpy as np

from bicode_lab.kernels import njit

MOST_GAIN = 10.0  # of one tick
LEAST_REPEATS = 1.5
NEARLY = 0.8  # of the best


@njit(cache=True)
def sum_over_paths(weights, source, target, share, deed, start):  # type: ignore[no-untyped-def]
    """Return the log of the mean weight of all paths; `weights` has a row for each tick, a column for each deed."""
    n_states = start.size
    now, after = start.copy(), np.zeros(n_states)
    factor = np.empty(weights.shape[1])
    total = 0.0
    for tick in range(weights.shape[0]):
        most = weights[tick, 0]
        for k in range(1, weights.shape[1]):
            most = max(most, weights[tick, k])
        for k in range(weights.shape[1]):
            factor[k] = math.exp(weights[tick, k] - most)
        after[:] = 0.0
        for k in range(source.size):
            after[target[k]] += now[source[k]] * share[k] * factor[deed[k]]
        mass = 0.0
        for state in range(n_states):
            mass += after[state]
        if mass <= 0.0:
            return -math.inf
        for state in range(n_states):
            now[state] = after[state] / mass
        total += math.log(mass) + most
    return total


@njit(cache=True)
def likely_repetitions(weights, least, most):  # type: ignore[no-untyped-def]
    """Return after how many ticks the deeds repeat: the shortest likely time, and the likeliest; 0 for none.

    What is compared is how much more probable a rise, and a fall, is than nothing.
    """
    n = weights.shape[0]
    gain = np.empty((n, 2))
    for tick in range(n):
        for side in range(2):
            gain[tick, side] = min(max(weights[tick, 1 + side] - weights[tick, 0], -MOST_GAIN), MOST_GAIN)
    for side in range(2):
        gain[:, side] -= gain[:, side].mean()
    longest = min(most, int(n / LEAST_REPEATS))
    if longest < least:
        return 0, 0
    heights = np.empty(longest - least + 1)
    for lag in range(least, longest + 1):
        total = 0.0
        for tick in range(n - lag):
            total += gain[tick, 0] * gain[tick + lag, 0] + gain[tick, 1] * gain[tick + lag, 1]
        heights[lag - least] = total / (n - lag)
    best = int(np.argmax(heights))
    if heights[best] <= 0:
        return 0, 0
    first = best
    for k in range(best, -1, -1):
        if heights[k] >= NEARLY * heights[best]:
            first = k
    return least + first, least + best


@njit(cache=True)
def fold(weights, lag):  # type: ignore[no-untyped-def]
    """Return the sum of the weights of all ticks that are whole repetitions apart, shape (lag, deeds)."""
    total = np.zeros((lag, weights.shape[1]))
    for tick in range(weights.shape[0]):
        total[tick % lag] += weights[tick]
    return total
