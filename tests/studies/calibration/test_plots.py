"""Misfits, readings and blinks: what is drawn is what was given."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bicode_studies.calibration.plots import draw_blinks, draw_misfit, draw_readings


def lines_of(ax: Axes) -> dict[str, list[tuple[float, float]]]:
    """What is drawn, by its label."""
    return {
        str(line.get_label()): [(float(x), float(y)) for x, y in np.asarray(line.get_xydata(), float)]
        for line in ax.get_lines()
    }


def test_candidates_are_points_of_three_kinds_and_the_value_in_use_a_line() -> None:
    rows = [(0.8, 3, 0.9, 0.1), (0.9, 1, 0.8, 0.3), (1.0, 1, np.nan, 0.7), (1.1, 1, np.nan, 5.0)]
    table = pd.DataFrame(rows, columns=["blur_px", "blocks", "2D 10.7 mA 1 m", "sum"])
    lines = lines_of(draw_misfit(table, 0.8, Figure().subplots(), by="blur_px", most=1.0))
    assert lines["tried again"] == [(0.8, 0.1)]
    assert lines["tried once"] == [(0.9, 0.3)]
    assert lines["given up (at least)"] == [(1.0, 0.7), (1.1, 1.0)]
    assert [x for x, _ in lines["in use"]] == [0.8, 0.8]


def test_readings_have_bars_and_the_value_in_use() -> None:
    table = pd.DataFrame(
        {"value": [0.3, 2.0], "accuracy": [0.2, 0.9], "low": [0.0, 0.7], "high": [0.4, 1.0], "distance_m": [10.0, 10.0]}
    )
    ax = draw_readings(table, 2.0, Figure().subplots(), by="distance_m", xlabel="glow")
    lines = lines_of(ax)
    assert [x for x, _ in lines["in use"]] == [2.0, 2.0]
    drawn = [[(float(x), float(y)) for x, y in line.get_xydata()] for line in ax.get_lines()]
    assert [(0.3, 0.2), (2.0, 0.9)] in drawn
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["0.3", "2"]


def test_curves_are_lines_and_measured_points_are_hollow() -> None:
    curve = pd.DataFrame({"blink_hz": [5.0, 50.0, 500.0], "events": [10.0, 9.0, 0.0]})
    ax = draw_blinks({"ours": curve}, Figure().subplots(), measured={"measured": curve.head(2)})
    lines = lines_of(ax)
    assert lines["ours"] == [(5.0, 10.0), (50.0, 9.0)]
    assert lines["measured"] == [(5.0, 10.0), (50.0, 9.0)]
    (points,) = [line for line in ax.get_lines() if line.get_label() == "measured"]
    assert points.get_linestyle() == "None"
    assert points.get_markerfacecolor() == "none"
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
