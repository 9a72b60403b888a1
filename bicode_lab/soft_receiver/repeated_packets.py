"""A marker says the same again and again: evidence of all its packets, laid over each other.   marks -> one ID

The marks of a track, over a period of 33 ms or over a second, are folded to the length of one
frame on the tracked clock. Then there is one frame to read, however faint each packet was:

1. every place the frame may begin at (chips of a frame x bins of a chip) is scored by its likeliest walk,
   which knows the start and that every bit switches, under guessed levels;
2. around the best place the levels are learned, and the walk is taken again;
3. the code's check is the last word. Where all bits are alike, the frame may as well begin a chip
   sooner or later with all bits turned: there the check decides, or the margin is small.

A wrong ID would be worse than none, so evidence is asked for in four ways (`Limits`); gain and margin
are natural logarithms of likelihood ratios:

    gain      of the walk, under the guessed levels, over marks that come at any time (chance has
              ln(448 places x 2048 words) = 14 to choose from); and, under levels learned for either, over
              a lamp that says the same every two or four chips
    margin    of what is read over anything else that passes the check (over the same with its least sure bit
              turned, where the code has too many frames to try them all), and of the best place over any other
    support   share of the marks that lie where an edge of their polarity explains them
    unrest    marks of a chip in the quiet start over those of a chip in the data: a lamp that
              flickers at the chip rate has no quiet
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.recognition.decode import Reason
from bicode_lab.soft_receiver.clock import Marks, find_chips
from bicode_lab.soft_receiver.levels import (
    GUESS_CHIPS,
    NOTHING,
    OFF,
    ON,
    PHASES,
    Floats,
    Tally,
    count_levels,
    guess_levels,
    scores_of,
    tally,
)
from bicode_lab.soft_receiver.line_code import LineCode, Nodes, contexts_of, nodes_of
from bicode_lab.soft_receiver.viterbi import IMPOSSIBLE, best_walk

MEMORY = 3
ROUNDS = 3
AS_GOOD = 1.0  # two places whose scores differ by less explain the marks equally well
NEAR_BINS = 3  # the best place is looked for again so far around the first guess of it


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a reading must reach to be believed; see the top of this file.

    Parameters
    ----------
    gain, margin, support : float
        Least.
    unrest : float
        Most.
    """

    gain: float = 13.0
    margin: float = 8.0
    support: float = 0.85
    unrest: float = 0.1

    def doubt(self, reading: Reading) -> Reason | None:
        """A reading in, why it is not believed out, in the words of the paper's rule; None where it is."""
        if reading.value is None:
            return "no_events"
        if reading.gain < self.gain or reading.unrest > self.unrest:
            return "no_start"
        if reading.margin < self.margin or reading.support < self.support:
            return "manchester"
        return None if reading.check else "checksum"


@dataclass(frozen=True)
class Reading:
    """What folded marks say.

    Parameters
    ----------
    value : int or None
        What the likeliest walk says; None where there are no marks.
    check : bool
        Whether the code's check holds.
    start_us : float
        Where the first whole frame begins [us], from the first bin on.
    error_ppm : float
        How much longer the transmitter's chip is than nominal [1e-6].
    gain, margin, support, unrest : float
        See the top of this file.
    """

    value: int | None
    check: bool = False
    start_us: float = 0.0
    error_ppm: float = 0.0
    gain: float = 0.0
    margin: float = 0.0
    support: float = 0.0
    unrest: float = 0.0


