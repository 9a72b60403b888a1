"""How many events are likely in each part of a chip, learned from the data, and how well chips fit.

The mean count of a bin depends on its phase in the chip and on the *context* of the chip: the levels of the last
`MEMORY` chips, the newest one in bit 0. These means are called levels. They begin as a guess whose pulse shape is the
profile of all events over the chip, which needs no knowledge of what was sent; then they are estimated along the most
likely path. So they include latency, jitter, the difference between ON and OFF, tails and background.

Counts vary more than Poisson counts do: the events of an edge come in bursts, or an edge is missing altogether. The
dispersion measures this, as the variance over the mean along the path. All log-likelihoods are divided by it
(quasi-likelihood; Wedderburn 1974). So an edge of forty events whose number varies counts no more than a few
independent events, and a path that does not explain the events has a large dispersion and so a small evidence.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.sequential.fold import OFF, ON, PHASES, Floats, Folded

MEMORY = 3  # chips of a context
EDGE_FRACTION = 0.36  # of the chips begin with a rise, as many with a fall
LATE = 0.1  # guess: share of the pulse that comes one chip late
STRAY = 0.003  # guess: least mean of a bin without an edge, relative to one with an edge
GUESS_EVENTS = 3.0  # the guess has the weight of so many independent events ...
GUESS_CHIPS = 24.0  # ... but of no more than this many chips of each context

Contexts = npt.NDArray[np.int32]


def guess_levels(counts: Folded) -> Floats:
    """Guess the levels from the profile of all events over the chip.

    Parameters
    ----------
    counts : Folded

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
        pulse = np.maximum(smooth - floor, 0.05 * mean) / EDGE_FRACTION
        new = 1 if side == ON else 0
        for context in range(1 << MEMORY):
            before, last, now = (int((context >> back & 1) == new) for back in (2, 1, 0))
            is_edge, is_late = now and not last, now and last and not before
            levels[context, side] = floor + (pulse if is_edge else LATE * pulse.mean() if is_late else 0.0)
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
    edge = guess.max(axis=0).mean(axis=1)  # mean count of a bin of a chip with an edge
    weight = np.minimum(GUESS_EVENTS * dispersion / edge, GUESS_CHIPS)[None, :, None] * np.ones_like(guess)
    total, seen = guess * weight, weight.copy()
    np.add.at(total, context, counts.sums)
    np.add.at(seen, context, counts.exposure)
    levels: Floats = total / seen
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
    expected = levels[context]
    misfit = counts.squares - 2 * expected * counts.sums + counts.exposure * expected**2
    total = (counts.exposure * expected).sum(axis=(0, 2))
    dispersion: Floats = np.maximum(1.0, misfit.sum(axis=(0, 2)) / np.maximum(total, 1e-9))
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
    sides = (ON, OFF) if side is None else (side,)
    scores = np.zeros((counts.sums.shape[0], levels.shape[0]))
    for one in sides:
        part = counts.sums[:, one] @ np.log(levels[:, one]).T - counts.exposure[:, one] @ levels[:, one].T
        scores += part / dispersion[one]
    return scores
