"""Real beacons: how much of a known text was read?   letters, the text -> accuracy with intervals

Two public recordings of an LED send Shakespeare's sonnet 18 again and again. The text is the
truth: it judges, and no receiver is given it. What was read is laid along what was sent so
that as few letters as possible are wrong, lost or too many; a lost letter is wrong, and so
are all its bits. Whatever a receiver read ahead of the text and behind it is not judged.

`read_letters_by_rule` is the paper's rule on such a beacon: the larger of the ON and OFF counts
names the LED's state (II-B), and a letter is framed as any serial port would do it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from numba import njit

from bicode_lab.events import Events, slice_time
from bicode_lab.recognition import edge_gates, led_state
from bicode_studies.score import accuracy

SONNET_18 = """\
Shall I compare thee to a summer's day?
Thou art more lovely and more temperate:
Rough winds do shake the darling buds of May,
And summer's lease hath all too short a date:
Sometime too hot the eye of heaven shines,
And often is his gold complexion dimm'd;
And every fair from fair sometime declines,
By chance or nature's changing course untrimm'd;
But thy eternal summer shall not fade
Nor lose possession of that fair thou owest;
Nor shall Death brag thou wander'st in his shade,
When in eternal lines to time thou growest:
So long as men can breathe or eyes can see,
So long lives this and this gives life to thee."""
"""The text the beacons send, 618 letters with its line feeds (W. Shakespeare, 1609; public domain)."""

AUTHORS_DECODER = {
    504: {"letters": 1.000, "bits": float("nan")},
    3125: {"letters": 0.877, "bits": 0.986},
}
"""What the authors' own decoder reaches on the two files, run unchanged; its bits are all 11 chips of a letter."""

WHERE_FROM = (
    "They are 504hz_30m.mat and 3125hz_30m.mat of github.com/ziweiWWANG/Event-Beacon-Communication (data/"
    "bright-led-outdoor, for academic use only). Put them into a folder event_beacon and give the folder around it."
)
"""Where to get the two recordings."""

LETTER_BITS = 7
FRAME_CHIPS = 11  # start 0, 7 bits with the most significant first, even parity, two stop bits 1
FIRST_PARITY = LETTER_BITS + 1
PAUSE_CHIPS = 1  # letters farther apart than this did not follow each other

Interval = tuple[float, float, float]
"""A share and the ends of its 95 % Wilson interval."""


class ReadLetter(NamedTuple):
    """One letter as it was read: first moment of its start [us], the character, whether its parity holds."""

    t_us: int
    letter: str
    parity_ok: bool


@dataclass(frozen=True, kw_only=True)
class TextScore:
    """How well a text was read.

    Parameters
    ----------
    letters_right : ndarray of bool, shape (sent,)
        For each letter sent.
    bits_right : ndarray of bool, shape (sent, 7)
        For each of its bits, the most significant first.
    n_lost : int
        Letters sent for which none was read.
    n_extra : int
        Letters read between the first and the last one sent that nobody sent.
    read : tuple of int
        For each letter sent, the number of the letter read in its place; -1 where it was lost.
    """

    letters_right: npt.NDArray[np.bool_]
    bits_right: npt.NDArray[np.bool_]
    n_lost: int
    n_extra: int
    read: tuple[int, ...]

    @property
    def letters(self) -> Interval:
        """Share of letters sent that were read right, and its 95 % interval (letters taken as independent)."""
        return accuracy(self.letters_right)

    @property
    def bits(self) -> Interval:
        """Share of their bits that were read right, and its 95 % interval (bits taken as independent)."""
        return accuracy(self.bits_right)


def score_text(read: str, sent: str) -> TextScore:
    """What was read and what was sent in, letters of 7 bits; what was right out.

    Examples
    --------
    >>> score = score_text("~~Shell  compare", "Shall I compare")
    >>> score.letters_right.sum(), score.n_lost, score.n_extra
    (np.int64(13), 1, 0)
    >>> score.bits_right.sum()  # of 105: "a" and "e" differ in one bit, the lost "I" counts seven
    np.int64(97)
    """
    if not sent:
        raise ValueError("nothing was sent; give the text the recording holds")
    got, truth = _codes(read), _codes(sent)
    place = _align(got, truth)
    lost = place < 0
    answer = np.where(lost, -1, got[np.maximum(place, 0)]) if got.size else np.full(truth.size, -1)
    shifts = np.arange(LETTER_BITS - 1, -1, -1)
    unlike = (answer[:, None] ^ truth[:, None]) >> shifts & 1
    found = place[~lost]
    n_extra = int(found[-1] - found[0] + 1 - found.size) if found.size else 0
    return TextScore(
        letters_right=answer == truth,
        bits_right=(unlike == 0) & ~lost[:, None],
        n_lost=int(lost.sum()),
        n_extra=n_extra,
        read=tuple(int(k) for k in place),
    )


def score_table(scores: Mapping[tuple[int, str], TextScore]) -> pd.DataFrame:
    """Scores by (baud, receiver) in, a row each out: letters and bits with their intervals, letters lost, too many."""
    rows = [(*key, *score.letters, *score.bits, score.n_lost, score.n_extra) for key, score in scores.items()]
    columns = ["baud", "receiver", "letters", "letters_low", "letters_high", "bits", "bits_low", "bits_high"]
    return pd.DataFrame(rows, columns=[*columns, "lost", "extra"])


@dataclass(frozen=True)
class Transmitter:
    """What letters read say of who sent them: letters, clock [ppm slower than it says], events an edge."""

    n_letters: int
    slower_ppm: float
    on_a_rise: float
    off_a_fall: float


