"""Draw accuracy over distance, as in Fig. 8 to 12 and 14.

The blinker is a solid line with circles, the 2D marker a dashed line with squares, and the values of the paper are
hollow black marks. Line style and mark tell them apart in grey print, too.
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
LEVEL_COLORS = ("#E69F00", "#009E73", "#0072B2", "#CC79A7")  # Okabe-Ito colours; the first three go from light to dark
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
    """Draw accuracies and their 95 % intervals as one curve over distance.

    Parameters
    ----------
    distance_m : array_like, shape (n,)
        Camera to marker [m].
    accuracy : array_like, shape (n,)
        Share of periods that were read right, 0 .. 1.
    ax : Axes
        Where to draw.
    low, high : array_like, shape (n,), optional
        Ends of the intervals, drawn as bars.
    kind : {"blinker", "2d"}
        Solid with circles, or dashed with squares.
    label : str
        Name for the legend.
    color : str, optional
        Colour of the curve; None takes the next one of the cycle.
    width : float, optional
        Width of the line [points]; None takes that of the style.

    Returns
    -------
    Axes
        The axes, with a logarithmic distance axis.

    Raises
    ------
    ValueError
        If `kind` is neither of the two.
    """
    _check_kind(kind)
    distance, value = np.asarray(distance_m, float), np.asarray(accuracy, float)
    order = np.argsort(distance)
    bars = None
    if low is not None and high is not None:
        bars = np.stack([value - np.asarray(low, float), np.asarray(high, float) - value])[:, order]
        bars = np.maximum(bars, 0.0)  # rounding may put the end of an interval past its value
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
) -> Axes:
    """Draw the values of the paper as hollow black marks; a triangle stands for "more than" or "less than".

    Parameters
    ----------
    distance_m, accuracy : array_like, shape (n,)
        Distance [m] and accuracy, 0 .. 1.
    ax : Axes
        Where to draw.
    op : sequence of str, optional
        For each value "==", "~=", ">", ">=", "<" or "<="; None means "==" for all.
    kind : {"blinker", "2d"}
        Circles, or squares.

    Returns
    -------
    Axes
        The axes.

    Raises
    ------
    ValueError
        If `kind` is neither of the two.
    """
    _check_kind(kind)
    distance, value = np.atleast_1d(np.asarray(distance_m, float)), np.atleast_1d(np.asarray(accuracy, float))
    label: str | None = "paper"
    marks = [ARROW.get(o, DOT[kind]) for o in (op if op is not None else ["=="] * distance.size)]
    for mark in dict.fromkeys(marks):
        chosen = np.array([m == mark for m in marks])
        ax.plot(
            distance[chosen], value[chosen], mark, color="black", markerfacecolor="none", markersize=10,
            markeredgewidth=1.4, label=label, clip_on=False, zorder=5,
        )  # fmt: skip
        label = None
    return set_distance_axis(ax)


def draw_levels(
    curves: pd.DataFrame, ax: Axes, *, by: str, label: str = "{:g}", scale: float = 1.0, kind: Kind = "blinker"
) -> Axes:
    """Draw one curve for each level of a quantity; the higher the level, the thicker the line.

    Parameters
    ----------
    curves : DataFrame
        Rows of `bicode_studies.statistics.accuracy_curves`: `by`, ``distance_m``, ``accuracy``, ``low``, ``high``.
    ax : Axes
        Where to draw.
    by : str
        The column of the levels.
    label : str
        Format of a level times `scale` for the legend, such as "{:g} mA".
    scale : float
        Factor from the column's unit to the label's.
    kind : {"blinker", "2d"}
        Solid with circles, or dashed with squares.

    Returns
    -------
    Axes
        The axes.
    """
    for number, level in enumerate(sorted(curves[by].unique())):
        mine = curves[curves[by] == level]
        nudge = 1.02 ** (number - 1)  # so that the intervals at one distance lie side by side
        draw_accuracy(
            mine["distance_m"] * nudge, mine["accuracy"], ax, low=mine["low"], high=mine["high"], kind=kind,
            label=label.format(level * scale), color=LEVEL_COLORS[number], width=1.2 + 0.7 * number,
        )  # fmt: skip
    return ax


def draw_stated(
    points: pd.DataFrame, ax: Axes, *, kind: Kind = "blinker", by: str = "", label: str = "", scale: float = 1.0
) -> Axes:
    """Draw the points of one kind that the paper states, with the names of their claims.

    A dotted bar spans the distances for which the paper states a value.

    Parameters
    ----------
    points : DataFrame
        Rows of `bicode_studies.claims.in_notebooks.stated_points`.
    ax : Axes
        Where to draw.
    kind : {"blinker", "2d"}
        Which points to draw.
    by, label, scale
        As in `draw_levels`. If `label` is given, each point is named with its level, too.

    Returns
    -------
    Axes
        The axes.
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
        is_above = value < 0.2 or (value < 0.9 and number % 2 == 1)  # so that neighbours do not cover each other
        is_far = at_m > 12  # so that names stay within the axes
        ax.annotate(
            f"{name}{': ' if levels else ''}{levels}", (at_m, value), textcoords="offset points", fontsize=9,
            xytext=(-6 if is_far else 6, 9 if is_above else -17), ha="right" if is_far else "left", zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.75},
        )  # fmt: skip
    return ax


def set_distance_axis(ax: Axes) -> Axes:
    """Give axes a logarithmic distance from 0.4 to 60 m and an accuracy from 0 to 1, both with their labels.

    Parameters
    ----------
    ax : Axes
        The axes to change.

    Returns
    -------
    Axes
        The same axes.
    """
    ax.set_xscale("log")
    ax.set(xlim=(0.4, 60), ylim=(0, 1.04), xlabel="distance (m)", ylabel="accuracy (share of periods)")
    ax.xaxis.set_major_locator(FixedLocator(list(TICKS_M)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    return ax


def set_width_axis(ax: Axes) -> Axes:
    """Replace the distance by the width of the plate's image, logarithmic from 0.7 to 400 px, with its label.

    Parameters
    ----------
    ax : Axes
        The axes to change.

    Returns
    -------
    Axes
        The same axes.
    """
    ax.set(xlim=(0.7, 400), xlabel="width of the plate (px)")
    ax.xaxis.set_major_locator(FixedLocator(list(TICKS_PX)))
    return ax


def _check_kind(kind: str) -> None:
    """Raise ValueError unless the kind has a line style."""
    if kind not in LINE:
        raise ValueError(f"kind={kind!r} is not known; choose 'blinker' or '2d'")
