"""Whether a text is to be believed, told without knowing what was sent.

A receiver that knows the code finds letters in anything: in noise, in a lamp, in a text of another rate. So the same
events are read once more by a path that may take any levels. A letter *holds* if it is a whole letter on that path,
too: start, stop and parity are right without the help of the code. By chance this happens in a part of the letters that
depends on the light; in 48 lights that send no such text (noise, lamps of 50 to 1000 Hz, bursts, other codes, other
rates) it was 0.04 to 0.53 of the letters, but for one lamp (0.77), whose letters were nearly all alike. In texts of
which 0.8 of the letters are right it is 0.7, in texts without an error 0.95 to 1. The parity on a path that knows the
rest of the code is a weaker sign: it holds in up to 0.96 of the letters of a lamp.

From few letters the rates can learn to say what they are expected to (in 86 letters of a faint light under many stray
events, 0.71 held and 0.21 were right), so of a short text more letters must hold: 0.7 and one over the root of their
number, or all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]

MIN_HELD = 0.7  # of the letters of a long text
MIN_HELD_NEAR = 0.5  # of the letters around one
NEAR = 12  # letters on either side
CHANCE = 0.5  # the lower end of the interval of the share must be above this
Z_95 = 1.96
FEW = 10  # fewer letters may well be all alike
MIN_VARIETY = 3.0  # letters, each as often as the others


@dataclass(frozen=True, kw_only=True)
class TextCheck:
    """What the check of a text says.

    Parameters
    ----------
    n_letters : int
        Number of letters that were found.
    held : float
        Share of them that hold without the help of the code, 0 .. 1.
    parity : float
        Share whose parity holds on the path that knows all of the code but the parity, 0 .. 1.
    explained : float
        Share of the events that lie where the text makes events, 0 .. 1.
    reason : str or None
        Why no letter is given; None if the text is believed.
    """

    n_letters: int = 0
    held: float = 0.0
    parity: float = 0.0
    explained: float = 0.0
    reason: str | None = None


def doubt_text(codes: npt.NDArray[np.int64], held: Bools) -> str | None:
    """Tell why a text is not believed.

    Parameters
    ----------
    codes : ndarray of int64, shape (letters,)
        Codes of the letters.
    held : ndarray of bool, shape (letters,)
        Whether each letter holds without the help of the code.

    Returns
    -------
    str or None
        A sentence; None if the text is believed.

    Examples
    --------
    >>> doubt_text(np.arange(50), np.ones(50, bool)) is None
    True
    >>> doubt_text(np.arange(50), np.arange(50) % 2 == 0)
    'start, stop and parity hold in 50 % of 50 letters, and 84 % are needed; it may be another rate or no text'
    """
    n = held.size
    if not n:
        return "there is no letter in it"
    share, needed = float(held.mean()), min(MIN_HELD + 1 / math.sqrt(n), 1.0)
    if share < needed:
        return (
            f"start, stop and parity hold in {share:.0%} of {n} letters, and {needed:.0%} are needed; "
            "it may be another rate or no text"
        ).replace("%", " %")
    if _least_share(share, n) <= CHANCE:
        return f"{n} letters are too few to tell them from chance ({int(held.sum())} hold); give a longer recording"
    if n >= FEW and variety(codes) < MIN_VARIETY:
        return f"{n} letters are nearly all alike, as those of a lamp are; no text"
    return None


def variety(codes: npt.NDArray[np.int64]) -> float:
    """Compute how many different letters a text has, weighed by how often they come: the exponential of the entropy.

    Parameters
    ----------
    codes : ndarray of int64, shape (letters,)
        Codes of the letters, one or more.

    Returns
    -------
    float
        1 or more.

    Examples
    --------
    >>> variety(np.array([7, 7, 7])), round(variety(np.array([1, 2, 3, 1, 2, 3])), 9)
    (1.0, 3.0)
    """
    shares = np.unique(codes, return_counts=True)[1] / codes.size
    return math.exp(max(float(-(shares * np.log(shares)).sum()), 0.0))


def believed_near(held: Bools) -> Bools:
    """Tell which letters stand among letters of which enough hold.

    Parameters
    ----------
    held : ndarray of bool, shape (letters,)

    Returns
    -------
    ndarray of bool, shape (letters,)
        Whether `MIN_HELD_NEAR` of the letters up to `NEAR` before and after hold.

    Examples
    --------
    >>> held = np.arange(100) < 50
    >>> int(believed_near(held).sum())
    50
    """
    total = np.concatenate([[0], np.cumsum(held)])
    at = np.arange(held.size)
    low, high = np.maximum(at - NEAR, 0), np.minimum(at + NEAR + 1, held.size)
    return np.asarray((total[high] - total[low]) >= MIN_HELD_NEAR * (high - low), np.bool_)


def _least_share(share: float, n: int) -> float:
    """Return the lower end of Wilson's 95 % interval of a share of n."""
    z2 = Z_95**2
    half = Z_95 * math.sqrt(share * (1 - share) / n + z2 / (4 * n * n))
    return (share + z2 / (2 * n) - half) / (1 + z2 / n)
