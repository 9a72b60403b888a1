"""Posteriors, readings and blinks: what is drawn is what was given."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bicode_studies.calibration.plots import draw_blinks, draw_marginal, draw_readings, draw_trade


def lines_of(ax: Axes) -> dict[str, list[tuple[float, float]]]:
    """What is drawn, by its label."""
    return {
        str(line.get_label()): [(float(x), float(y)) for x, y in np.asarray(line.get_xydata(), float)]
        for line in ax.get_lines()
    }


SETS = pd.DataFrame({
    "weight": [0.5, 0.3, 0.2], "is_medoid": [0, 1, 0], "blur_px": [0.31, 1.0, 1.01], "halo_fraction": [0.0, 0.05, 0.1],
    "aruco_id": [0, 17, 49], "min_region_pixels": [1, 15, 40], "opening_px": [0, 3, 5],
})  # fmt: skip


@pytest.mark.parametrize("name", ["blur_px", "halo_fraction", "aruco_id", "min_region_pixels", "opening_px"])
def test_bars_hold_all_of_the_posterior_and_of_the_prior(name: str) -> None:
    ax = draw_marginal(SETS, SETS.iloc[[0, 1, 1, 2]], SETS[name][1], Figure().subplots(), by=name)
    posterior, prior = (patch.get_data() for patch in ax.patches)
    assert posterior.values.sum() == pytest.approx(1)
    assert prior.values.sum() == pytest.approx(1)
    assert prior.values.max() >= 0.5
    assert posterior.values[np.searchsorted(posterior.edges, SETS[name][0], side="right") - 1] == pytest.approx(0.5)
    assert [x for x, _ in lines_of(ax)["in use"]] == [SETS[name][1]] * 2
    assert ax.get_xscale() == ("log" if name == "blur_px" else "linear")


def test_the_area_of_a_point_is_its_weight() -> None:
    ax = draw_trade(SETS, Figure().subplots(), x="blur_px", y="halo_fraction")
    (points,) = ax.collections
    areas = points.get_sizes()
    assert list(areas / areas.sum()) == pytest.approx([0.5, 0.3, 0.2])
    assert lines_of(ax)["medoid"] == [(1.0, 0.05)]
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "linear")


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
