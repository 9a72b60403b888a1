"""The interval code of an active marker: a number is sent by the distances between short pulses.

From one rise to the next there are four base periods (start), or two (a 0) or three (a 1). Eight bits follow a start,
the most significant first, and the word is sent again and again. So a word takes 20 to 28 base periods, and more ones
take longer. That is why it is no `LineCode`: its frames have no fixed length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bicode_lab.marker.packet import Bits

START_GAP, ZERO_GAP, ONE_GAP = 4, 2, 3


@dataclass(frozen=True, kw_only=True)
class IntervalLine:
    """Settings of the interval code.

    Parameters
    ----------
    rate_hz : float
        Base periods per second, above 0 and up to 200 000 [Hz]; 5000 is common.
    bits : int
        Bits of a number, 1 .. 16.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> line = IntervalLine(rate_hz=5000, bits=3)
    >>> "".join(map(str, line.encode(5)))
    '100010010100'
    >>> line.decode([4, 3, 2, 3])
    5
    """

    rate_hz: float = 5000.0
    bits: int = 8

    def __post_init__(self) -> None:
        if not 0 < self.rate_hz <= 200_000:
            raise ValueError(f"rate_hz={self.rate_hz} is not above 0 and up to 200000 Hz; choose the base rate")
        if not 1 <= self.bits <= 16:
            raise ValueError(f"bits={self.bits} is not in 1 .. 16; 8 are usual")

    @property
    def chip_us(self) -> float:
        """Base period [us]."""
        return 1e6 / self.rate_hz

    def gaps(self, value: int) -> list[int]:
        """Return the distances from each rise of a word to the next, the start first [base periods].

        Raises
        ------
        ValueError
            If the value does not fit the bits.
        """
        if not 0 <= value < 2**self.bits:
            raise ValueError(f"value={value} does not fit {self.bits} bits; choose 0 .. {2**self.bits - 1}")
        ones = [value >> shift & 1 for shift in range(self.bits - 1, -1, -1)]
        return [START_GAP, *(ONE_GAP if one else ZERO_GAP for one in ones)]

    def encode(self, value: int) -> Bits:
        """Return the levels of a word, one for each base period: each pulse lasts one."""
        gaps = self.gaps(value)
        chips = np.zeros(sum(gaps), np.uint8)
        chips[np.concatenate([[0], np.cumsum(gaps[:-1])])] = 1
        return chips

    def decode(self, gaps: Sequence[int]) -> int | None:
        """Return the number of a word from the distances of its rises, the start first; None if it is no word."""
        if len(gaps) != self.bits + 1 or gaps[0] != START_GAP or not set(gaps[1:]) <= {ZERO_GAP, ONE_GAP}:
            return None
        return int("".join("1" if gap == ONE_GAP else "0" for gap in gaps[1:]), 2)
