"""A model of the processing limit of the authors' computer: periods lost at the start of a motion (IV-E).

"There was some delay in marker detection to blinker ID recognition when confronted with an abundance of event
data", and "shorter distances in this experiment meant shorter evaluation periods" (IV-E). We read this as follows. The
events of a period are buffered and then processed at a limited rate. SORT with its published settings reports a track
once it was found in `HITS` periods in a row. The first ID is known when the last of these periods is processed; all
periods from the marker's entering until then have no ID. The evaluation of a still marker begins when its ID is
already being read, so nothing is lost there, however many events there are; its readings are only late.
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
    """Draw the number of periods without an ID after the marker has come into view, or has begun to turn.

    It is ``floor(hits - 1 + delay + u)``, with `delay_periods` and with u drawn evenly from 0 .. 1, since the marker
    may come into view anywhere in a period.

    Parameters
    ----------
    mev_per_s : float
        Rate of events [Mev/s].
    rng : numpy.random.Generator
        Chance for u.
    limit_mev_per_s : float, optional
        Rate at which the computer processes events [Mev/s]; None takes the one in `constants.csv`.
    hits : int
        Number of periods in a row in which a track must be found.

    Returns
    -------
    int

    Examples
    --------
    >>> [periods_lost(rate, np.random.default_rng(0), limit_mev_per_s=20.0) for rate in (0.1, 20, 60)]
    [2, 3, 5]
    """
    return math.floor(hits - 1 + delay_periods(mev_per_s, limit_mev_per_s) + rng.random())


def delay_periods(mev_per_s: float, limit_mev_per_s: float | None = None) -> float:
    """Return how long the events of one period are processed.

    Parameters
    ----------
    mev_per_s : float
        Rate of events [Mev/s].
    limit_mev_per_s : float, optional
        Rate at which the computer processes events [Mev/s]; None takes the one in `constants.csv`.

    Returns
    -------
    float
        Processing time, in periods.

    Raises
    ------
    ValueError
        If the limit is not above 0.
    """
    limit = constant("processing_mev_per_s") if limit_mev_per_s is None else limit_mev_per_s
    if not limit > 0:
        raise ValueError(f"limit_mev_per_s={limit} processes no events; choose more than 0 Mev/s")
    return mev_per_s / limit


def delay_ms(mev_per_s: float, limit_mev_per_s: float | None = None) -> float:
    """Return how long after the end of a period its reading is known.

    Parameters
    ----------
    mev_per_s : float
        Rate of events [Mev/s].
    limit_mev_per_s : float, optional
        As in `delay_periods`.

    Returns
    -------
    float
        Delay [ms].
    """
    return delay_periods(mev_per_s, limit_mev_per_s) * paper.DELTA_T_WHOLE_US / 1e3
