"""How the events of one polarity lie around the ticks of a clock: their delays and their counts.

An edge makes a number of events that varies from edge to edge (negative binomial: a Poisson count whose mean varies).
Their delays may have any distribution, since pixels differ, follow slowly and fire again after their refractory period.
Events by chance come at any time.
"""

from __future__ import annotations

import math

import numpy as np

from bicode_lab.kernels import njit

ROUNDS = 8
BINS, ZOOM = 32, 5  # bins of a look at the cycle, and how many of them the next look spans
FINEST_BIN_US = 8.0
NEAREST, WITHIN = 0.3, 0.385  # this share of a normal distribution lies within so many standard deviations
CENTRINGS, CENTRE_REACH = 3, 2.0  # widths
NEAR = 0.25  # cycles
OUTSIDE = 4.0  # widths of the core
REFINEMENTS = 4
LEAST_WIDTH_US = 2.0  # times are whole microseconds
MOST_WIDTH = 0.29  # cycles: that of events that come evenly
SCALES, PER_OCTAVE = 30, 2  # of delays: from 2 us to 65 ms
PRIOR = 3.0  # events that all bins of the delays are taken to hold beforehand
LEAST_COUNT, LEAST_STRAY = 0.3, 0.005
EVEN_COUNTS, UNEVEN_COUNTS = 30.0, 1.0  # limits of the shape of the counts' distribution; a Poisson count has no limit


@njit(cache=True)
def fit_edges(t_us, length_us, period_us):  # type: ignore[no-untyped-def]
    """Return time of tick 0, width, events of an edge and by chance, and the evidence of each tick for both."""
    late = np.empty(t_us.size)
    middle, width = _middle(t_us, period_us, late)
    density = _densities(late, period_us)
    phase_us = middle * period_us
    first = int(np.floor(-phase_us / period_us + 0.5))
    last = int(np.floor((length_us - phase_us) / period_us + 0.5))
    n_ticks = max(last - first + 1, 1)
    counts, gain = np.zeros(n_ticks), np.zeros(n_ticks)
    for i in range(t_us.size):
        place = (t_us[i] - phase_us) / period_us
        tick = int(np.floor(place + 0.5))
        k = min(max(tick - first, 0), n_ticks - 1)
        counts[k] += 1
        gain[k] += math.log(density[i])
    count, stray, shape = _split(counts, gain)
    rate = max(t_us.size / max(length_us, period_us) * period_us, 1e-9)
    edge, chance = np.empty(n_ticks), np.empty(n_ticks)
    for k in range(n_ticks):
        seen, whole = _seen(phase_us / period_us + first + k, length_us / period_us, width)
        even = -rate * seen + counts[k] * math.log(rate)  # of a Poisson process; the factorials cancel
        edge[k] = _log_count(counts[k], count * whole + stray * seen + LEAST_STRAY, shape) + gain[k] - even
        chance[k] = _log_count(counts[k], stray * seen + LEAST_STRAY, UNEVEN_COUNTS) - even
    width = min(width, MOST_WIDTH)
    return phase_us + first * period_us, width, count, stray, edge, chance


@njit(cache=True)
def _fullest(t_us, period_us, centre, step):  # type: ignore[no-untyped-def]
    """Return the middle of the fullest three of `BINS` bins, which span a part of the cycle around a place [cycles]."""
    counts = np.zeros(BINS + 2)
    for i in range(t_us.size):
        place = ((t_us[i] / period_us - centre + 0.5) % 1.0 - 0.5) / step + 0.5
        if 0.0 <= place < 1.0:
            counts[int(place * BINS) + 1] += 1.0
    if step == 1.0:
        counts[0], counts[BINS + 1] = counts[BINS], counts[1]
    best, most = 1, -1.0
    for k in range(1, BINS + 1):
        near = counts[k - 1] + counts[k] + counts[k + 1]
        if near > most:
            best, most = k, near
    return centre + ((best - 0.5) / BINS - 0.5) * step


@njit(cache=True)
def _middle(t_us, period_us, late):  # type: ignore[no-untyped-def]
    """Return where in a cycle most events come, and the width of the core around it [cycles].

    `late` is filled with the distance of each event from there. Stray events do not move the place: it is the fullest
    of the bins, looked at twice, and the width is that of the nearest part of the events.
    """
    centre = _fullest(t_us, period_us, 0.0, 1.0)
    step, last = 1.0, BINS * FINEST_BIN_US / period_us
    while step > last:
        step = max(step * ZOOM / BINS, last)
        centre = _fullest(t_us, period_us, centre, step)
    width = 0.0
    for _ in range(CENTRINGS):
        for i in range(t_us.size):
            late[i] = (t_us[i] / period_us - centre + 0.5) % 1.0 - 0.5
        size = np.sort(np.abs(late))
        width = max(size[int(NEAREST * (size.size - 1))] / WITHIN, LEAST_WIDTH_US / period_us)
        near = late[np.abs(late) <= CENTRE_REACH * width]
        if near.size:
            centre += np.median(near)
    for i in range(t_us.size):
        late[i] = (t_us[i] / period_us - centre + 0.5) % 1.0 - 0.5
    return centre, width


@njit(cache=True)
def refine_period(on_us, off_us, period_us):  # type: ignore[no-untyped-def]
    """Return the period near a period at which events lie best on whole ticks; in each round they have to be nearer."""
    near = NEAR
    for _ in range(REFINEMENTS):
        moment = weight = spread = 0.0
        for side in range(2):
            t_us = on_us if side else off_us
            late = np.empty(t_us.size)
            middle, width = _middle(t_us, period_us, late)
            n = first = second = total = product = 0.0
            for i in range(t_us.size):
                place = t_us[i] / period_us - middle
                tick = math.floor(place + 0.5)
                away = place - tick
                if abs(away) < near:
                    n += 1.0
                    first += tick
                    second += tick * tick
                    total += away
                    product += tick * away
            if n > 1:
                moment += product - first * total / n
                weight += second - first * first / n
                spread = max(spread, width)
        if weight > 0:
            period_us *= 1.0 + moment / weight
        near = min(max(OUTSIDE * spread, LEAST_WIDTH_US / period_us), NEAR)
    return period_us


