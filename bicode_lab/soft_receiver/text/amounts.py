"""What each bin of a chip says for ON and for OFF: its events, weighed in one of two ways.

Two ways to weigh a bin are offered, because no single one is right for every light. *Events* counts them, which is best
where each event comes by chance of its own (a Poisson process). *Marks* counts a bin of half the usual number or more
as one, and less as a part of it, which is best where all events of an edge come early or late together, or where their
number varies.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.levels import PHASES

Floats = npt.NDArray[np.float64]
Amounts = npt.NDArray[np.float32]
"""What each bin of each chip says for ON and for OFF, 0 or more; shape (chips, PHASES, 2)."""
Counts = npt.NDArray[np.int64]
Weighing = Literal["events", "marks"]

ON, OFF = 0, 1  # the order of the last axis
MOST_OF_USUAL = 4.0  # a bin counts at most as this many usual ones, and this many events
ONE_FLASH_IN = 500  # bins: one of so many may hold a flash of another light


def count_events(chips: Floats, is_on: npt.NDArray[np.bool_], first: int, n_chips: int) -> Counts:
    """Count the events in each bin of each chip.

    Parameters
    ----------
    chips : ndarray, shape (n,)
        Chip number of each event, with its fraction.
    is_on : ndarray of bool, shape (n,)
    first, n_chips : int
        Number of the first chip and how many chips are wanted.

    Returns
    -------
    ndarray of int64, shape (n_chips, PHASES, 2)

    Examples
    --------
    >>> counts = count_events(np.array([0.5, 1.0, 1.01]), np.array([True, False, False]), 0, 2)
    >>> counts[0, 8].tolist(), counts[1, 0].tolist(), int(counts.sum())
    ([1, 0], [0, 2], 3)
    """
    place = np.floor((chips - first) * PHASES).astype(np.int64)
    inside = (place >= 0) & (place < n_chips * PHASES)
    number = place[inside] * 2 + np.where(is_on[inside], ON, OFF)
    return np.bincount(number, minlength=n_chips * PHASES * 2).reshape(n_chips, PHASES, 2)


def usual_count(counts: npt.ArrayLike) -> float:
    """Return the count that half of all events have or exceed in their bins; the largest of 500 bins are left out.

    Parameters
    ----------
    counts : array_like
        Events in each bin.

    Returns
    -------
    float
        1 or more.

    Examples
    --------
    >>> usual_count([0, 1, 1, 1, 40, 0, 40]), usual_count([0, 0])
    (40.0, 1.0)
    """
    held = np.sort(np.asarray(counts, np.float64), axis=None)
    held = held[held > 0]
    held = held[: held.size - held.size // ONE_FLASH_IN]
    if not held.size:
        return 1.0
    total = np.cumsum(held)
    return float(held[np.searchsorted(total, total[-1] / 2)])


def weigh(counts: Counts, weighing: Weighing) -> Amounts:
    """Turn counts into amounts.

    Parameters
    ----------
    counts : ndarray, shape (chips, PHASES, 2)
        See `count_events`.
    weighing : {"events", "marks"}
        See the top of this file.

    Returns
    -------
    ndarray of float32, shape (chips, PHASES, 2)

    Examples
    --------
    >>> counts = np.zeros((2, 16, 2), int)
    >>> counts[0, 3, 0], counts[1, 3, 0], counts[1, 9, 0] = 40, 40, 1
    >>> weigh(counts, "marks")[[0, 1], [3, 9], 0].astype(float).round(2).tolist()
    [1.0, 0.05]
    """
    amounts = np.empty(counts.shape, np.float32)
    for side in (ON, OFF):
        usual = usual_count(counts[..., side])
        if weighing == "events":
            amounts[..., side] = np.minimum(counts[..., side], MOST_OF_USUAL * (usual + 1))
        else:
            amounts[..., side] = np.minimum(counts[..., side] / max(usual / 2, 1.0), 1.0)
    return amounts
