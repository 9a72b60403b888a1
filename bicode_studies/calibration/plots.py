"""Plots of the calibration: misfits of candidates, accuracies over a constant, and curves of events per blink."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, NullLocator

STYLES = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#CC79A7", "D", ":"))
LEAST_EVENTS = 0.1  # of a blink; points below are not drawn


def draw_misfit(table: pd.DataFrame, in_use: float, ax: Axes, *, by: str, most: float) -> Axes:
    """Draw the misfit of each candidate over one of its constants, and the value in use as a line.

    Parameters
    ----------
    table : DataFrame
        As `search.calibrate` returns it: the constants, ``blocks``, cells (nan where a candidate was given up),
        ``sum``.
    in_use : float
        The value in use of the constant.
    ax : Axes
    by : str
        Name of the constant.
    most : float
        End of the axis of misfits; larger misfits are drawn there.

    Returns
    -------
    Axes
    """
    given_up = table.isna().any(axis=1)
    again = ~given_up & (table["blocks"] > table["blocks"].min())
    kinds: tuple[tuple[str, pd.Series[bool], dict[str, Any]], ...] = (
        ("given up (at least)", given_up, {"marker": "^", "color": "0.6", "markerfacecolor": "none", "markersize": 4}),
        ("tried once", ~given_up & ~again, {"marker": "o", "color": "#0072B2", "markersize": 5}),
        ("tried again", again, {"marker": "D", "color": "#D55E00", "markersize": 6}),
    )
    for label, rows, style in kinds:
        ax.plot(table.loc[rows, by], table.loc[rows, "sum"].clip(upper=most), linestyle="none", label=label, **style)
    ax.axvline(in_use, color="black", linewidth=1, label="in use")
    ax.set(xlabel=by, ylabel="misfit of Fig. 8's claims (sum)", ylim=(0, most * 1.04))
    return ax


def draw_readings(table: pd.DataFrame, in_use: float, ax: Axes, *, by: str, xlabel: str) -> Axes:
    """Draw accuracies over the values of a constant, with 95 % intervals, and the value in use as a line.

    Parameters
    ----------
    table : DataFrame
        ``value``, ``accuracy``, ``low``, ``high``, and the column `by`, whose values name the curves.
    in_use : float
        The value in use of the constant.
    ax : Axes
    by : str
        Name of the column that tells the curves apart.
    xlabel : str
        Label of the axis of values.

    Returns
    -------
    Axes
    """
    for (name, group), (color, mark, line) in zip(table.groupby(by, sort=False), STYLES, strict=False):
        bars = [group["accuracy"] - group["low"], group["high"] - group["accuracy"]]
        ax.errorbar(group["value"], group["accuracy"], yerr=bars, color=color, marker=mark, linestyle=line,
                    label=str(name))  # fmt: skip
    ax.axvline(in_use, color="black", linewidth=1, label="in use")
    ax.set(xlabel=xlabel, ylabel="ID right (share of periods)", xscale="log", ylim=(-0.03, 1.03))
    ticks = sorted(set(table["value"]))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.legend()
    return ax


def draw_blinks(
    curves: Mapping[str, pd.DataFrame], ax: Axes, *, measured: Mapping[str, pd.DataFrame] | None = None
) -> Axes:
    """Draw the events per blink over the rate of blinking, simulated curves as lines and measured ones as points.

    Parameters
    ----------
    curves : mapping of str to DataFrame
        By name: ``blink_hz`` and ``events``, see `real_light.blink_response`.
    ax : Axes
    measured : mapping of str to DataFrame, optional
        The same of a real camera, in the order of the curves; drawn hollow and black.

    Returns
    -------
    Axes
    """
    for (name, curve), (color, mark, line) in zip(curves.items(), STYLES, strict=False):
        seen = curve[curve["events"] >= LEAST_EVENTS]
        ax.plot(seen["blink_hz"], seen["events"], color=color, marker=mark, linestyle=line, label=name)
    for (name, curve), (_, mark, _) in zip((measured or {}).items(), STYLES, strict=False):
        ax.plot(curve["blink_hz"], curve["events"], linestyle="none", marker=mark, color="black",
                markerfacecolor="none", label=name)  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="blinks per second (Hz)", ylabel="events per blink")
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.legend(fontsize=9)
    return ax
