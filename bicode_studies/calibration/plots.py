"""Plots of the calibration: the posterior of constants, accuracies over a constant, and curves of events per blink."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, NullLocator

from bicode_lab.constants import all_constants
from bicode_studies.calibration.candidates import WHOLE
from bicode_studies.calibration.prior import SHAPES

STYLES = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#CC79A7", "D", ":"))
BARS = 20  # of a distribution, about
LEAST_EVENTS = 0.1  # of a blink; points below are not drawn


def draw_marginal(table: pd.DataFrame, prior: pd.DataFrame, in_use: float, ax: Axes, *, by: str) -> Axes:
    """Draw how the posterior of a constant is distributed, its prior, and the value in use as a line.

    Parameters
    ----------
    table : DataFrame
        As `posterior.posterior_table` returns it: ``weight`` and the constants.
    prior : DataFrame
        Draws from the prior, as `prior.prior_table` returns them.
    in_use : float
        The value in use of the constant.
    ax : Axes
    by : str
        Name of the constant.

    Returns
    -------
    Axes
    """
    bins, is_log = _bins(by)
    heights, _ = np.histogram(table[by], bins, weights=table["weight"])
    ax.stairs(heights, bins, fill=True, color="#0072B2", alpha=0.6, label="posterior")
    ax.stairs(np.histogram(prior[by], bins)[0] / len(prior), bins, color="0.4", linestyle="--", label="prior")
    ax.axvline(in_use, color="black", linewidth=1, label="in use")
    ax.set(xlabel=by, ylabel="share", xscale="log" if is_log else "linear")
    if is_log:
        ax.xaxis.set_minor_formatter(NullFormatter())
    return ax


def _bins(name: str) -> tuple[npt.NDArray[np.float64], bool]:
    """Return the borders of the bars for a constant, and whether they are even on a logarithmic axis."""
    one = all_constants()[name]
    if name in WHOLE:
        step = max(1, round((one.high - one.low + 1) / BARS))
        return np.arange(one.low, one.high + step + 1, step) - 0.5, False
    if _is_log(name):
        return np.geomspace(one.low, one.high, BARS + 1), True
    return np.linspace(one.low, one.high, BARS + 1), False


def _is_log(name: str) -> bool:
    """Return whether the prior of a constant is even on a logarithmic axis."""
    return name in SHAPES and SHAPES[name][0].startswith("log-")


def draw_trade(table: pd.DataFrame, ax: Axes, *, x: str, y: str) -> Axes:
    """Draw the sets of a posterior in the plane of two constants; the area of a point is its weight.

    Parameters
    ----------
    table : DataFrame
        As `posterior.posterior_table` returns it.
    ax : Axes
    x, y : str
        Names of the constants.

    Returns
    -------
    Axes
    """
    area = 20 * table["weight"] / table["weight"].mean()
    ax.scatter(table[x], table[y], s=area, color="#0072B2", alpha=0.6, linewidth=0)
    chosen = table[table["is_medoid"] == 1]
    ax.plot(chosen[x], chosen[y], linestyle="none", marker="D", color="black", markerfacecolor="none", label="medoid")
    scales = {name: "log" if _is_log(name) else "linear" for name in (x, y)}
    ax.set(xlabel=x, ylabel=y, xscale=scales[x], yscale=scales[y])
    for axis in (ax.xaxis, ax.yaxis):
        if axis.get_scale() == "log":
            axis.set_minor_formatter(NullFormatter())
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