def measure_transmitter(
    events: Events, t_us: npt.ArrayLike, frames: npt.ArrayLike, rate_hz: float
) -> Transmitter | None:
    """Letters read in, from the longest run of them without a pause the transmitter's clock and events an edge out.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    t_us : array_like, shape (letters,)
        When each letter began [us].
    frames : array_like, shape (letters, 11)
        Levels of its chips, 0 or 1.
    rate_hz : float
        Chips a second, as it says.

    Returns
    -------
    Transmitter, or None where no two letters follow each other.
    """
    times, chips = np.asarray(t_us, np.int64), np.asarray(frames, np.int64).reshape(-1, FRAME_CHIPS)
    letter_us = FRAME_CHIPS * 1e6 / rate_hz
    breaks = np.flatnonzero(np.diff(times) > letter_us + PAUSE_CHIPS * 1e6 / rate_hz)
    ends = np.concatenate([[0], breaks + 1, [times.size]])
    longest = int(np.argmax(np.diff(ends)))
    run = slice(int(ends[longest]), int(ends[longest + 1]))
    t, levels = times[run], chips[run].ravel()
    if t.size < 2:
        return None
    period_us = float(np.polyfit(np.arange(t.size), t, 1)[0])
    turns = np.diff(levels, prepend=1)  # before a start the light is on
    p = slice_time(events, int(t[0]), int(t[-1] + period_us))["p"]
    on, off = int((p > 0).sum()), int((p == 0).sum())
    return Transmitter(
        t.size, 1e6 * (period_us / letter_us - 1), on / int((turns > 0).sum()), off / int((turns < 0).sum())
    )


def read_letters_by_rule(
    events: Events, rate_hz: float, *, bins_per_chip: int = 2, gate: float = 0.0
) -> list[ReadLetter]:
    """The events of one light in; its letters by the paper's rule for the LED's state out.

    A fall is a start where the chips at the places of both stop bits are 1; each chip is taken
    in its middle. Any other fall is passed over.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Of one region; x and y are not looked at.
    rate_hz : float
        Chips a second.
    bins_per_chip : int
        Counts per chip; the paper's delta_t_ID is half a chip (III-B).
    gate : float
        See `recognition.edge_gates`; 0 is the paper's rule.
    """
    if not rate_hz > 0 or bins_per_chip < 2:
        raise ValueError(
            f"rate_hz={rate_hz}, bins_per_chip={bins_per_chip}: choose a rate above 0 and 2 bins or more (II-B)"
        )
    if not events.size:
        return []
    bin_us = 1e6 / rate_hz / bins_per_chip
    start_us = int(events["t"][0]) - ceil(bin_us)  # the light was on, or the first fall is the first event
    number = ((events["t"] - start_us) / bin_us).astype(np.int64)
    n_bins = int(number[-1]) + 1 + FRAME_CHIPS * bins_per_chip  # a last letter may end in ones, without an event
    n_on, n_off = (np.bincount(number[(events["p"] > 0) == side], minlength=n_bins) for side in (True, False))
    gate_on, gate_off = edge_gates(n_on, n_off, gate)
    state = led_state(n_on, n_off, gate_on=gate_on, gate_off=gate_off, before=1)
    letters = []
    for first, value, parity in _frames(state, bins_per_chip):
        letters.append(ReadLetter(start_us + round(first * bin_us), chr(value), bool(parity)))
    return letters


def _codes(text: str) -> npt.NDArray[np.int64]:
    """A text in, its codes out; refuses what 7 bits cannot hold."""
    codes = np.array([ord(letter) for letter in text], np.int64)
    if codes.size and codes.max() >= 1 << LETTER_BITS:
        raise ValueError(f"{chr(int(codes.max()))!r} is no letter of {LETTER_BITS} bits")
    return codes


@njit(cache=True)
def _align(got, sent):  # type: ignore[no-untyped-def]
    """For each code sent, the number of the one read in its place or -1: fewest errors, the ends of `got` are free."""
    n, m = got.size, sent.size
    cost = np.zeros((m + 1, n + 1), np.int32)
    for i in range(1, m + 1):
        cost[i, 0] = i
        for j in range(1, n + 1):
            here = cost[i - 1, j - 1] + (sent[i - 1] != got[j - 1])
            cost[i, j] = min(here, cost[i - 1, j] + 1, cost[i, j - 1] + 1)
    place = np.full(m, -1, np.int64)
    i, j = m, int(np.argmin(cost[m]))
    while i > 0 and j > 0:
        if cost[i, j] == cost[i - 1, j - 1] + (sent[i - 1] != got[j - 1]):
            i, j = i - 1, j - 1
            place[i] = j
        elif cost[i, j] == cost[i - 1, j] + 1:
            i -= 1
        else:
            j -= 1
    return place


@njit(cache=True)
def _frames(state, m):  # type: ignore[no-untyped-def]
    """The LED's state in bins, `m` a chip, in; (first bin, code, whether the parity is even) of each letter out."""
    found = []
    i = 1
    while i + m * (FRAME_CHIPS - 1) + m // 2 < state.size:
        middle = i + m // 2
        is_start = state[i - 1] == 1 and state[i] == 0 and state[middle] == 0
        if is_start and state[middle + m * (FRAME_CHIPS - 2)] == 1 and state[middle + m * (FRAME_CHIPS - 1)] == 1:
            value = 0
            ones = np.int64(state[middle + m * FIRST_PARITY])
            for k in range(1, FIRST_PARITY):
                value = 2 * value + state[middle + m * k]
                ones += state[middle + m * k]
            found.append((i, value, ones % 2 == 0))
            i = middle + m * (FRAME_CHIPS - 1)
        else:
            i += 1
    return found
