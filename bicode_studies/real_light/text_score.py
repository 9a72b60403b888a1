"""Compare a text that was read with the text that was sent, letter by letter and bit by bit.

Two public recordings of an LED send Shakespeare's sonnet 18 again and again. The text is the ground truth: it is used
for scoring and no receiver is given it. The text that was read is aligned with the text that was sent so that the
number of wrong, lost and extra letters is smallest. A lost letter counts as wrong, and so do all its bits. What was
read before the first and after the last letter sent is not scored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.kernels import njit
from bicode_studies.statistics import wilson

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
"""The text that the beacons send: 618 letters with line feeds (W. Shakespeare, 1609; public domain)."""

AUTHORS_DECODER = {
    504: {"letters": 1.000, "bits": float("nan")},
    3125: {"letters": 0.877, "bits": 0.986},
}
"""Shares that the beacon authors' own decoder reads correctly, run unchanged; its bits are all 11 chips of a letter."""

LETTER_BITS = 7

Interval = tuple[float, float, float]
"""A share and the ends of its 95 % Wilson interval, each 0 .. 1."""


@dataclass(frozen=True, kw_only=True)
class TextScore:
    """How well a text was read.

    Parameters
    ----------
    letters_right : ndarray of bool, shape (sent,)
        Whether each letter sent was read correctly.
    bits_right : ndarray of bool, shape (sent, 7)
        Whether each of its bits was read correctly, the most significant bit first.
    n_lost : int
        Number of letters sent for which none was read.
    n_extra : int
        Number of letters that were read between the first and the last one sent, but not sent.
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
        """Share of letters that were read correctly, with its 95 % interval (letters taken as independent)."""
        return _share(self.letters_right)

    @property
    def bits(self) -> Interval:
        """Share of bits that were read correctly, with its 95 % interval (bits taken as independent)."""
        return _share(self.bits_right)


def score_text(read: str, sent: str) -> TextScore:
    """Compare the text that was read with the text that was sent.

    Parameters
    ----------
    read, sent : str
        Letters of 7 bits; `sent` holds at least one.

    Returns
    -------
    TextScore

    Raises
    ------
    ValueError
        If nothing was sent, or a letter needs more than 7 bits.

    Examples
    --------
    >>> score = score_text("~~Shell  compare", "Shall I compare")
    >>> score.letters_right.sum(), score.n_lost, score.n_extra
    (np.int64(13), 1, 0)
    >>> score.bits_right.sum()  # of 105: "a" and "e" differ in one bit, the lost "I" counts seven
    np.int64(97)
    """
    if not sent:
        raise ValueError("nothing was sent; give the text that the recording holds")
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
    """Make a table with one row for each score.

    Parameters
    ----------
    scores : mapping of (int, str) to TextScore
        Scores by rate [Bd] and name of the receiver.

    Returns
    -------
    DataFrame
        ``baud``, ``receiver``; ``letters`` and ``bits`` (shares read correctly, 0 .. 1) with their 95 % intervals
        ``_low`` and ``_high``; ``lost`` and ``extra`` (counts of letters).
    """
    rows = [(*key, *score.letters, *score.bits, score.n_lost, score.n_extra) for key, score in scores.items()]
    columns = ["baud", "receiver", "letters", "letters_low", "letters_high", "bits", "bits_low", "bits_high"]
    return pd.DataFrame(rows, columns=[*columns, "lost", "extra"])


def _share(right: npt.NDArray[np.bool_]) -> Interval:
    """Return the share of true values and its 95 % interval."""
    low, high = wilson(right.sum(), right.size)
    return float(right.mean()), float(low), float(high)


def _codes(text: str) -> npt.NDArray[np.int64]:
    """Return the codes of the letters of a text, after checking that each fits into 7 bits."""
    codes = np.array([ord(letter) for letter in text], np.int64)
    if codes.size and codes.max() >= 1 << LETTER_BITS:
        raise ValueError(f"{chr(int(codes.max()))!r} is no letter of {LETTER_BITS} bits; give ASCII text")
    return codes


@njit(cache=True)
def _align(got, sent):  # type: ignore[no-untyped-def]
    """Return for each code sent the number of the code read in its place, or -1; the ends of `got` cost nothing."""
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
