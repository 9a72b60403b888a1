"""Plots of the accuracy under stress, and of how many readings of clutter pass each test of a receiver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

STYLES = (("#D55E00", "o", "-"), ("#0072B2", "s", "--"), ("#009E73", "^", "-."))


def draw_stress(table: pd.DataFrame, ax: Axes, *, label: str, worse_is_less: bool = False) -> Axes:
    """Draw the accuracy of each receiver over the levels of one stressor, with bars of its 95 % intervals.

    Levels are drawn at equal distances, in their order, since no scale shows all of them apart.

    Parameters
    ----------
    table : DataFrame
        ``receiver``, ``level``, ``accuracy``, ``low``, ``high``; see `stressors.stress_curves`.
    ax : Axes
    label : str
        Quantity (unit) of the level.
    worse_is_less : bool
        True where small levels are the worst ones; they are then on the right.

    Returns
    -------
    Axes
    """
    levels = np.unique(table["level"].to_numpy(float))
    receivers = list(dict.fromkeys(table["receiver"]))
    for k, receiver in enumerate(receivers):
        own = table[table["receiver"] == receiver].sort_values("level")
        color, marker, line = STYLES[k % len(STYLES)]
        place = np.searchsorted(levels, own["level"].to_numpy(float)) + 0.06 * (k - (len(receivers) - 1) / 2)
        value, low, high = (own[name].to_numpy(float) for name in ("accuracy", "low", "high"))
        bars = np.maximum([value - low, high - value], 0.0)
        ax.errorbar(place, value, yerr=bars, color=color, marker=marker, linestyle=line, elinewidth=1.2,
                    label=receiver, clip_on=False)  # fmt: skip
    ax.set(xlabel=label, ylabel="accuracy (share of periods)", ylim=(0, 1.04))
    ax.set_xticks(range(levels.size), [f"{level:g}" for level in levels])
    if worse_is_less:
        ax.invert_xaxis()
    return ax


def draw_funnel(counts: pd.DataFrame, ax: Axes, *, stages: Sequence[str], of: str) -> Axes:
    """Draw a group of horizontal bars for each row, one bar per stage, on a logarithmic axis.

    Each bar has its count beside it; a count of 0 has a bar that ends at 0.5.

    Parameters
    ----------
    counts : DataFrame
        One row for each group, with the column `of` for its name and a column for each stage (count).
    ax : Axes
    stages : sequence of str
        Columns, from the first stage to the last.
    of : str
        Column with the names of the groups.

    Returns
    -------
    Axes
    """
    height = 0.8 / len(stages)
    for k, stage in enumerate(stages):
        value = counts[stage].to_numpy(float)
        y = np.arange(value.size) + (k - (len(stages) - 1) / 2) * height
        ax.barh(y, np.maximum(value, 0.5), height * 0.9, left=0.0, label=stage.replace("_", " "))
        for at, number in zip(y, value, strict=True):
            ax.text(max(number, 0.5) * 1.15, at, f"{number:.0f}", va="center", fontsize=8)
    ax.set_xscale("log")
    ax.set(xlim=(0.5, counts[list(stages)].to_numpy(float).max(initial=10) * 6), xlabel="count")
    ax.xaxis.set_major_locator(FixedLocator([10.0**n for n in range(7)]))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FormatStrFormatter("%d"))
    ax.set_yticks(range(len(counts)), list(counts[of]))
    ax.set_ylim(len(counts) - 0.5, -0.5)
    ax.grid(visible=False, axis="y")
    return ax
