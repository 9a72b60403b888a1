"""How many events are likely in each part of a chip, learned from the data, and how well chips fit.

The mean count of a bin depends on its phase in the chip and on the *context* of the chip: the levels of the last
`MEMORY` chips, the newest one in bit 0. These means are called levels. They begin as a guess whose pulse shape is the
profile of all events over the chip, which needs no knowledge of what was sent; then they are estimated along the most
likely path. So they include latency, jitter, the difference between ON and OFF, tails and background. Where chips are
shorter than the pixels' response, much of a pulse comes one chip late. A guess without that leads to other paths and
other levels, from which learning does not find back, so several guesses are made, see `TAILS`.

Counts vary more than Poisson counts do: the events of an edge come in bursts, or an edge is missing altogether. The
dispersion measures this, as the variance over the mean along the path. All log-likelihoods are divided by it
(quasi-likelihood; Wedderburn 1974). So an edge of forty events whose number varies counts no more than a few
independent events, and a path that does not explain the events has a large dispersion and so a small evidence.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import OFF, ON, PHASES, Floats, Folded

MEMORY = 3  # chips of a context
EDGE_FRACTION = 0.36  # of the chips begin with a rise, as many with a fall ...
LASTING = 0.4  # ... and this fraction of them is followed by a chip of the same level
TAILS = (0.1, 2.5)  # guesses: events of an edge in the chip after it, relative to those in its own chip
STRAY = 0.003  # guess: least mean of a bin without an edge, relative to one with an edge
GUESS_EVENTS = 3.0  # the guess has the weight of so many independent events ...
GUESS_CHIPS = 24.0  # ... but of no more than this many chips of each context

Contexts = npt.NDArray[np.int32]


def guess_levels(counts: Folded, tail: float) -> Floats:
    """Guess the levels from the profile of all events over the chip.

    Parameters
    ----------
    counts : Folded
    tail : float
        Events of an edge in the chip after it, relative to those in its own chip.

    Returns
    -------
    ndarray, shape (2**MEMORY, 2, PHASES)
        Mean count of a bin, above 0.
    """
    levels = np.empty((1 << MEMORY, 2, PHASES))
    total, seen = counts.sums.sum(axis=0), counts.exposure.sum(axis=0)
    for side in (ON, OFF):
        profile = (total[side] + 0.5 / PHASES) / np.maximum(seen[side], 1)
        smooth = (np.roll(profile, 1) + 2 * profile + np.roll(profile, -1)) / 4
        mean = profile.mean()
        floor = max(0.7 * smooth.min(), STRAY * mean / EDGE_FRACTION)
        pulse = np.maximum(smooth - floor, 0.05 * mean) / (EDGE_FRACTION * (1 + LASTING * tail))
        new = 1 if side == ON else 0
        for context in range(1 << MEMORY):
            before, last, now = (int((context >> back & 1) == new) for back in (2, 1, 0))
            is_edge, is_late = now and not last, now and last and not before
            levels[context, side] = floor + (pulse if is_edge else tail * pulse.mean() if is_late else 0.0)
    return levels


def estimate_levels(counts: Folded, context: Contexts, guess: Floats, dispersion: Floats) -> Floats:
    """Estimate the levels along a path.

    Parameters
    ----------
    counts : Folded
    context : ndarray of int32, shape (chips,)
    guess : ndarray, shape (2**MEMORY, 2, PHASES)
        First guess, which keeps a weight.
    dispersion : ndarray, shape (2,)
        1 or more.

    Returns
    -------
    ndarray, shape (2**MEMORY, 2, PHASES)
    """
    levels = np.empty_like(guess)
    estimate(counts.sums, counts.exposure, context, guess, dispersion, levels)
    return levels


def find_dispersion(counts: Folded, levels: Floats, context: Contexts) -> Floats:
    """Measure how much more the counts vary along a path than Poisson counts do.

    Parameters
    ----------
    counts : Folded
    levels : ndarray, shape (2**MEMORY, 2, PHASES)
    context : ndarray of int32, shape (chips,)

    Returns
    -------
    ndarray, shape (2,)
        Of ON and OFF: sum of (count - mean)^2 over the sum of the means, 1 or more.
    """
    dispersion = np.empty(2)
    disperse(counts.sums, counts.squares, counts.exposure, levels, context, dispersion)
    return dispersion


def chip_scores(counts: Folded, levels: Floats, dispersion: Floats, side: int | None = None) -> Floats:
    """Compute the log-likelihood of each chip under each context, up to a constant.

    Parameters
    ----------
    counts : Folded
    levels : ndarray, shape (2**MEMORY, 2, PHASES)
    dispersion : ndarray, shape (2,)
        Of ON and OFF, by which the log-likelihoods are divided.
    side : {ON, OFF}, optional
        Counts of one polarity only; None takes both.

    Returns
    -------
    ndarray, shape (chips, 2**MEMORY)
        Sum of (count * ln(mean) - mean) / dispersion over the bins of the chip.
    """
    weight = 1 / dispersion
    if side is not None:
        weight[1 - side] = 0.0
    scores = np.empty((counts.sums.shape[0], levels.shape[0]))
    score(counts.sums, counts.exposure, levels, weight, scores)
    return scores


@njit(cache=True, nogil=True)
def estimate(sums, exposure, context, guess, dispersion, levels):  # type: ignore[no-untyped-def]
    """Fill in the levels along a path, see `estimate_levels`."""
    n_contexts = guess.shape[0]
    for side in range(2):
        edge = 0.0
        for phase in range(PHASES):
            edge += guess[:, side, phase].max() / PHASES
        weight = min(GUESS_EVENTS * dispersion[side] / edge, GUESS_CHIPS)
        for phase in range(PHASES):
            total, seen = guess[:, side, phase] * weight, np.full(n_contexts, weight)
            for k in range(context.size):
                total[context[k]] += sums[k, side, phase]
                seen[context[k]] += exposure[k, side, phase]
            levels[:, side, phase] = total / seen


@njit(cache=True, nogil=True)
def disperse(sums, squares, exposure, levels, context, dispersion):  # type: ignore[no-untyped-def]
    """Fill in the dispersion of ON and OFF, see `find_dispersion`."""
    for side in range(2):
        misfit = total = 0.0
        for k in range(context.size):
            for phase in range(PHASES):
                mean, n = levels[context[k], side, phase], exposure[k, side, phase]
                misfit += squares[k, side, phase] - 2 * mean * sums[k, side, phase] + n * mean**2
                total += n * mean
        dispersion[side] = max(1.0, misfit / max(total, 1e-9))


@njit(cache=True, nogil=True)
def score(sums, exposure, levels, weight, scores):  # type: ignore[no-untyped-def]
    """Fill in the log-likelihoods of chips, each polarity with its weight, see `chip_scores`."""
    logs = np.log(levels)
    for k in range(sums.shape[0]):
        for context in range(levels.shape[0]):
            scores[k, context] = 0.0
            for side in range(2):
                part = 0.0
                for phase in range(PHASES):
                    part += sums[k, side, phase] * logs[context, side, phase]
                    part -= exposure[k, side, phase] * levels[context, side, phase]
                scores[k, context] += part * weight[side]
