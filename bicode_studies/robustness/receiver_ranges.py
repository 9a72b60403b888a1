"""How far is an ID read?   accuracy over distance, seed by seed -> where it falls to a half, and how receivers compare

IV-A says of a distance that a marker "could be recognized" there; read as an accuracy of a half (the
paper's 20 m at "about 50 %", IV-D). Between two distances the accuracy is taken as a straight line.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_studies.robustness.stressors import DISTANCE

HALF = 0.5


def crossing_m(distances_m: npt.ArrayLike, accuracy: npt.ArrayLike) -> float:
    """Distances [m], rising, and the accuracy at each in; where it falls below a half for the first time [m] out.

    Infinite where it never does, nan where it is below a half from the beginning.

    Examples
    --------
    >>> crossing_m([10, 20, 30], [1.0, 0.75, 0.25])
    25.0
    """
    d, a = np.asarray(distances_m, float), np.asarray(accuracy, float)
    below = np.flatnonzero(a < HALF)
    if not below.size or below[0] == 0:
        return float("nan") if below.size else float("inf")
    k = int(below[0])
    return float(d[k - 1] + (a[k - 1] - HALF) / (a[k - 1] - a[k]) * (d[k] - d[k - 1]))


def receiver_ranges(table: pd.DataFrame, rng: np.random.Generator, n: int = 1000) -> pd.DataFrame:
    """Rows of `evaluation.stress.stress` over distance in, a row for each receiver out.

    Parameters
    ----------
    table : DataFrame
        Other stressors in it are left out.
    rng : numpy.random.Generator
        For the intervals: seeds are drawn anew, the same ones for all receivers.
    n : int
        Draws.

    Returns
    -------
    DataFrame
        ``receiver``; ``range_m``, ``low``, ``high``; ``times_paper`` (its range over that of the paper's rule),
        ``times_low``, ``times_high``; ``wrong_ids`` in ``periods``; intervals are of 95 %.
    """
    own = table[table["stressor"] == DISTANCE.name]
    own = own.assign(share=own["right"] / own["periods"])
    receivers = list(dict.fromkeys(own["receiver"]))
    shares = np.stack(
        [own[own["receiver"] == r].pivot(index="seed", columns="level", values="share").to_numpy() for r in receivers]
    )  # receiver, seed, distance
    distances = np.unique(own["level"])
    n_seeds = shares.shape[1]
    drawn = shares[:, rng.integers(n_seeds, size=(n, n_seeds))].mean(axis=2)  # receiver, draw, distance
    ranges = np.array([[crossing_m(distances, accuracy) for accuracy in rows] for rows in drawn])
    rows = []
    for k, receiver in enumerate(receivers):
        middle = crossing_m(distances, shares[k].mean(axis=0))
        first = crossing_m(distances, shares[0].mean(axis=0))
        low, high = np.nanquantile(ranges[k], (0.025, 0.975), method="nearest")
        times_low, times_high = np.nanquantile(ranges[k] / ranges[0], (0.025, 0.975), method="nearest")
        mine = own[own["receiver"] == receiver]
        rows.append(
            {
                "receiver": receiver, "range_m": middle, "low": low, "high": high,
                "times_paper": middle / first, "times_low": times_low, "times_high": times_high,
                "wrong_ids": int(mine["wrong_ids"].sum()), "periods": int(mine["periods"].sum()),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)
