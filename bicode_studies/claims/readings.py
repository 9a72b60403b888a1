"""What a sentence of the paper leaves open: the readings of a claim with their bounds, and one verdict from several.

The rule by which bounds are read is in ``docs/reading_the_claims.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

DEPENDS = "depends on the reading"


@dataclass(frozen=True, kw_only=True)
class Reading:
    """One reading of a claim.

    Parameters
    ----------
    name : {"a", "b"}
    words : str
        What this reading takes the sentence to say; empty where the claim has one reading only.
    lo, hi : float
        Bounds of the value; infinite where the claim states none.
    lo_open, hi_open : bool
        True if the bound itself is outside.
    """

    name: str
    words: str
    lo: float
    hi: float
    lo_open: bool
    hi_open: bool

    @property
    def bounds(self) -> str:
        """The bounds in words; empty where there are none."""
        if self.lo == self.hi:
            return f"{self.lo:g}"
        if math.isfinite(self.lo) and math.isfinite(self.hi) and not (self.lo_open or self.hi_open):
            return f"{self.lo:g} .. {self.hi:g}"
        least = f"{'above' if self.lo_open else 'at least'} {self.lo:g}" if math.isfinite(self.lo) else ""
        most = f"{'below' if self.hi_open else 'at most'} {self.hi:g}" if math.isfinite(self.hi) else ""
        return ", ".join(filter(None, [least, most]))


def readings_of(claim: Mapping[Any, Any]) -> list[Reading]:
    """Return the readings of a claim.

    Parameters
    ----------
    claim : mapping
        A row of ``data/paper_claims.csv``, column to text.

    Returns
    -------
    list of Reading
        One, or two where the sentence leaves two readings open.
    """
    names = ["a", "b"] if claim["reading_b"] else ["a"]
    return [_reading(claim, name, "" if name == "a" else "_b") for name in names]


def _reading(claim: Mapping[Any, Any], name: str, end: str) -> Reading:
    """Return a reading from the columns whose names have this end."""
    return Reading(
        name=name,
        words=claim[f"reading_{name}"],
        lo=_number(claim[f"lo{end}"], -math.inf),
        hi=_number(claim[f"hi{end}"], math.inf),
        lo_open=claim[f"lo{end}_open"] == "yes",
        hi_open=claim[f"hi{end}_open"] == "yes",
    )


def _number(text: str, missing: float) -> float:
    """Return the number in a cell of the claims file, or `missing` where it is empty."""
    return float(text) if text else missing


def by_reading(texts: Sequence[str]) -> str:
    """Join what belongs to the readings of a claim.

    Parameters
    ----------
    texts : sequence of str
        One for each reading.

    Returns
    -------
    str
        The text itself if there is one; else each with the name of its reading.

    Examples
    --------
    >>> by_reading(["20 m"]), by_reading(["1 at 20 m", "25 m"])
    ('20 m', 'a: 1 at 20 m; b: 25 m')
    """
    if len(texts) == 1:
        return texts[0]
    return "; ".join(f"{name}: {text}" for name, text in zip("ab", texts, strict=True))


def one_verdict(verdicts: Sequence[str]) -> str:
    """Return the verdict on a claim from the verdicts on its readings.

    Parameters
    ----------
    verdicts : sequence of str
        One for each reading.

    Returns
    -------
    str
        The verdict that all readings have, else `DEPENDS`.

    Examples
    --------
    >>> one_verdict(["reproduced", "reproduced"]), one_verdict(["reproduced", "undecided"])
    ('reproduced', 'depends on the reading')
    """
    return verdicts[0] if len(set(verdicts)) == 1 else DEPENDS
