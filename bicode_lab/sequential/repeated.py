"""Read a packet that is sent again and again, from all its repetitions together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bicode_lab.sequential.fold import ON, Bins, Clock, find_clock, fold
from bicode_lab.sequential.judge import EQUAL_SCORE, ONES, against_lamps, decide, judge, start_share
from bicode_lab.sequential.learning import learn
from bicode_lab.sequential.levels import TAILS, chip_scores, guess_levels
from bicode_lab.sequential.paths import FIRST, best_contexts, score_places
from bicode_lab.sequential.reading import MIN_GAIN, NOTHING, Reading
from bicode_lab.sequential.rivals import burst_score
from bicode_lab.soft_receiver.line_code import LineCode

LATER_OFF = (-1, 0, 1, 2)  # by how many chips more OFF events may come later than ON events
STARTS = 3  # places that the levels are learned from, for each tail and each delay ...
MORE_STARTS = 12  # ... and where the guess explains too little, so that a wrong path may have learned its own levels
QUIET_CHIPS = 2  # the last data and the first data may be off for a chip each, beside the start


def seen_counts(bins: Bins, line: LineCode) -> Bins:
    """Return the counts of the time in which the light was in view, each bin limited.

    Parameters
    ----------
    bins : Bins
    line : LineCode

    Returns
    -------
    Bins
    """
    return bins.seen(len(line.start_chips) + QUIET_CHIPS).capped()


def read_repeated(bins: Bins, line: LineCode) -> Reading:
    """Read a frame that is sent again and again.

    All frames are laid over each other. The time must hold one frame and one more start at least: in a shorter time,
    lamps look like frames.

    Parameters
    ----------
    bins : Bins
        Counts of a region.
    line : LineCode
        A code that repeats its frame without a pause and begins it with `levels.MEMORY` equal chips or more.

    Returns
    -------
    Reading
        Its property ``doubt`` tells whether to believe it.
    """
    bins = seen_counts(bins, line)
    if not bins.counts.any() or not _is_long_enough(bins, line):
        return NOTHING
    clock = find_clock(bins)
    reading = _likeliest(bins, clock, line, STARTS)
    if reading.doubt is None and reading.guessed_gain < MIN_GAIN:
        reading = _likeliest(bins, clock, line, MORE_STARTS)
    return reading


def _likeliest(bins: Bins, clock: Clock, line: LineCode, n_starts: int) -> Reading:
    """Return the likeliest reading of those that are learned from so many places for each tail and delay."""
    n = line.frame_chips
    tried = []
    for tail in TAILS:
        guess = guess_levels(fold(bins, clock, n), tail)
        for shifted in (clock.later_off(later) for later in LATER_OFF):
            counts = fold(bins, shifted, n)
            scores = score_places(chip_scores(counts, guess, ONES), line)
            starts = np.argsort(-scores)[:n_starts]
            tried += [(learn(counts.rolled(int(at) + FIRST), guess, line), shifted, counts) for at in starts]
    learned, clock, counts = max(tried, key=lambda one: one[0].total)
    places = score_places(chip_scores(counts, learned.levels, learned.dispersion), line)
    at = int(np.argmax(places))
    burst = burst_score(bins, learned.dispersion)
    readings = []
    for begin in (at, at + 1, at - 1):  # of a frame whose bits are all alike, one chip aside the check decides
        frame = counts.rolled(begin + FIRST)
        contexts, total = best_contexts(chip_scores(frame, learned.levels, learned.dispersion), line)
        reading = judge(replace(learned, frames=frame), contexts, total, places, begin % n, burst)
        reading = replace(
            reading, begin=(begin + clock.origin[ON]) / clock.rate, start=start_share(frame, contexts, line)
        )
        readings.append((total, decide(reading, frame, contexts, line)))
    total, reading = _surest(readings)
    misfit = float((learned.dispersion / counts.scatter()).max())
    reading = replace(reading, clock=clock, misfit=misfit, n_frames=counts.chips_seen / n)
    return against_lamps(reading, total, bins, line)


def _surest(readings: list[tuple[float, Reading]]) -> tuple[float, Reading]:
    """Return score and reading of the most likely one, or of one that is as likely and passes the check.

    The others limit its margin.
    """
    best = readings[0][0]
    total, reading = max(readings, key=lambda one: (one[1].check and one[0] > best - EQUAL_SCORE, one[0]))
    margins = [total - other_total for other_total, other in readings if other.check and other.value != reading.value]
    return total, replace(reading, margin=min([reading.margin, *margins]))


def _is_long_enough(bins: Bins, line: LineCode) -> bool:
    """Return whether the bins hold every chip of a frame, and one more start."""
    place = np.floor(bins.chips).astype(np.int64)
    chips = np.unique(place)
    needed = line.frame_chips + len(line.start_chips)
    return chips.size >= needed and np.unique(chips % line.frame_chips).size == line.frame_chips
