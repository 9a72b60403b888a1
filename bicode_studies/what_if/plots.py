"""Figures of notebook 15: maps over bit rate and delta_t_ID, and shares of periods over one setting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

from bicode_studies.plots.accuracy import DOT, LINE, Kind

IMPOSSIBLE = "#D9D9D9"
RATE_TICKS_HZ = (250, 500, 1000, 2000, 4000, 10_000)
TIME_TICKS_US = (50, 100, 250, 500, 1000, 2000)


def draw_rate_map(
    table: pd.DataFrame, ax: Axes, *, value: str, label: str, largest: float | None = None,
    bounds_hz: Sequence[float] = (),
) -> Axes:  # fmt: skip
    """Draw a map of a value over bit rate and delta_t_ID, with the sampling limit; impossible places are grey.

    The legend is left to the figure, because maps stand side by side.

    Parameters
    ----------
    table : DataFrame
        ``f_id_hz``, ``delta_t_id_us`` and the column `value`, one row for each place of a grid; nan where it is
        impossible.
    ax : Axes
    value : str
        Column to draw.
    label : str
        Quantity (unit) of the value.
    largest : float, optional
        Value of the brightest colour; None takes the largest in the table.
    bounds_hz : (float, float), optional
        Bit rates from which some periods, and all periods, hold a whole packet; drawn as lines.

    Returns
    -------
    Axes
    """
    grid = table.pivot(index="delta_t_id_us", columns="f_id_hz", values=value)
    x, y = _edges(grid.columns.to_numpy(float)), _edges(grid.index.to_numpy(float))
    top = float(np.nanmax(grid.to_numpy(), initial=1e-9)) if largest is None else largest
    image = ax.pcolormesh(x, y, np.ma.masked_invalid(grid.to_numpy(float)), cmap="cividis", vmin=0, vmax=top)
    figure = ax.get_figure()
    assert figure is not None
    figure.colorbar(image, ax=ax, label=label)
    rates = np.geomspace(x[0], x[-1], 50)
    ax.plot(rates, 5e5 / rates, color="#D55E00", linewidth=2.2, label="delta_t_ID = 1 / (2 f_ID)")
    words = ("some periods hold a packet", "every period holds one")
    for bound_hz, style, text in zip(bounds_hz, (":", "--"), words, strict=False):
        if x[0] < bound_hz < x[-1]:
            ax.axvline(
                bound_hz, color="#56B4E9", linestyle=style, linewidth=2.2, label=f"from {bound_hz:.0f} Hz: {text}"
            )
    ax.set(xscale="log", yscale="log", xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    ax.set(xlabel="bit rate f_ID (Hz)", ylabel="delta_t_ID (us)", facecolor=IMPOSSIBLE)
    _set_ticks(ax.xaxis, RATE_TICKS_HZ)
    _set_ticks(ax.yaxis, TIME_TICKS_US)
    ax.grid(visible=False)
    ax.plot([], [], "s", color=IMPOSSIBLE, markersize=9, label="impossible: longer than a chip")
    return ax


def mark_choice(f_id_hz: float, delta_t_id_us: float, ax: Axes, *, name: str, paper: bool = False) -> Axes:
    """Mark and label one place of a map: hollow for the paper's choice, filled for another.

    Parameters
    ----------
    f_id_hz : float
        Bit rate [Hz].
    delta_t_id_us : float
        Length of a bin [us].
    ax : Axes
    name : str
        Label.
    paper : bool
        Whether it is the paper's choice.

    Returns
    -------
    Axes
    """
    ax.plot(f_id_hz, delta_t_id_us, "o" if paper else "*", color="white" if paper else "#D55E00",
            markerfacecolor="none" if paper else "#D55E00", markersize=11 if paper else 15, markeredgewidth=2,
            markeredgecolor="white", zorder=6)  # fmt: skip
    ax.annotate(
        name, (f_id_hz, delta_t_id_us), xytext=(9, -12 if paper else 7), textcoords="offset points", color="white",
        fontweight="bold", bbox={"facecolor": "black", "alpha": 0.55, "edgecolor": "none", "pad": 1.5}, zorder=7,
    )  # fmt: skip
    return ax


def draw_share(
    x: npt.ArrayLike, share: npt.ArrayLike, ax: Axes, *, label: str, xlabel: str, low: npt.ArrayLike | None = None,
    high: npt.ArrayLike | None = None, kind: Kind = "blinker", color: str | None = None, ticks: Sequence[float] = (),
) -> Axes:  # fmt: skip
    """Draw a curve of shares over one setting, with bars for their intervals where these are given.

    Parameters
    ----------
    x : array_like, shape (n,)
        Values of the setting.
    share : array_like, shape (n,)
        0 .. 1.
    ax : Axes
    label : str
        Label in the legend.
    xlabel : str
        Quantity (unit) of the setting.
    low, high : array_like, shape (n,), optional
        Ends of the intervals, 0 .. 1.
    kind : {"blinker", "2d"}
        A solid line with circles, or a dashed line with squares.
    color : str, optional
        None takes the next colour of the cycle.
    ticks : sequence of float
        Ticks of a logarithmic axis; without them the axis is linear.

    Returns
    -------
    Axes
    """
    value = np.asarray(share, float)
    bars = None
    if low is not None and high is not None:
        bars = np.maximum([value - np.asarray(low, float), np.asarray(high, float) - value], 0.0)
    ax.errorbar(np.asarray(x, float), value, yerr=bars, label=label, color=color, linestyle=LINE[kind],
                marker=DOT[kind], elinewidth=1.2, clip_on=False)  # fmt: skip
    ax.set(xlabel=xlabel, ylabel="share of periods", ylim=(0, 1.04))
    if ticks:
        ax.set_xscale("log")
        _set_ticks(ax.xaxis, ticks)
    return ax


def _set_ticks(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis at the given values."""
    axis.set_major_locator(FixedLocator(list(ticks)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FormatStrFormatter("%g"))


def _edges(middles: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the n + 1 edges of n cells on a logarithmic axis, from their rising centres."""
    log = np.log(middles)
    between = (log[1:] + log[:-1]) / 2
    first, last = 2 * log[0] - between[0], 2 * log[-1] - between[-1]
    return np.asarray(np.exp(np.concatenate([[first], between, [last]])))
