"""Plots of what sets the range of the ID: accuracy over distance, and range over the receiver's least region."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator

from bicode_studies.plots.accuracy import LEVEL_COLORS, set_distance_axis

MARKS = ("o", "s", "D", "^")  # of receivers
LINES = ("--", "-")  # of currents, from the lowest


def draw_far_accuracy(accuracies: pd.DataFrame, ax: Axes) -> Axes:
    """Draw the accuracy of the ID over distance, one line for each receiver and current.

    Parameters
    ----------
    accuracies : DataFrame
        ``receiver``, ``current_ma``, ``distance_m``, ``accuracy``, and ``low`` and ``high`` of its interval.
    ax : Axes
        Where to draw.

    Returns
    -------
    Axes
    """
    for receiver, current_ma, mine in _lines(accuracies):
        bars = np.maximum([mine["accuracy"] - mine["low"], mine["high"] - mine["accuracy"]], 0)
        drawn = _style(accuracies, receiver, current_ma)
        ax.errorbar(mine["distance_m"], mine["accuracy"], yerr=bars, elinewidth=1, clip_on=False, **drawn)
    set_distance_axis(ax).set(xlim=(accuracies["distance_m"].min() * 0.9, accuracies["distance_m"].max() * 1.1))
    ax.axhline(0.5, color="grey", linewidth=1, linestyle=":")
    ax.xaxis.set_major_locator(FixedLocator([10, 15, 20, 30, 40, 60, 80]))
    return ax


def draw_ranges(ranges: pd.DataFrame, ax: Axes, *, light_m: Mapping[float, float], stated: pd.DataFrame) -> Axes:
    """Draw the range of the ID over the receiver's least region, one line for each receiver and current.

    Ranges that lie beyond the last distance have a triangle, which means "at least".

    Parameters
    ----------
    ranges : DataFrame
        Rows of `range_limits.id_ranges`.
    ax : Axes
        Where to draw.
    light_m : mapping of float to float
        By current [mA], the range that the light alone gives [m]: level lines, because the light does not know the
        receiver.
    stated : DataFrame
        The paper's ranges, hollow and black: ``min_region_pixels`` and ``range_m``.

    Returns
    -------
    Axes
    """
    for receiver, current_ma, mine in _lines(ranges):
        bars = np.maximum([mine["range_m"] - mine["low"], mine["high"] - mine["range_m"]], 0)
        drawn = _style(ranges, receiver, current_ma)
        ax.errorbar(mine["min_region_pixels"], mine["range_m"], yerr=bars, elinewidth=1, clip_on=False, **drawn)
        more = mine[mine["beyond"]]
        if len(more):  # an empty line has a place, too, and the layout would make room for it
            ax.plot(more["min_region_pixels"], more["range_m"] * 1.05, "^", color=drawn["color"], clip_on=False)
    for number, (current_ma, range_m) in enumerate(light_m.items()):
        label = f"light alone, {current_ma:g} mA"
        ax.axhline(range_m, color="black", linewidth=1, linestyle=(":", "-.")[number % 2], label=label)
    hollow: dict[str, Any] = {
        "color": "black",
        "markerfacecolor": "none",
        "markersize": 10,
        "markeredgewidth": 1.4,
        "zorder": 5,
    }
    ax.plot(stated["min_region_pixels"], stated["range_m"], "o", label="the paper", **hollow)
    ax.set(xlabel="least region (px)", ylabel="range of the ID (m)", ylim=(0, None))
    ax.xaxis.set_major_locator(FixedLocator(sorted(ranges["min_region_pixels"].unique())))
    ax.xaxis.set_minor_locator(NullLocator())
    return ax


def _lines(table: pd.DataFrame) -> list[tuple[str, float, pd.DataFrame]]:
    """Return the rows of each line, with its receiver and its current, in the order of the table."""
    pairs = table[["receiver", "current_ma"]].drop_duplicates().itertuples(index=False)
    return [(r, ma, table[(table["receiver"] == r) & (table["current_ma"] == ma)]) for r, ma in pairs]


def _style(table: pd.DataFrame, receiver: str, current_ma: float) -> dict[str, Any]:
    """Return how the line of a receiver and a current is drawn, by their order in the table."""
    number = list(table["receiver"].unique()).index(receiver)
    level = sorted(table["current_ma"].unique()).index(current_ma)
    return {
        "color": LEVEL_COLORS[number], "marker": MARKS[number], "markersize": 5, "linestyle": LINES[level % 2],
        "label": f"{receiver}, {current_ma:g} mA",
    }  # fmt: skip