def read_repeated_packets(marks: Marks, bin_us: float, line: LineCode) -> Reading:
    """Marks of one region in, shape (n,); what they say if they are the same frame over and over out.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        See `clock.lead_marks`.
    bin_us : float
        Length of a bin [us].
    line : LineCode
        One that repeats its frame without a pause and starts with `MEMORY` equal chips or more.
    """
    if not marks.any():
        return Reading(None)
    n = line.frame_chips
    chips, error_ppm, _ = find_chips(marks, bin_us, line.chip_us)
    fine = tally(marks, chips, 0, n, period=n)
    nodes = nodes_of(line, MEMORY)
    guess = guess_levels(fine, MEMORY)
    places = _score_places(fine, guess, nodes)
    place, shares = _learn(fine, guess, nodes, int(np.argmax(places)))
    places = _score_places(fine, shares, nodes)
    walks = [_walk_from(at, fine, (guess, shares), places, line) for at in (place, place + PHASES, place - PHASES)]
    at, total, reading = max(walks, key=lambda walk: (walk[2].check and walk[1] > walks[0][1] - AS_GOOD, walk[1]))
    for _, total_other, other in walks:
        if other.check and other.value != reading.value:
            reading = replace(reading, margin=min(reading.margin, total - total_other))
    return replace(reading, start_us=_start_us(chips, at, bin_us), error_ppm=error_ppm)


