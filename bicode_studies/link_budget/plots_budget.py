"""How far an ID carries against the light that leaves for the camera: drawn from a table of `evaluation`."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

TICKS_M = (5, 7.5, 10, 15, 20, 30, 40, 60)
TICKS_MA = (1, 2, 5, 10, 20, 50)


def draw_ranges(table: pd.DataFrame, ax: Axes) -> Axes:
    """Ranges in, range over current times share of the face seen out, with the line of the inverse square.

    The line goes through the first row of the paper. On it current x (projected area / face area) / distance^2
    is the same everywhere.

    Parameters
    ----------
    table : DataFrame
        ``light_ma`` (current times projected over face area), ``paper_m``, ``budget_m``, and ``current_ma``,
        ``size_m``, ``yaw_deg`` for the names; see `evaluation.ranges.paper_ranges`.
    ax : Axes
    """
    first = table.iloc[0]
    ends = np.array([table["light_ma"].min() / 1.6, table["light_ma"].max() * 2])
    line = first["paper_m"] * np.sqrt(ends / first["light_ma"])
    ax.plot(ends, line, color="black", linewidth=1, linestyle=":", label="current x area / distance² as in the first")
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
    for axis, ticks in ((ax.xaxis, TICKS_MA), (ax.yaxis, TICKS_M)):
        axis.set_major_locator(FixedLocator(list(ticks)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FormatStrFormatter("%g"))
    ax.legend(loc="upper left")
    return ax
