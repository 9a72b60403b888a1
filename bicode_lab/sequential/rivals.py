"""What else the events could be: noise, bursts of clutter, or a lamp that flickers at any rate.

Each rival explains the same counts without a packet; its log-likelihood is compared with that of the packet.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import PHASES, Bins, Floats, Folded
from bicode_lab.sequential.levels import GUESS_CHIPS, GUESS_EVENTS

LOWEST, HIGHEST = 0.02, 1.25  # rates of lamps that are tried [cycles per chip]
N_PEAKS = 6  # strongest rates that are tried
PADDING = 4
FINER = 9  # rates that are tried within a step of the spectrum
LAMP_PHASES = 2 * PHASES  # bins of a lamp's cycle, at least
FASTER = 1.5  # a lamp this much faster than frames has bins as short as those of a chip; a slower one could be a packet
BURST_CHIPS = 4.0


def noise_score(counts: Folded, dispersion: Floats) -> float:
    """Return the log-likelihood of events that come at any time.

    Parameters
    ----------
    counts : Folded
    dispersion : ndarray, shape (2,)
        1 or more.

    Returns
    -------
    float
        Up to the same constant as `levels.chip_scores`.
    """
    rate = counts.mean_rate()
    each = counts.sums.sum(axis=(0, 2)) * np.log(rate) - counts.exposure.sum(axis=(0, 2)) * rate
    return float((each / dispersion).sum())


def burst_score(bins: Bins, dispersion: Floats) -> float:
    """Return the log-likelihood of events whose rate changes from one `BURST_CHIPS` to the next.

    Parameters
    ----------
    bins : Bins
    dispersion : ndarray, shape (2,)
        1 or more.

    Returns
    -------
    float
    """
    block = ((bins.chips - bins.chips[0]) / BURST_CHIPS).astype(np.int64)
    score: float = _grouped_score(bins.counts, block, int(block[-1]) + 1, dispersion)
    return score


def lamp_score(bins: Bins, dispersion: Floats, n_chips: int) -> float:
    """Return the log-likelihood of a lamp: pulses of any shape that repeat at the rate that explains most.

    Parameters
    ----------
    bins : Bins
    dispersion : ndarray, shape (2,)
        1 or more.
    n_chips : int
        Length of a frame [chips].

    Returns
    -------
    float
    """
    best = -np.inf
    rates, step = _strongest_rates(bins)
    for rate in (rates[:, None] + step * np.linspace(-0.5, 0.5, FINER)).ravel():  # short pulses need an exact rate
        n = max(LAMP_PHASES, int(np.ceil(PHASES / rate))) if rate * n_chips > FASTER else LAMP_PHASES
        best = max(best, _lamp_score(bins.chips, bins.counts, rate, n, dispersion))
    return best


def _strongest_rates(bins: Bins) -> tuple[Floats, float]:
    """Return the rates of the strongest lines, and those of chips, bits and pairs of bits, with the step between them.

    Rates and the step between them are in cycles per chip.
    """
    step = 1 / PHASES
    place = np.round((bins.chips - bins.chips[0]) / step).astype(np.int64)
    n = int(place[-1]) + 1
    size = int(2 ** np.ceil(np.log2(PADDING * n)))
    power = np.zeros(size // 2 + 1)
    for side in range(2):
        count = np.bincount(place, bins.counts[:, side], n)
        squares = float((count**2).sum())
        if squares:
            power += np.abs(np.fft.rfft(count - count.mean(), size)) ** 2 / squares
    rates = np.arange(power.size) / (size * step)
    inside = (rates > max(LOWEST, 2 / (n * step))) & (rates < HIGHEST)
    is_peak = np.zeros(power.size, bool)
    is_peak[1:-1] = (power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])
    peaks = np.flatnonzero(is_peak & inside)
    top = peaks[np.argsort(-power[peaks], kind="stable")[:N_PEAKS]]
    return np.concatenate([rates[top], [0.25, 0.5, 1.0]]), float(rates[1])


@njit(cache=True, nogil=True)
def _lamp_score(chips, counts, rate, n, dispersion):  # type: ignore[no-untyped-def]
    """Return the log-likelihood if the mean count depends on the phase of a lamp only, in `n` bins of its cycle."""
    group = np.empty(chips.size, np.int64)
    for k in range(chips.size):
        turns = chips[k] * rate
        group[k] = min(np.int64((turns - np.floor(turns)) * n), n - 1)
    return _grouped_score(counts, group, n, dispersion)


@njit(cache=True, nogil=True)
def _grouped_score(counts, group, n, dispersion):  # type: ignore[no-untyped-def]
    """Return the log-likelihood if the mean count depends on the group of a bin only."""
    seen, total = np.zeros(n), np.zeros((2, n))
    for k in range(group.size):
        seen[group[k]] += 1
        total[0, group[k]] += counts[k, 0]
        total[1, group[k]] += counts[k, 1]
    score = 0.0
    for side in range(2):
        mean = (total[side].sum() + 0.5) / (group.size + 1)
        weight = min(GUESS_EVENTS * dispersion[side] / mean, GUESS_CHIPS * PHASES)
        for j in range(n):
            rate = (total[side, j] + mean * weight) / (seen[j] + weight)
            score += (total[side, j] * np.log(rate) - seen[j] * rate) / dispersion[side]
    return score