@njit(cache=True)
def _seen(tick, length, width):  # type: ignore[no-untyped-def]
    """Return the share of a tick's cycle, and of its edge, that lies between 0 and a length; all in cycles."""
    low, high = max(tick - 0.5, 0.0), min(tick + 0.5, length)
    after = 0.5 * (1 + math.erf(tick / (width * math.sqrt(2.0))))
    before = 0.5 * (1 + math.erf((length - tick) / (width * math.sqrt(2.0))))
    return max(high - low, 0.0), max(after + before - 1.0, 0.0)


@njit(cache=True)
def _densities(late, period_us):  # type: ignore[no-untyped-def]
    """Return the density of the delay of each event [1/cycle], told from the delays of all others.

    Bins are narrow near the middle, and the farther the wider. They are as wide as the clock says only at its border,
    so a clock gains nothing from being faster than another.
    """
    n_bins = 2 * SCALES + 1
    counts = np.zeros(n_bins)
    place = np.empty(late.size, np.int64)
    for i in range(late.size):
        size = min(abs(late[i]), 0.4999) * period_us
        scale = 0
        if size >= LEAST_WIDTH_US:
            scale = min(int(PER_OCTAVE * math.log2(size / LEAST_WIDTH_US)) + 1, SCALES)
        place[i] = SCALES + (scale if late[i] > 0 else -scale)
        counts[place[i]] += 1.0
    used, width = 0, np.empty(n_bins)
    for k in range(n_bins):
        scale = abs(k - SCALES)
        low = LEAST_WIDTH_US * 2.0 ** ((scale - 1) / PER_OCTAVE) if scale else -LEAST_WIDTH_US
        high = min(LEAST_WIDTH_US * 2.0 ** (scale / PER_OCTAVE), 0.5 * period_us)
        width[k] = max(high - low, 0.0) / period_us
        used += width[k] > 0
    for k in range(n_bins):
        counts[k] += PRIOR / used if width[k] > 0 else 0.0
    for side in (1, -1):
        _fall_outwards(counts, width, side)
    density = np.empty(late.size)
    for i in range(late.size):
        k = place[i]
        density[i] = max(counts[k] - 1.0, 1e-3) / (late.size - 1.0 + PRIOR) / width[k]
    return density


@njit(cache=True)
def _fall_outwards(counts, width, side):  # type: ignore[no-untyped-def]
    """Join neighbouring bins until the density falls from the middle outwards: an edge has one burst of events.

    The counts and the widths of joined bins become those of all of them together.
    """
    begin, mass, size = np.empty(SCALES, np.int64), np.empty(SCALES), np.empty(SCALES)
    n = 0
    for scale in range(1, SCALES + 1):
        k = SCALES + side * scale
        if width[k] <= 0:
            break
        begin[n], mass[n], size[n] = scale, counts[k], width[k]
        n += 1
        while n > 1 and mass[n - 1] * size[n - 2] > mass[n - 2] * size[n - 1]:
            mass[n - 2] += mass[n - 1]
            size[n - 2] += size[n - 1]
            n -= 1
    for block in range(n):
        end = begin[block + 1] if block < n - 1 else SCALES + 1
        for scale in range(begin[block], end):
            k = SCALES + side * scale
            if width[k] > 0:
                counts[k], width[k] = mass[block], size[block]


@njit(cache=True)
def _split(counts, gain):  # type: ignore[no-untyped-def]
    """Return mean events of an edge and by chance, and the shape of the counts of edges."""
    held = np.sort(counts[counts > 0])
    usual, total, half = 1.0, 0.0, 0.5 * held.sum()
    for value in held:
        total += value
        usual = value
        if total >= half:
            break
    count, stray, share, shape = max(usual, 1.0), max(0.1 * counts.mean(), 0.02), 0.5, 3.0
    for _ in range(ROUNDS):
        n_edges = n_on = n_square = n_stray = 0.0
        for k in range(counts.size):
            edge = math.log(share) + _log_count(counts[k], count + stray, shape) + gain[k]
            none = math.log(1.0 - share) + _log_count(counts[k], stray, UNEVEN_COUNTS)
            own = 1.0 / (1.0 + math.exp(min(max(none - edge, -60.0), 60.0)))
            n_edges += own
            n_on += own * counts[k]
            n_square += own * counts[k] ** 2
            n_stray += (1.0 - own) * counts[k]
        share = min(max(n_edges / counts.size, 0.02), 0.98)
        mean = n_on / max(n_edges, 0.5)
        more = n_square / max(n_edges, 0.5) - mean**2 - mean  # variance over that of a Poisson count
        shape = min(max(mean**2 / max(more, 1e-9), UNEVEN_COUNTS), EVEN_COUNTS)
        count = max(mean, LEAST_COUNT)
        stray = min(max((n_stray + 0.1) / (counts.size - n_edges + 5.0), LEAST_STRAY), count)
    return count, stray, shape


@njit(cache=True)
def _log_count(count, mean, shape):  # type: ignore[no-untyped-def]
    """Return the log of a negative binomial probability, without the factorial of the count."""
    return (
        math.lgamma(count + shape) - math.lgamma(shape) + shape * math.log(shape / (shape + mean))
        + count * math.log(mean / (shape + mean))
    )  # fmt: skip
