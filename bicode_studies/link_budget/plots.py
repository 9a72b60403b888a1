"""Figures of the link budget and of the decoder's limits: they draw the tables that the other files compute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

TICKS_M = (5, 7.5, 10, 15, 20, 30, 40, 60)
TICKS_MA = (1, 2, 5, 10, 20, 50)
STYLES = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#CC79A7", "D", ":"))


def draw_error_rates(
    events_per_edge: npt.ArrayLike,
    measured: Mapping[str, pd.DataFrame],
    predicted: Mapping[str, npt.ArrayLike],
    ax: Axes,
    *,
    quantity: str,
) -> Axes:
    """Draw error rates over the number of events per edge: marks with 95 % bars as measured, lines as predicted.

    Parameters
    ----------
    events_per_edge : array_like, shape (n,)
        Mean number of events of an edge.
    measured : mapping of str to DataFrame
        By name: columns ``rate``, ``low``, ``high`` (0 .. 1), n rows each. A rate of 0 is drawn as a triangle at the
        upper end of its interval.
    predicted : mapping of str to array_like, shape (n,)
        Rates by theory, 0 .. 1, by the same names.
    ax : Axes
    quantity : str
        What the rate counts, for the label of the axis.

    Returns
    -------
    Axes
    """
    x = np.asarray(events_per_edge, float)
    for (name, table), (color, mark, line) in zip(measured.items(), STYLES, strict=False):
        rate, low, high = (table[column].to_numpy(float) for column in ("rate", "low", "high"))
        counted = rate > 0
        bars = np.maximum([rate - low, high - rate], 0.0)[:, counted]
        ax.errorbar(
            x[counted], rate[counted], yerr=bars, color=color, marker=mark, linestyle="none", label=f"{name}, measured"
        )
        ax.plot(x[~counted], high[~counted], linestyle="none", marker="v", color=color, markerfacecolor="none")
        ax.plot(x, np.asarray(predicted[name], float), color=color, linestyle=line, label=f"{name}, theory")
    ax.set(xscale="log", yscale="log", ylim=(3e-4, 1.3), xlabel="mean events per edge", ylabel=f"{quantity} (share)")
    _label_ticks(ax.xaxis, x.tolist())
    return ax


def draw_shares(table: pd.DataFrame, ax: Axes, *, over: str, xlabel: str, ylabel: str) -> Axes:
    """Draw shares of several groups over a length, one curve with 95 % bars for each group.

    Parameters
    ----------
    table : DataFrame
        ``name`` (of the group), the column `over`, ``share``, ``low``, ``high`` (0 .. 1).
    ax : Axes
    over : str
        Column for the horizontal axis.
    xlabel, ylabel : str
        Quantities (units).

    Returns
    -------
    Axes
    """
    for (name, rows), (color, mark, line) in zip(table.groupby("name", sort=False), STYLES, strict=False):
        share, low, high = (rows[column].to_numpy(float) for column in ("share", "low", "high"))
        bars = np.maximum([share - low, high - share], 0.0)
        ax.errorbar(
            rows[over].to_numpy(float), share, yerr=bars, color=color, marker=mark, linestyle=line, label=str(name)
        )
    ax.set(xscale="log", ylim=(0, 1.04), xlabel=xlabel, ylabel=ylabel)
    _label_ticks(ax.xaxis, np.unique(table[over].to_numpy(float)).tolist())
    return ax


def draw_undetected(shares: Mapping[str, Sequence[float]], names: Sequence[str], ax: Axes) -> Axes:
    """Draw the shares of errors that pass each checksum as bars, labelled in percent.

    Parameters
    ----------
    shares : mapping of str to sequence of float
        By name of the checksum: a share, 0 .. 1, for each kind of error.
    names : sequence of str
        The kinds of error.
    ax : Axes

    Returns
    -------
    Axes
    """
    width = 0.8 / len(shares)
    for k, ((name, values), (color, _, _)) in enumerate(zip(shares.items(), STYLES, strict=False)):
        x = np.arange(len(names)) + (k - (len(shares) - 1) / 2) * width
        ax.bar(x, values, width * 0.92, color=color, label=name, hatch="//" if k else None, edgecolor="white")
        for at, value in zip(x, values, strict=True):
            ax.text(at, value + 0.01, f"{100 * value:.0f}", ha="center", fontsize=9)
    ax.set_xticks(range(len(names)), names)
    ax.set(ylim=(0, 1), ylabel="share that passes the checksum")
    ax.grid(axis="x", visible=False)
    return ax


def draw_budget(table: pd.DataFrame, ax: Axes) -> Axes:
    """Draw expected accuracy over distance as a line, and recorded accuracy as marks with 95 % bars.

    Parameters
    ----------
    table : DataFrame
        ``distance_m``, ``budget``, ``recorded``, ``low``, ``high``; see `paper_ranges.budget_beside_recordings`.
    ax : Axes

    Returns
    -------
    Axes
    """
    x, recorded, low, high = (table[name].to_numpy(float) for name in ("distance_m", "recorded", "low", "high"))
    ax.plot(x, table["budget"].to_numpy(float), color=STYLES[0][0], label="link budget")
    bars = np.maximum([recorded - low, high - recorded], 0.0)
    ax.errorbar(x, recorded, yerr=bars, color=STYLES[1][0], marker="s", linestyle="none", label="recordings")
    ax.set(ylim=(0, 1.04), xlabel="distance (m)", ylabel="accuracy (share of periods)")
    ax.legend()
    return ax


def draw_ranges(table: pd.DataFrame, ax: Axes) -> Axes:
    """Draw the range over current times the visible share of the face, with the line of the inverse square law.

    The line goes through the first row of the table. On it, current x (projected area / face area) / distance^2 is
    constant.

    Parameters
    ----------
    table : DataFrame
        ``light_ma`` (current times projected over face area), ``paper_m``, ``budget_m``, and ``current_ma``,
        ``size_m``, ``yaw_deg`` for the labels; see `paper_ranges.paper_ranges`.
    ax : Axes

    Returns
    -------
    Axes
    """
    first = table.iloc[0]
    ends = np.array([table["light_ma"].min() / 1.6, table["light_ma"].max() * 2])
    line = first["paper_m"] * np.sqrt(ends / first["light_ma"])
    ax.plot(
        ends, line, color="black", linewidth=1, linestyle=":", label="current x area / distance² as for the first range"
    )
    ax.vlines(table["light_ma"], table["paper_m"], table["budget_m"], color="#BBBBBB", linewidth=1)
    ax.plot(table["light_ma"], table["budget_m"], "o", color="#0072B2", label="link budget, half of the periods right")
    ax.plot(table["light_ma"], table["paper_m"], "o", color="black", markerfacecolor="none", markersize=11,
            markeredgewidth=1.4, label="paper")  # fmt: skip
    columns = (table[name].to_numpy(float) for name in ("size_m", "current_ma", "yaw_deg", "light_ma", "paper_m"))
    for size_m, current_ma, yaw_deg, light_ma, range_m in zip(*columns, strict=True):
        name = f"{100 * size_m:g} cm, {current_ma:g} mA" + (f", {yaw_deg:g}°" if yaw_deg else "")
        ax.annotate(name, (light_ma, range_m), xytext=(9, -12), textcoords="offset points", fontsize=9)
    ax.set(xscale="log", yscale="log", xlim=ends, ylim=(TICKS_M[0], TICKS_M[-1]))
    ax.set(xlabel="LED current x projected area / face area (mA)", ylabel="range of the ID (m)")
    _label_ticks(ax.xaxis, TICKS_MA)
    _label_ticks(ax.yaxis, TICKS_M)
    ax.legend(loc="upper left")
    return ax


def _label_ticks(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis at the given values."""
    axis.set_major_locator(FixedLocator(list(ticks)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FormatStrFormatter("%g"))
