"""Judge what the most likely path through frames says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bicode_lab.sequential.fold import OFF, ON, PHASES, Bins, Clock, Floats, Folded, fold
from bicode_lab.sequential.learning import Learned
from bicode_lab.sequential.levels import MEMORY, Contexts, chip_scores
from bicode_lab.sequential.paths import FIRST, best_contexts
from bicode_lab.sequential.reading import Reading
from bicode_lab.sequential.rivals import lamp_score, noise_score
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import build_nodes, frame_contexts
from bicode_lab.soft_receiver.viterbi import best_path, path_score

EQUAL_SCORE = 1.0  # two explanations whose log-likelihoods differ by less are equally good [nat]
START_CHIPS = 3  # of the start, its last ones: the tails of OFF edges do not reach so far
SLACK_PER_CHIP = 0.25  # what the noise of a chip adds to the best path of one polarity alone [nat]
LEVEL_COST = 1.0  # twice what a level gains by fitting chance along a given path (Wilks): the path is fitted, too [nat]
ONES = np.ones(2)


def judge(learned: Learned, contexts: Contexts, total: float, places: Floats, at: int, burst: float) -> Reading:
    """Judge whether the light as a whole sends frames of the code.

    Parameters
    ----------
    learned : Learned
    contexts : ndarray of int32, shape (chips,)
        Path through all frames.
    total : float
        Its log-likelihood [nat].
    places : ndarray, shape (frame_chips,)
        Log-likelihood of frames that begin at each chip [nat].
    at : int
        Chip at which they are taken to begin.
    burst : float
        Log-likelihood of bursts of clutter, see `rivals.burst_score` [nat].

    Returns
    -------
    Reading
        Without value, margin, conflict and begin, which belong to a single frame.
    """
    dispersion, n = learned.dispersion, places.size
    guessed = path_score(chip_scores(learned.frames, learned.guess, dispersion), contexts)
    away = np.abs((np.arange(n) - at + n // 2) % n - n // 2)
    learned_score = total - LEVEL_COST * 2 * PHASES * np.unique(contexts).size
    nothing = max(noise_score(learned.frames, dispersion), burst)
    return Reading(
        value=None,
        gain=max(guessed, learned_score) - nothing,
        guessed_gain=guessed - nothing,
        rival=total - burst,
        place=float(places[at % n] - places[away > 1].max()),
        dispersion=dispersion, levels=learned.levels,
    )  # fmt: skip


def against_lamps(reading: Reading, total: float, bins: Bins, line: LineCode) -> Reading:
    """Compare a reading with lamps of any rate, unless it is not believed anyway: that takes most of the time.

    Parameters
    ----------
    reading : Reading
    total : float
        Log-likelihood of its path [nat].
    bins : Bins
        The counts that it was made from.
    line : LineCode

    Returns
    -------
    Reading
    """
    if not reading.is_structured:
        return reading
    lamp = lamp_score(bins, reading.dispersion, line.frame_chips)
    return replace(reading, rival=min(reading.rival, total - lamp))


def decide(reading: Reading, frame: Folded, contexts: Contexts, line: LineCode) -> Reading:
    """Decide on the value of a frame.

    Of the frames that pass the check, the most likely one is taken if it explains the counts as well as the most likely
    path does, which need not pass.

    Parameters
    ----------
    reading : Reading
        What the light as a whole says.
    frame : Folded
        Counts of the frame from its chip `paths.FIRST` on.
    contexts : ndarray of int32, shape (frame_chips,)
        Its most likely path.
    line : LineCode

    Returns
    -------
    Reading
        With value, check, margin, conflict and contexts.
    """
    assert reading.levels is not None
    sides = [chip_scores(frame, reading.levels, reading.dispersion, side) for side in (ON, OFF)]
    both = sides[ON] + sides[OFF]
    value, check = line.decode(np.roll(contexts & 1, FIRST))
    others = frame_contexts(line, MEMORY)
    if others is None:
        reading = replace(reading, is_periodic=_is_periodic(contexts, line))
        nodes = build_nodes(line, MEMORY)
        _, margins = best_path(both, nodes, FIRST)
        conflict = max(best_contexts(one, line)[1] - path_score(one, contexts) for one in sides)
        slack = SLACK_PER_CHIP * len(contexts)
        return replace(reading, value=value, check=check, margin=float(margins.min()), conflict=conflict - slack,
                       contexts=contexts)  # fmt: skip
    chips = np.arange(len(both))
    each = np.stack([one[chips, others].sum(axis=1) for one in sides])
    sums = each.sum(axis=0)
    at = int(np.argmax(sums))
    loss = path_score(both, contexts) - float(sums[at])
    if loss > EQUAL_SCORE and not check:
        return replace(reading, value=value, check=False, margin=loss, contexts=contexts)
    value, check = line.decode(np.roll(others[at] & 1, FIRST))
    itself = (others == others[at]).all(axis=1)
    reading = replace(reading, is_periodic=_is_periodic(others[at], line))
    return replace(
        reading, value=value, check=check, contexts=others[at], margin=float(sums[at] - sums[~itself].max()),
        conflict=float((each.max(axis=1) - each[:, at]).max()),
    )  # fmt: skip


def start_share(frames: Folded, contexts: Contexts, line: LineCode) -> float:
    """Return the share of a usual edge's events that keep the clock in the last chips of the start.

    Parameters
    ----------
    frames : Folded
        Frames one after the other, each from its chip `paths.FIRST` on.
    contexts : ndarray of int32, shape (chips,)
        Path through all frames.
    line : LineCode

    Returns
    -------
    float
        Of ON and OFF the larger one: the amplitude of the pulse of an edge in the start over that in the data.
    """
    shares = []
    n_start = len(line.start_chips)
    place = (np.arange(contexts.size) + FIRST) % line.frame_chips
    still = (place < n_start) & (place >= n_start - START_CHIPS)
    for side, new in ((ON, 1), (OFF, 0)):
        levels = [(contexts >> back & 1) == new for back in range(MEMORY)]
        where = (levels[0] & ~levels[1], levels[0] & levels[1] & ~levels[2], still)  # chips with an edge, and after it
        *profiles, quiet = (
            frames.sums[which, side].sum(axis=0) / np.maximum(frames.exposure[which, side].sum(axis=0), 1e-9)
            for which in where
        )
        pulse = max((mean - mean.mean() for mean in profiles), key=lambda one: float(one @ one))
        power = float(pulse @ pulse)
        shares.append(float(pulse @ quiet) / power if power > 0 else 1.0)
    return max(shares)


def span(bins: Bins, clock: Clock, line: LineCode) -> tuple[int, int]:
    """Find the chips that hold all bins, with a frame of nothing on either side.

    Parameters
    ----------
    bins : Bins
    clock : Clock
    line : LineCode

    Returns
    -------
    first, n_chips : int
        Number of the first chip, and how many chips.
    """
    n = line.frame_chips
    first = int(np.floor(clock.rate * bins.chips[0] - clock.origin.max())) - n - 2
    last = int(np.ceil(clock.rate * bins.chips[-1] - clock.origin.min())) + n + 2
    return first, -(-(last - first - FIRST) // n) * n + FIRST + n - 1


def cut(bins: Bins, clock: Clock, at: int, line: LineCode) -> tuple[Folded, list[int]]:
    """Cut counts into frames.

    Parameters
    ----------
    bins : Bins
    clock : Clock
    at : int
        A chip, counted from the first of `span`, at which a frame begins.
    line : LineCode

    Returns
    -------
    frames : Folded
        The frames one after the other, each from its chip `paths.FIRST` on.
    begins : list of int
        Chip at which each begins, by the number of the clock.
    """
    n = line.frame_chips
    first, n_chips = span(bins, clock, line)
    begins = list(range(at % n, n_chips - n - FIRST + 1, n))
    counts = fold(bins, clock, n_chips, first)
    return counts.part(begins[0] + FIRST, n * len(begins)), [first + begin for begin in begins]


def _is_periodic(contexts: Contexts, line: LineCode) -> bool:
    """Return whether the data of a frame repeat after two bits or less."""
    data = np.roll(contexts & 1, FIRST)[len(line.start_chips) :]
    return bool((data[4:] == data[:-4]).all())
