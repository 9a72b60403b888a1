"""How few events are enough: measured shares with intervals, theory as lines; draws tables of `evaluation`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

STYLES = (("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#CC79A7", "D", ":"))
Values = npt.NDArray[np.float64]


def draw_error_rates(
    events_per_edge: npt.ArrayLike,
    measured: Mapping[str, pd.DataFrame],
    foretold: Mapping[str, npt.ArrayLike],
    ax: Axes,
    *,
    of: str,
) -> Axes:
    """Error rates over events an edge in; marks with 95 % bars for what was measured, lines for what theory says, out.

    Parameters
    ----------
    events_per_edge : array_like, shape (n,)
    measured : mapping of name to DataFrame
        Columns ``rate``, ``low``, ``high`` (0 .. 1), n rows each; a rate of 0 is drawn at its interval's end.
    foretold : mapping of name to array_like, shape (n,)
        Rates by theory, 0 .. 1, by the same names.
    ax : Axes
    of : str
        What the rate is of, for the axis.
    """
    x = np.asarray(events_per_edge, float)
    for (name, table), (color, mark, line) in zip(measured.items(), STYLES, strict=False):
        rate, low, high = (table[column].to_numpy(float) for column in ("rate", "low", "high"))
        seen = rate > 0
        bars = np.maximum([rate - low, high - rate], 0.0)[:, seen]
        ax.errorbar(
            x[seen], rate[seen], yerr=bars, color=color, marker=mark, linestyle="none", label=f"{name}, measured"
        )
        ax.plot(x[~seen], high[~seen], linestyle="none", marker="v", color=color, markerfacecolor="none")
        ax.plot(x, np.asarray(foretold[name], float), color=color, linestyle=line, label=f"{name}, theory")
    ax.set(xscale="log", yscale="log", ylim=(3e-4, 1.3), xlabel="mean events an edge", ylabel=f"{of} (share)")
    _name_ticks(ax, x)
    return ax


def draw_shares(table: pd.DataFrame, ax: Axes, *, over: str, xlabel: str, ylabel: str) -> Axes:
    """Shares of several groups over a length in, a curve with 95 % bars for each out.

    Parameters
    ----------
    table : DataFrame
        ``name`` (of the group), the column `over`, ``share``, ``low``, ``high``.
    ax : Axes
    over, xlabel, ylabel : str
        Column of the horizontal axis; quantities (units).
    """
    for (name, rows), (color, mark, line) in zip(table.groupby("name", sort=False), STYLES, strict=False):
        share, low, high = (rows[column].to_numpy(float) for column in ("share", "low", "high"))
        bars = np.maximum([share - low, high - share], 0.0)
        ax.errorbar(
            rows[over].to_numpy(float), share, yerr=bars, color=color, marker=mark, linestyle=line, label=str(name)
        )
    ax.set(xscale="log", ylim=(0, 1.04), xlabel=xlabel, ylabel=ylabel)
    _name_ticks(ax, np.unique(table[over].to_numpy(float)))
    return ax


def draw_undetected(shares: Mapping[str, Sequence[float]], names: Sequence[str], ax: Axes) -> Axes:
    """Shares of errors that pass, for each checksum, in; bars for each kind of error, with their percent, out.

    Parameters
    ----------
    shares : mapping of name to sequence of float
        A share, 0 .. 1, for each kind of error.
    names : sequence of str
        The kinds of error.
    ax : Axes
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
    """Expected and recorded accuracy over distance in; a line and marks with 95 % bars out.

    Parameters
    ----------
    table : DataFrame
        ``distance_m``, ``budget``, ``recorded``, ``low``, ``high``.
    ax : Axes
    """
    x, recorded, low, high = (table[name].to_numpy(float) for name in ("distance_m", "recorded", "low", "high"))
    ax.plot(x, table["budget"].to_numpy(float), color=STYLES[0][0], label="link budget")
    bars = np.maximum([recorded - low, high - recorded], 0.0)
    ax.errorbar(x, recorded, yerr=bars, color=STYLES[1][0], marker="s", linestyle="none", label="recordings")
    ax.set(ylim=(0, 1.04), xlabel="distance (m)", ylabel="accuracy (share of periods)")
    ax.legend()
    return ax


def _name_ticks(ax: Axes, ticks: Values) -> None:
    """Write the given values at a logarithmic axis."""
    ax.xaxis.set_major_locator(FixedLocator(ticks.tolist()))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