def _walk_from(
    place: int, fine: Tally, levels: tuple[Floats, Floats], places: Floats, line: LineCode
) -> tuple[int, float, Reading]:
    """A place, guessed and learned levels and every place's score in; the place, its score and reading out."""
    guess, shares = levels
    n = line.frame_chips
    nodes = nodes_of(line, MEMORY)
    counts = _turned(fine, place)
    scores = scores_of(counts, shares)
    walk, margins = best_walk(scores, nodes, MEMORY - 1)
    context = nodes.context[walk]
    total = float(scores[np.arange(n), context].sum())
    away = np.abs((np.arange(places.size) - place + places.size // 2) % places.size - places.size // 2)
    value, check = line.decode(np.roll(context & 1, MEMORY - 1))
    plain = float(scores_of(counts, guess)[np.arange(n), context].sum())
    lamp = max(_steady(counts, 2 * PHASES), _steady(counts, 4 * PHASES))
    reading = Reading(
        value,
        check,
        gain=min(plain - _steady(counts, 1), total - lamp),
        margin=min(
            _margin(scores, context, margins, line, check),
            total - float(places[away > PHASES + NEAR_BINS].max()),
        ),
        support=_support(counts, shares, context),
        unrest=_unrest(counts, len(line.start_chips)),
    )
    return place, total, reading


def _learn(fine: Tally, guess: Floats, nodes: Nodes, first: int) -> tuple[int, Floats]:
    """A first guess of the place in; the place near it whose learned levels explain the most, and those, out."""
    best, found = -np.inf, (first, guess)
    for place in range(first - NEAR_BINS, first + NEAR_BINS + 1):
        counts, shares = _turned(fine, place), guess
        for _ in range(ROUNDS):
            walk, _ = best_walk(scores_of(counts, shares), nodes, MEMORY - 1)
            shares = count_levels(counts, nodes.context[walk], guess)
        scores = scores_of(counts, shares)
        walk, _ = best_walk(scores, nodes, MEMORY - 1)
        total = float(scores[np.arange(walk.size), nodes.context[walk]].sum())
        if total > best:
            best, found = total, (place % (fine.shape[0] * PHASES), shares)
    return found


def _turned(fine: Tally, place: int) -> Tally:
    """A folded tally in; the same from the chip number MEMORY - 1 of a frame that begins at `place` [bins] on, out."""
    flat = fine.reshape(-1, 3)
    return np.roll(flat, -place - (MEMORY - 1) * PHASES, axis=0).reshape(fine.shape)


def _score_places(fine: Tally, shares: Floats, nodes: Nodes) -> Floats:
    """A folded tally and levels in; the best walk's sum for a frame that begins at each bin, shape (bins,), out."""
    n = fine.shape[0]
    flat = fine.reshape(-1, 3)
    turned = np.stack([np.roll(flat, -phase, axis=0).reshape(fine.shape) for phase in range(PHASES)])
    scores = scores_of(turned.reshape(n * PHASES, PHASES, 3), shares).reshape(PHASES, n, -1)
    ahead = np.where(nodes.place == MEMORY - 1, 0.0, IMPOSSIBLE)
    sums = _best_sums(scores, nodes.context, nodes.before, ahead, nodes.place, MEMORY - 1)
    return np.asarray(sums, np.float64).T.ravel()


def _steady(counts: Tally, period_bins: int) -> float:
    """A tally in, its log-likelihood under marks that repeat every few bins out; 1 bin is marks at any time.

    The shares are learned as those of the walk are, from the same number of chips of a guess.
    """
    flat = counts.reshape(-1, 3)
    every = flat.sum(axis=0) + np.array([1.0, 0.5, 0.5])
    at = np.arange(len(flat)) % period_bins
    shares = np.stack([np.bincount(at, flat[:, side], period_bins) for side in (NOTHING, ON, OFF)], axis=1)
    shares = shares + GUESS_CHIPS * every / every.sum()
    shares = shares / shares.sum(axis=1, keepdims=True)
    return float((flat * np.log(shares[at])).sum())


def _margin(scores: Floats, context: npt.NDArray[np.int32], margins: Floats, line: LineCode, check: bool) -> float:
    """The scores and the likeliest walk with its bits' margins in; its margin over the next of its like out."""
    others = contexts_of(line, MEMORY)
    if not check or others is None:
        return float(margins.min())
    sums = scores[np.arange(len(scores)), others].sum(axis=1)
    itself = (others == context).all(axis=1)
    return float(sums[itself].max() - sums[~itself].max())


def _support(counts: Tally, shares: Floats, context: npt.NDArray[np.int32]) -> float:
    """Share of the marks that lie where the levels expect their polarity rather than the other one."""
    expected = shares[context]
    right = (expected[..., ON] > expected[..., OFF])[..., None] == (np.array([NOTHING, ON, OFF]) == ON)
    said = counts[..., ON:].sum()
    return float((counts * right)[..., ON:].sum() / said)


def _unrest(counts: Tally, n_start: int) -> float:
    """A tally from the chip MEMORY - 1 on in; marks a chip in what is left of the start over those in the data, out."""
    said = counts[..., ON:].sum(axis=(1, 2))
    n_quiet = n_start - (MEMORY - 1)
    n_data = said.size - n_start
    data = float(said[n_quiet : n_quiet + n_data].mean())
    return float(said[:n_quiet].mean()) / data if data > 0 else 1.0


def _start_us(chips: Floats, place: int, bin_us: float) -> float:
    """Chip numbers of all bins and the frame's place in the fold [bins] in; when its first whole frame begins out."""
    frames = chips.size * bin_us  # the time looked at
    chip_us = frames / (chips[-1] - chips[0]) if chips.size > 1 else frames
    return float((place / PHASES - chips[0]) * chip_us)


@njit(cache=True)
def _best_sums(scores, context, before, ahead, places, first):  # type: ignore[no-untyped-def]
    """The best walk's sum for each phase of the grid and each chip the frame may begin with."""
    n_phases, n, _ = scores.shape
    n_nodes = context.size
    sums = np.empty((n_phases, n))
    order = np.argsort(places)
    bounds = np.searchsorted(places[order], np.arange(n + 1))
    old, new = np.empty(n_nodes), np.empty(n_nodes)
    for phase in range(n_phases):
        for start in range(n):
            row = (start + first) % n
            for j in range(n_nodes):
                old[j] = ahead[j] + scores[phase, row, context[j]]
            place = first
            for k in range(1, n):
                row = (start + first + k) % n
                place = (place + 1) % n
                for at in range(bounds[place], bounds[place + 1]):
                    j = order[at]
                    best = IMPOSSIBLE
                    for m in range(4):
                        i = before[j, m]
                        if i < 0:
                            break
                        best = max(best, old[i])
                    new[j] = best + scores[phase, row, context[j]]
                old, new = new, old
            total = IMPOSSIBLE
            for at in range(bounds[place], bounds[place + 1]):
                total = max(total, old[order[at]])
            sums[phase, start] = total
    return sums
