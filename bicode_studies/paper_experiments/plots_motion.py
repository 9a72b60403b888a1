"""Plots of the effects of motion: event rates and losses, accuracy over the delay of a box, background rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from bicode_studies.plots.accuracy import LEVEL_COLORS, set_distance_axis

HOW_COLORS = {"still": "#000000", "pan": "#0072B2", "spin": "#D55E00"}
RECEIVERS: dict[str, dict[str, Any]] = {
    "ours": {"linestyle": "-", "marker": "o", "markerfacecolor": "none"},
    "authors": {"linestyle": ":", "marker": "D"},
}
WITH_LIMIT = "with a processing limit (our model)"
"""How a legend calls the trials called "authors": what the authors' computer would have lost, by our model of it."""


def draw_rate_and_loss(rates: pd.DataFrame, axes: Sequence[Axes]) -> None:
    """Draw the event rate over distance, the loss of IDs over distance, and the loss over the rate.

    Over distance, only the fastest curve of each way of motion is drawn; the table has the others.

    Parameters
    ----------
    rates : DataFrame
        As `motion_loss.rate_and_loss` returns it.
    axes : sequence of 3 Axes
        For the three plots, in this order.
    """
    by_distance, lost, lost_by_rate = axes
    for number, (how, mine) in enumerate(rates.groupby("how", sort=False)):
        nudge = 1.04 ** (number - 1)  # intervals stand side by side
        fastest = mine[mine["level"] == mine["level"].max()]
        color = HOW_COLORS[str(how)]
        level = fastest["level"].iloc[0]
        name = f"{how} {level:g}" if level else str(how)
        ours = fastest[fastest["receiver"] == "ours"].sort_values("distance_m")
        by_distance.plot(ours["distance_m"], ours["mev_per_s"], "o-", color=color, label=name)
        for receiver, style in RECEIVERS.items():
            of = fastest[fastest["receiver"] == receiver].sort_values("distance_m")
            bars = np.maximum([of["lost"] - of["low"], of["high"] - of["lost"]], 0)
            lost.errorbar(
                of["distance_m"] * nudge, of["lost"], yerr=bars, color=color, label=_label(name, receiver), **style
            )
            every = mine[mine["receiver"] == receiver]
            dots = {**style, "linestyle": "none"}
            lost_by_rate.plot(every["mev_per_s"], every["lost"], color=color, label=_label(how, receiver), **dots)
    for ax in (by_distance, lost):
        set_distance_axis(ax)
    by_distance.set(ylim=(1e-3, 1), yscale="log", ylabel="events of the whole sensor (Mev/s)")
    by_distance.autoscale(axis="y")
    lost.set(ylabel="periods without the right ID (share)", ylim=(-0.02, 1.04))
    lost_by_rate.set(xscale="log", xlabel="events of the whole sensor (Mev/s)", ylim=(-0.02, 1.04))
    lost_by_rate.set(ylabel="periods without the right ID (share)")
    for axis in (by_distance.yaxis, lost_by_rate.xaxis):
        axis.set_major_locator(LogLocator(subs=(1, 3)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_formatter(NullFormatter())


def _label(name: object, receiver: str) -> str:
    """Return the name of a curve in a legend."""
    return f"{name}, {WITH_LIMIT}" if receiver == "authors" else str(name)


def draw_lag(accuracies: pd.DataFrame, expected: pd.DataFrame, ax: Axes, *, by: str, label: str) -> Axes:
    """Draw the accuracy over the delay of a box, one curve for each level, beside the overlap that is left.

    Parameters
    ----------
    accuracies : DataFrame
        `by`, ``lag`` (in periods), ``accuracy``, ``low``, ``high``.
    expected : DataFrame
        `by`, ``lag`` and ``overlap``, 0 .. 1; drawn as dashed lines in the colours of the curves.
    ax : Axes
    by : str
        Name of the column that holds the levels.
    label : str
        Format of a level in the legend, such as "{:g} m/s".

    Returns
    -------
    Axes
    """
    for number, (level, mine) in enumerate(accuracies.groupby(by)):
        of = mine.sort_values("lag")
        bars = np.maximum([of["accuracy"] - of["low"], of["high"] - of["accuracy"]], 0)
        beside = of["lag"] + 0.08 * (number - 1)  # no curve hides another
        line = ax.errorbar(beside, of["accuracy"], yerr=bars, fmt="o-", label=label.format(level))
        left = expected[expected[by] == level].sort_values("lag")
        name = "overlap that is left" if number == 0 else None
        ax.plot(left["lag"], left["overlap"], "--", color=line.lines[0].get_color(), alpha=0.5, label=name)
    ax.set(xlabel="delay of the box (periods of 33 ms)", ylabel="accuracy (share of periods)", ylim=(-0.02, 1.04))
    return ax


def draw_rates(rates: Mapping[str, npt.NDArray[np.float64]], ax: Axes) -> Axes:
    """Draw histograms of rates, with their means as dashed lines.

    Parameters
    ----------
    rates : mapping of str to ndarray, shape (periods,)
        By name, the rate in each period [Mev/s]. Rates far above the 99 % quantiles are drawn in the last bin.
    ax : Axes

    Returns
    -------
    Axes
    """
    largest = max(float(np.quantile(each, 0.99)) for each in rates.values())
    edges = np.linspace(0, 1.1 * largest, 41).tolist()
    for number, (name, each) in enumerate(rates.items()):
        weights = np.full(each.size, 1 / each.size)
        drawn: dict[str, Any] = {"histtype": "step", "linewidth": 1.8, "color": f"C{number}"}
        ax.hist(np.clip(each, 0, edges[-1]), edges, weights=weights, label=name, **drawn)
        ax.axvline(float(np.mean(each)), color=f"C{number}", linestyle="--", linewidth=1.2)
    ax.set(xlabel="events of the background (Mev/s)", ylabel="share of periods", xlim=(0, edges[-1]))
    return ax


def draw_patterns(accuracies: pd.DataFrame, ax: Axes) -> Axes:
    """Draw the accuracies of 2D markers with different patterns, in a group for each condition.

    Parameters
    ----------
    accuracies : DataFrame
        ``condition`` (its name), ``aruco_id``, ``accuracy``, ``low``, ``high``.
    ax : Axes

    Returns
    -------
    Axes
    """
    names = list(dict.fromkeys(accuracies["condition"]))
    for k, (pattern, mine) in enumerate(accuracies.groupby("aruco_id", sort=False)):
        at = [names.index(name) + 0.1 * (k - 1.5) for name in mine["condition"]]
        bars = [(mine["accuracy"] - mine["low"]).clip(lower=0), (mine["high"] - mine["accuracy"]).clip(lower=0)]
        again, number = divmod(k, len(LEVEL_COLORS))
        ax.errorbar(at, mine["accuracy"], yerr=bars, fmt="sD^v"[again % 4], color=LEVEL_COLORS[number], clip_on=False,
                    markerfacecolor="none" if again else None, label=f"pattern {pattern}")  # fmt: skip
    ax.set(xticks=range(len(names)), xticklabels=names, ylim=(0, 1.04))
    ax.set_ylabel("accuracy of the pose (share of periods)")
    return ax
