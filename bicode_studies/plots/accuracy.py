"""Fig. 8 to 12 and 14: accuracy over distance.

The blinker is a solid line with circles, the 2D marker a dashed one with squares, what the
paper states is black and hollow: shape and stroke tell them apart in grey print, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

Kind = Literal["blinker", "2d"]
LINE = {"blinker": "-", "2d": "--"}
DOT = {"blinker": "o", "2d": "s"}
ARROW = {">": "^", ">=": "^", "<": "v", "<=": "v"}
LEVEL_COLORS = ("#E69F00", "#009E73", "#0072B2", "#CC79A7")  # of Okabe and Ito, the first three from light to dark
TICKS_M = (0.5, 1.0, 2.5, 5.0, 10.0, 20.0, 50.0)
TICKS_PX = (1, 2, 4, 8, 16, 32, 64, 128, 256)


def draw_accuracy(
    distance_m: npt.ArrayLike,
    accuracy: npt.ArrayLike,
    ax: Axes,
    *,
    low: npt.ArrayLike | None = None,
    high: npt.ArrayLike | None = None,
    kind: Kind = "blinker",
    label: str = "",
    color: str | None = None,
    width: float | None = None,
) -> Axes:
    """Accuracies and their 95 % intervals in, one curve over distance out.

    Parameters
    ----------
    distance_m : array_like, shape (n,)
        Camera to marker [m].
    accuracy : array_like, shape (n,)
        Right periods over all periods, 0 .. 1.
    ax : Axes
    low, high : array_like, shape (n,), optional
        Ends of the interval, drawn as bars.
    kind : {"blinker", "2d"}
        Solid with circles, or dashed with squares.
    label : str
        For the legend.
    color : str, optional
        None takes the next of the cycle.
    width : float, optional
        Of the line [points]; None takes that of the style.
    """
    _check_kind(kind)
    distance, value = np.asarray(distance_m, float), np.asarray(accuracy, float)
    order = np.argsort(distance)
    bars = None
    if low is not None and high is not None:
        bars = np.stack([value - np.asarray(low, float), np.asarray(high, float) - value])[:, order]
        bars = np.maximum(bars, 0.0)  # an interval that ends at its value may miss it by a rounding
    ax.errorbar(
        distance[order], value[order], yerr=bars, color=color, label=label or None,
        linestyle=LINE[kind], linewidth=width, marker=DOT[kind], markersize=6, elinewidth=1.2, clip_on=False,
    )  # fmt: skip
    return set_distance_axis(ax)


def draw_paper_accuracy(
    distance_m: npt.ArrayLike,
    accuracy: npt.ArrayLike,
    ax: Axes,
    *,
    op: Sequence[str] | None = None,
    kind: Kind = "blinker",
    label: str = "paper",
) -> Axes:
    """What the paper states in, hollow black marks out: a value, or a triangle where it only says more or less than.

    Parameters
    ----------
    distance_m, accuracy : array_like, shape (n,)
        Distance [m] and accuracy, 0 .. 1.
    ax : Axes
    op : sequence of str, optional
        For each value "==", "~=", ">", ">=", "<" or "<="; None takes all as "==".
    kind : {"blinker", "2d"}
        Circles, or squares.
    label : str
        For the legend.
    """
    _check_kind(kind)
    distance, value = np.atleast_1d(np.asarray(distance_m, float)), np.atleast_1d(np.asarray(accuracy, float))
    marks = [ARROW.get(o, DOT[kind]) for o in (op if op is not None else ["=="] * distance.size)]
    for mark in dict.fromkeys(marks):
        chosen = np.array([m == mark for m in marks])
        ax.plot(
            distance[chosen], value[chosen], mark, color="black", markerfacecolor="none", markersize=10,
            markeredgewidth=1.4, label=label or None, clip_on=False, zorder=5,
        )  # fmt: skip
        label = ""
    return set_distance_axis(ax)


def draw_levels(
    curves: pd.DataFrame, ax: Axes, *, by: str, label: str = "{:g}", scale: float = 1.0, kind: Kind = "blinker"
) -> Axes:
    """Curves of one kind in, one drawn for each level, the higher the thicker.

    Parameters
    ----------
    curves : DataFrame
        Rows of `evaluation.accuracy.accuracy_curves`: `by`, ``distance_m``, ``accuracy``, ``low``, ``high``.
    ax : Axes
    by : str
        The column of the levels.
    label : str
        Name of a level, times `scale`, for the legend: "{:g} mA".
    scale : float
    kind : {"blinker", "2d"}
    """
    for number, level in enumerate(sorted(curves[by].unique())):
        mine = curves[curves[by] == level]
        nudge = 1.02 ** (number - 1)  # so that intervals at one distance stand side by side
        draw_accuracy(
            mine["distance_m"] * nudge, mine["accuracy"], ax, low=mine["low"], high=mine["high"], kind=kind,
            label=label.format(level * scale), color=LEVEL_COLORS[number], width=1.2 + 0.7 * number,
        )  # fmt: skip
    return ax


def draw_stated(
    points: pd.DataFrame, ax: Axes, *, kind: Kind = "blinker", by: str = "", label: str = "", scale: float = 1.0
) -> Axes:
    """Points that the paper states in, those of one kind drawn with their claims' names; a bar is over what it is said.

    Parameters
    ----------
    points : DataFrame
        Rows of `evaluation.stated.stated_points`.
    ax : Axes
    kind : {"blinker", "2d"}
    by, label, scale
        As in `draw_levels`; where `label` is given, each point is named with its level, too.
    """
    mine = points[points["kind"] == kind]
    if mine.empty:
        return ax
    draw_paper_accuracy(mine["at_m"], mine["accuracy"], ax, op=list(mine["op"]), kind=kind)
    for row in mine[mine["from_m"] < mine["to_m"]].to_dict("records"):
        ax.plot([row["from_m"], row["to_m"]], [row["accuracy"]] * 2, ":|", color="black", linewidth=1, zorder=4)
    for number, (name, same) in enumerate(mine.groupby("id", sort=False)):
        levels = ", ".join(label.format(level * scale) for level in same[by]) if label else ""
        at_m, value = (float(same[column].iloc[0]) for column in ("at_m", "accuracy"))
        is_above = value < 0.2 or (value < 0.9 and number % 2 == 1)  # neighbours do not cover each other
        is_far = at_m > 12  # names stay within the axes
        ax.annotate(
            f"{name}{': ' if levels else ''}{levels}", (at_m, value), textcoords="offset points", fontsize=9,
            xytext=(-6 if is_far else 6, 9 if is_above else -17), ha="right" if is_far else "left", zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.75},
        )  # fmt: skip
    return ax


def set_distance_axis(ax: Axes) -> Axes:
    """Axes in; distance in logarithmic steps from 0.4 to 60 m, accuracy from 0 to 1, both named."""
    ax.set_xscale("log")
    ax.set(xlim=(0.4, 60), ylim=(0, 1.04), xlabel="distance (m)", ylabel="accuracy (share of periods)")
    ax.xaxis.set_major_locator(FixedLocator(list(TICKS_M)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    return ax


def set_width_axis(ax: Axes) -> Axes:
    """Axes in; the plate's width in logarithmic steps from 0.7 to 400 px in the place of distance, named."""
    ax.set(xlim=(0.7, 400), xlabel="width of the plate (px)")
    ax.xaxis.set_major_locator(FixedLocator(list(TICKS_PX)))
    return ax


def _check_kind(kind: str) -> None:
    """Refuse what has no line style."""
    if kind not in LINE:
        raise ValueError(f"kind={kind!r} is not known; choose 'blinker' or '2d'")
