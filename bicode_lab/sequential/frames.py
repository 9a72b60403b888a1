"""Read each packet for itself, because a payload may change from one packet to the next; check a known reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bicode_lab.sequential.fold import ON, Bins, Clock, Floats, find_clock, fold
from bicode_lab.sequential.judge import ONES, against_lamps, cut, decide, judge, span, start_share
from bicode_lab.sequential.learning import learn
from bicode_lab.sequential.levels import TAILS, chip_scores, guess_levels
from bicode_lab.sequential.paths import best_contexts, score_places
from bicode_lab.sequential.reading import NOTHING, Agreement, FrameReading, Reading
from bicode_lab.sequential.repeated import LATER_OFF, seen_counts
from bicode_lab.sequential.rivals import burst_score, noise_score
from bicode_lab.soft_receiver.line_code import LineCode
from bicode_lab.soft_receiver.viterbi import path_score

FADE = 4.0  # from one period to the next, a light does not become weaker or stronger by more than this factor


def read_frames(bins: Bins, line: LineCode) -> tuple[Reading, list[FrameReading]]:
    """Read each frame for itself.

    Parameters
    ----------
    bins : Bins
        Counts of a region.
    line : LineCode
        A code without a pause between frames, which begins them with `levels.MEMORY` equal chips or more.

    Returns
    -------
    reading : Reading
        What all frames together say of the light; value, margin and begin are those of the surest frame.
    frames : list of FrameReading
        In the order of time, with those that are cut.
    """
    bins = seen_counts(bins, line)
    if not bins.counts.any():
        return NOTHING, []
    clock = find_clock(bins)
    first, n_chips = span(bins, clock, line)
    tried = []
    for tail in TAILS:
        guess = guess_levels(fold(bins, clock, n_chips, first), tail)
        shifted = [clock.later_off(later) for later in LATER_OFF]
        options = [(one, _by_place(bins, one, guess, ONES, line)) for one in shifted]
        likeliest, places = max(options, key=lambda one: one[1].max())
        at = int(np.argmax(places))
        stacked, begins = cut(bins, likeliest, at, line)
        tried.append((learn(stacked, guess, line), likeliest, at, begins))
    learned, clock, at, begins = max(tried, key=lambda one: one[0].total)
    stacked = learned.frames
    places = _by_place(bins, clock, learned.levels, learned.dispersion, line)
    paths = [learned.path(k, line) for k in range(len(begins))]
    contexts = np.concatenate([own for own, _ in paths])
    total = sum(score for _, score in paths)
    whole = judge(learned, contexts, total, places, at, burst_score(bins, learned.dispersion))
    whole = replace(
        whole,
        clock=clock,
        start=start_share(stacked, contexts, line),
        n_frames=stacked.chips_seen / line.frame_chips,
    )
    readings, frames = [], []
    for k, begin in enumerate(begins):
        frame = stacked.part(k * line.frame_chips, line.frame_chips)
        own = paths[k][0]
        moment = (begin + clock.origin[ON]) / clock.rate
        readings.append(replace(decide(whole, frame, own, line), begin=moment))
        guessed = path_score(chip_scores(frame, learned.guess, learned.dispersion), own)
        frames.append(
            FrameReading(
                value=int(readings[-1].value or 0), check=readings[-1].check, begin=moment,
                is_whole=bool((frame.exposure > 0).any(axis=2).all()),
                gain=guessed - noise_score(frame, learned.dispersion),
                is_periodic=readings[-1].is_periodic, margin=readings[-1].margin, conflict=readings[-1].conflict,
            )
        )  # fmt: skip
    surest = max(readings, key=lambda one: (one.check, one.margin))
    return against_lamps(replace(surest, is_periodic=False), total, bins, line), frames


def agreement(reading: Reading, bins: Bins, line: LineCode) -> Agreement:
    """Compare a reading with counts of the same region, such as those of the last period.

    A light may fade or brighten by up to `FADE` without being another one, so the levels follow the number of events
    that far.

    Parameters
    ----------
    reading : Reading
        A reading that is believed.
    bins : Bins
    line : LineCode

    Returns
    -------
    Agreement
    """
    bins = seen_counts(bins, line)
    if reading.clock is None or reading.contexts is None or reading.levels is None:
        return Agreement(presence=-np.inf, contradiction=0.0)
    n, clock = line.frame_chips, reading.clock
    first, _ = span(bins, clock, line)
    at = round(reading.begin * clock.rate - clock.origin[ON] - first)
    frames, begins = cut(bins, clock, at, line)
    usual = (reading.levels[np.tile(reading.contexts, len(begins))] * frames.exposure).sum()
    fading = np.clip(frames.sums.sum() / max(usual, 1e-9), 1 / FADE, FADE)
    scores = chip_scores(frames, reading.levels * fading, reading.dispersion)
    worst = total = 0.0
    for k in range(len(begins)):
        frame = scores[k * n : (k + 1) * n]
        own = path_score(frame, reading.contexts)
        total += own
        worst = max(worst, best_contexts(frame, line)[1] - own)
    return Agreement(presence=total - noise_score(frames, reading.dispersion), contradiction=worst)


def _by_place(bins: Bins, clock: Clock, levels: Floats, dispersion: Floats, line: LineCode) -> Floats:
    """Score each place at which frames may begin by the sum over the frames, which need not be alike."""
    first, n_chips = span(bins, clock, line)
    sums = score_places(chip_scores(fold(bins, clock, n_chips, first), levels, dispersion), line)
    places = np.bincount(np.arange(sums.size) % line.frame_chips, sums, line.frame_chips)
    return np.asarray(places, np.float64)
