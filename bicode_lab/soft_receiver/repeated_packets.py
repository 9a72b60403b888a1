"""Read a marker that sends the same packet again and again, from the evidence of all its packets together.

The marks of a track, over one period of 33 ms or over a second, are folded to the length of one frame with the tracked
clock. This gives one frame to read, however few events each packet made:

1. Every place at which the frame may begin is scored by its most likely path, with guessed levels. The path knows the
   start, and that every bit is two unlike chips.
2. Around the best place the levels are learned, and the path is found again.
3. The check of the code decides. If all bits are alike, the frame may as well begin one chip earlier or later with all
   bits inverted: then the check decides, or the margin is small.

A wrong ID would be worse than none, so a reading is believed only if it passes four limits (`doubt`). Gain and margin
are natural logarithms of likelihood ratios:

    gain            of the path with guessed levels over marks that come at any time (noise has ln(448 places x
                    2048 data words) = 14 to choose from); and, with levels learned for both, over a lamp that does the
                    same every two or four chips
    margin          of what is read over everything else that passes the check (over the same with its least sure bit
                    inverted, if the code has too many frames to try them all), and of the best place over any other
    support         fraction of the marks that lie where an edge of their polarity explains them
    start_activity  marks per chip in the quiet start over those in the data: a lamp that flickers at the chip rate
                    has no quiet start
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bicode_lab.recognition.decode import Reason
from bicode_lab.soft_receiver.clock import Marks, find_chips
from bicode_lab.soft_receiver.levels import (
    GUESS_CHIPS,
    NO_MARK,
    OFF,
    ON,
    PHASES,
    Floats,
    MarkCounts,
    count_marks,
    estimate_levels,
    guess_levels,
    log_likelihoods,
)
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.nodes import Nodes, build_nodes, frame_contexts
from bicode_lab.soft_receiver.places import MEMORY, roll_to_place, score_places
from bicode_lab.soft_receiver.viterbi import best_path, path_score

ROUNDS = 3
EQUAL_SCORE = 1.0  # two places whose scores differ by less explain the marks equally well
SEARCH_BINS = 3  # the best place is searched for again this far around its first guess
MIN_GAIN = 13.0
MIN_MARGIN = 8.0
MIN_SUPPORT = 0.85
MAX_START_ACTIVITY = 0.1


@dataclass(frozen=True)
class Reading:
    """What folded marks say; the top of this file explains the last four.

    Parameters
    ----------
    value : int or None
        Value on the most likely path; None if there are no marks.
    check : bool
        Whether the check of the code holds.
    start_us : float
        Start of the first whole frame, from the start of the first bin on [us].
    error_ppm : float
        How much longer the transmitter's chip is than nominal [1e-6].
    gain, margin : float
        Natural logarithms of likelihood ratios.
    support : float
        Fraction 0 .. 1.
    start_activity : float
        Ratio, 0 or more.
    """

    value: int | None
    check: bool = False
    start_us: float = 0.0
    error_ppm: float = 0.0
    gain: float = 0.0
    margin: float = 0.0
    support: float = 0.0
    start_activity: float = 0.0


def doubt(reading: Reading) -> Reason | None:
    """Tell why a reading is not believed.

    Parameters
    ----------
    reading : Reading

    Returns
    -------
    str or None
        One of `decode.REASONS`, the words of the paper's receiver; None if the reading is believed.

    Examples
    --------
    >>> doubt(Reading(None)), doubt(Reading(37, check=True, gain=90, margin=40, support=0.99))
    ('no_events', None)
    """
    if reading.value is None:
        return "no_events"
    if reading.gain < MIN_GAIN or reading.start_activity > MAX_START_ACTIVITY:
        return "no_start"
    if reading.margin < MIN_MARGIN or reading.support < MIN_SUPPORT:
        return "manchester"
    return None if reading.check else "checksum"


def read_repeated_packets(marks: Marks, bin_us: float, line: LineCode) -> Reading:
    """Read marks as one frame that is sent over and over.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        Marks of one region, see `clock.lead_marks`.
    bin_us : float
        Length of a bin [us].
    line : LineCode
        A code that repeats its frame without a pause and starts it with `places.MEMORY` equal chips or more.

    Returns
    -------
    Reading
        The most likely value; `doubt` tells whether to believe it.
    """
    if not marks.any():
        return Reading(None)
    n = line.frame_chips
    chips, error_ppm, _ = find_chips(marks, bin_us, line.chip_us)
    counts = count_marks(marks, chips, 0, n, fold_chips=n)
    nodes = build_nodes(line, MEMORY)
    guess = guess_levels(counts, MEMORY)
    places = score_places(counts, guess, nodes)
    place, levels = _learn(counts, guess, nodes, int(np.argmax(places)))
    places = score_places(counts, levels, nodes)
    tried = [_read_at(at, counts, (guess, levels), places, line) for at in (place, place + PHASES, place - PHASES)]
    at, score, reading = max(tried, key=lambda one: (one[2].check and one[1] > tried[0][1] - EQUAL_SCORE, one[1]))
    for _, other_score, other in tried:
        if other.check and other.value != reading.value:
            reading = replace(reading, margin=min(reading.margin, score - other_score))
    return replace(reading, start_us=_start_us(chips, at, bin_us), error_ppm=error_ppm)


def _read_at(
    place: int, folded: MarkCounts, levels: tuple[Floats, Floats], places: Floats, line: LineCode
) -> tuple[int, float, Reading]:
    """Read the frame that begins at a place, with guessed and learned levels; return place, score and reading."""
    guess, learned = levels
    nodes = build_nodes(line, MEMORY)
    counts = roll_to_place(folded, place)
    scores = log_likelihoods(counts, learned)
    path, margins = best_path(scores, nodes, MEMORY - 1)
    context = nodes.context[path]
    total = path_score(scores, context)
    distance = np.abs((np.arange(places.size) - place + places.size // 2) % places.size - places.size // 2)
    value, check = line.decode(np.roll(context & 1, MEMORY - 1))
    guessed = path_score(log_likelihoods(counts, guess), context)
    lamp = max(_periodic_score(counts, 2 * PHASES), _periodic_score(counts, 4 * PHASES))
    reading = Reading(
        value,
        check,
        gain=min(guessed - _periodic_score(counts, 1), total - lamp),
        margin=min(
            _margin(scores, context, margins, line, check),
            total - float(places[distance > PHASES + SEARCH_BINS].max()),
        ),
        support=_support(counts, learned, context),
        start_activity=_start_activity(counts, len(line.start_chips)),
    )
    return place, total, reading


def _learn(folded: MarkCounts, guess: Floats, nodes: Nodes, first: int) -> tuple[int, Floats]:
    """Find the place near the first guess whose learned levels explain the most; return it and those levels."""
    best, found = -np.inf, (first, guess)
    for place in range(first - SEARCH_BINS, first + SEARCH_BINS + 1):
        counts, levels = roll_to_place(folded, place), guess
        for _ in range(ROUNDS):
            path, _ = best_path(log_likelihoods(counts, levels), nodes, MEMORY - 1)
            levels = estimate_levels(counts, nodes.context[path], guess)
        scores = log_likelihoods(counts, levels)
        path, _ = best_path(scores, nodes, MEMORY - 1)
        total = path_score(scores, nodes.context[path])
        if total > best:
            best, found = total, (place % (folded.shape[0] * PHASES), levels)
    return found


def _periodic_score(counts: MarkCounts, period_bins: int) -> float:
    """Return the log-likelihood of marks that repeat every few bins; 1 bin means marks at any time.

    The probabilities are learned as the levels are, with a guess of the same weight.
    """
    flat = counts.reshape(-1, 3)
    mean = flat.sum(axis=0) + np.array([1.0, 0.5, 0.5])
    at = np.arange(len(flat)) % period_bins
    shares = np.stack([np.bincount(at, flat[:, side], period_bins) for side in (NO_MARK, ON, OFF)], axis=1)
    shares = shares + GUESS_CHIPS * mean / mean.sum()
    shares = shares / shares.sum(axis=1, keepdims=True)
    return float((flat * np.log(shares[at])).sum())


def _margin(scores: Floats, context: npt.NDArray[np.int32], margins: Floats, line: LineCode, check: bool) -> float:
    """Return the margin of the most likely path over the next frame that passes the check."""
    others = frame_contexts(line, MEMORY)
    if not check or others is None:
        return float(margins.min())
    sums = scores[np.arange(len(scores)), others].sum(axis=1)
    itself = (others == context).all(axis=1)
    return float(sums[itself].max() - sums[~itself].max())


def _support(counts: MarkCounts, levels: Floats, context: npt.NDArray[np.int32]) -> float:
    """Return the fraction of the marks that lie where the levels expect their polarity rather than the other one."""
    expected = levels[context]
    right = (expected[..., ON] > expected[..., OFF])[..., None] == (np.array([NO_MARK, ON, OFF]) == ON)
    total = counts[..., ON:].sum()
    return float((counts * right)[..., ON:].sum() / total)


def _start_activity(counts: MarkCounts, n_start: int) -> float:
    """Return the marks per chip in the start, from its chip MEMORY - 1 on, over the marks per chip in the data."""
    n_marks = counts[..., ON:].sum(axis=(1, 2))
    n_quiet = n_start - (MEMORY - 1)
    n_data = n_marks.size - n_start
    data = float(n_marks[n_quiet : n_quiet + n_data].mean())
    return float(n_marks[:n_quiet].mean()) / data if data > 0 else 1.0


def _start_us(chips: Floats, place: int, bin_us: float) -> float:
    """Return the start of the first whole frame, which begins at bin `place` of the fold [us]."""
    span_us = chips.size * bin_us
    chip_us = span_us / (chips[-1] - chips[0]) if chips.size > 1 else span_us
    return float((place / PHASES - chips[0]) * chip_us)
