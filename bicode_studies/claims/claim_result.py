"""What we find for one claim of the paper: a number with its interval, a fact, or a reason why there is neither."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

Tables = Mapping[str, pd.DataFrame]
"""Rows of trials by figure, "08" to "14"."""


class NoTrials(LookupError):
    """Raised where a figure has no trials, or none at the condition that is asked for."""


@dataclass(frozen=True, kw_only=True)
class ClaimResult:
    """What we find for one claim.

    Parameters
    ----------
    ours : str
        Our finding in words and numbers.
    value, low, high : float, optional
        The number that is judged, and the ends of its 95 % interval, which is shown.
    judged_low, judged_high : float, optional
        Ends of the interval that is judged, wider than the 95 % one for the number of claims.
    band : float
        By how much the bounds are widened: a difference that the paper itself cannot tell.
    lo, hi : float, optional
        Bounds of agreement, where the claim itself states none.
    is_order : bool
        True where `value` is a difference that must be above 0. If its interval holds 0, the order is a tie.
    broken : str
        Where the order goes the other way by more than chance; empty if it does so nowhere.
    holds : bool, optional
        For a fact without chance: whether it is as the paper says.
    is_input : bool
        True for a fact that the package or the trials take from the paper, so that agreement is no evidence.
    why_not : str
        Why the claim cannot be tested; empty if it can.
    """

    ours: str = ""
    value: float | None = None
    low: float | None = None
    high: float | None = None
    judged_low: float | None = None
    judged_high: float | None = None
    band: float = 0.0
    lo: float | None = None
    hi: float | None = None
    is_order: bool = False
    broken: str = ""
    holds: bool | None = None
    is_input: bool = False
    why_not: str = ""

    def bounds(self, lo: float, hi: float) -> tuple[float, float]:
        """Return the bounds of agreement: those of this result where it has its own, else those of the claim.

        Parameters
        ----------
        lo, hi : float
            Bounds of the claim.

        Returns
        -------
        lo, hi : float
            0 and infinity for an order.
        """
        if self.is_order:
            return 0.0, math.inf
        return (lo if self.lo is None else self.lo), (hi if self.hi is None else self.hi)
