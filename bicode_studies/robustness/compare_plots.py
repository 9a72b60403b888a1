"""The plot of how much more or less one receiver reads than the better of two others, over all conditions."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

WORSE, AS_GOOD = ("#D55E00", "v"), ("#0072B2", "o")


def draw_differences(verdicts: pd.DataFrame, ax: Axes) -> Axes:
    """Draw the difference of each condition with its interval, from the least to the largest.

    Conditions in which the receiver is worse have triangles of their own colour.

    Parameters
    ----------
    verdicts : DataFrame
        ``difference``, ``low``, ``high``, ``is_worse``; see `never_worse.verdicts`.
    ax : Axes

    Returns
    -------
    Axes
    """
    ordered = verdicts.sort_values("difference", kind="stable").reset_index(drop=True)
    for is_worse, (color, marker), label in ((True, WORSE, "worse"), (False, AS_GOOD, "at least as good")):
        own = ordered[ordered["is_worse"] == is_worse]
        value, low, high = (own[name].to_numpy(float) for name in ("difference", "low", "high"))
        bars = np.maximum([value - low, high - value], 0.0)
        ax.errorbar(own.index.to_numpy(), value, yerr=bars, color=color, marker=marker, linestyle="none", markersize=3,
                    elinewidth=0.6, label=f"{label} ({len(own)})")  # fmt: skip
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set(xlabel="condition, by its difference", ylabel="difference of accuracy", ylim=(-1.1, 1.1))
    return ax
