"""IV-E: why are near markers in motion lost?   events a second -> periods without a reading, at first

"There was some delay in marker detection to blinker ID recognition when confronted with an abundance of event
data", and "shorter distances in this experiment meant shorter evaluation periods" (IV-E). Read so: a period is
buffered, then worked through at so many events a second; SORT with its published settings reports a track once it
was found in HITS periods in a row. The first ID is there when the last of them is through, and the periods from the
marker's coming into view until then have none. The evaluation of a still marker begins when it is being read, so
there nothing is lost, however many its events are; its readings are late.
"""

from __future__ import annotations

import math

import numpy as np

from bicode_lab import paper
from bicode_lab.constants import constant

HITS = 3  # SORT's min_hits, as published


def periods_lost(
    mev_per_s: float, rng: np.random.Generator, limit_mev_per_s: float | None = None, hits: int = HITS
) -> int:
    """A rate of events in; periods without a reading since the marker came into view, or began to turn, out.

    ``hits`` periods are buffered; of the last one's events, `delay_periods` more go by until they are worked
    through. Where in a period the marker came into view is chance.

    Parameters
    ----------
    mev_per_s : float
    rng : numpy Generator
    limit_mev_per_s : float, optional
        What the PC works through; None takes the one in `constants.csv`.
    hits : int

    Examples
    --------
    >>> [periods_lost(rate, np.random.default_rng(0), limit_mev_per_s=20.0) for rate in (0.1, 20, 60)]
    [2, 3, 5]
    """
    return math.floor(hits - 1 + delay_periods(mev_per_s, limit_mev_per_s) + rng.random())


def delay_periods(mev_per_s: float, limit_mev_per_s: float | None = None) -> float:
    """A rate of events in, the time that one period's events take to be worked through out, in periods.

    Raises
    ------
    ValueError
        A limit that is not above 0.
    """
    limit = constant("processing_mev_per_s") if limit_mev_per_s is None else limit_mev_per_s
    if not limit > 0:
        raise ValueError(f"limit_mev_per_s={limit} works through nothing; choose more than 0 Mev/s")
    return mev_per_s / limit


def delay_ms(mev_per_s: float, limit_mev_per_s: float | None = None) -> float:
    """A rate of events in, how late a period's reading is behind its end out [ms]."""
    return delay_periods(mev_per_s, limit_mev_per_s) * paper.DELTA_T_WHOLE_US / 1e3
