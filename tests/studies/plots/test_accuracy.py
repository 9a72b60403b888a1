"""Curves over distance hold the data they are given and can be told apart in grey print."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from bicode_studies.plots import draw_accuracy, draw_levels, draw_paper_accuracy, draw_stated, set_width_axis


@pytest.fixture
def ax():
    return Figure().add_subplot()


@pytest.mark.parametrize(("kind", "line", "dot"), [("blinker", "-", "o"), ("2d", "--", "s")])
def test_a_curve_holds_its_data_by_distance(ax, kind, line, dot):
    draw_accuracy([5, 1], [0.4, 1.0], ax, low=[0.2, 0.9], high=[0.6, 1.0], kind=kind, label="10.7 mA")
    (curve,) = ax.containers
    points, _, (bars,) = curve.lines
    np.testing.assert_array_equal(points.get_xydata(), [[1, 1], [5, 0.4]])
    assert (points.get_linestyle(), points.get_marker()) == (line, dot)
    np.testing.assert_allclose([s[:, 1] for s in bars.get_segments()], [[0.9, 1.0], [0.2, 0.6]])
    assert (ax.get_xlabel(), ax.get_xscale()) == ("distance (m)", "log")


def test_without_an_interval_there_are_no_bars(ax):
    draw_accuracy([1], [1], ax)
    assert ax.containers[0].lines[2] == ()


def test_the_papers_values_are_hollow_and_black_and_bounds_point_their_way(ax):
    draw_paper_accuracy([2.5, 20, 40], [1, 0.5, 0.8], ax, op=["==", "~=", ">"])
    assert {line.get_marker(): line.get_xydata().tolist() for line in ax.lines} == {
        "o": [[2.5, 1], [20, 0.5]],
        "^": [[40, 0.8]],
    }
    assert {line.get_markerfacecolor() for line in ax.lines} == {"none"}
    assert {line.get_color() for line in ax.lines} == {"black"}
    assert len(ax.get_legend_handles_labels()[1]) == 1


@pytest.mark.parametrize("draw", [draw_accuracy, draw_paper_accuracy])
def test_an_unknown_kind_is_refused(draw, ax):
    with pytest.raises(ValueError, match="choose 'blinker' or '2d'"):
        draw([1], [1], ax, kind="aruco")


def test_levels_are_told_apart_by_colour_and_by_width(ax):
    curves = pd.DataFrame(
        {"current_ma": [5.5, 5.5, 21.3], "distance_m": [1, 5, 1], "accuracy": [1, 0.5, 0.8],
         "low": [0.9, 0.4, 0.7], "high": [1, 0.6, 0.9]}
    )  # fmt: skip
    draw_levels(curves, ax, by="current_ma", label="{:g} mA", kind="2d")
    drawn = [curve.lines[0] for curve in ax.containers]
    assert [line.get_ydata().tolist() for line in drawn] == [[1, 0.5], [0.8]]
    np.testing.assert_allclose(drawn[0].get_xdata(), [1, 5], rtol=0.03)
    assert drawn[0].get_linewidth() < drawn[1].get_linewidth()
    assert drawn[0].get_color() != drawn[1].get_color()
    assert ax.get_legend_handles_labels()[1] == ["5.5 mA", "21.3 mA"]


def test_stated_points_carry_their_claims_names_and_spans(ax):
    points = pd.DataFrame(
        [("F9.1", "2d", 0.0, 2.5, 0.5, 2.5, ">", 0.9), ("F9.1", "2d", 40.0, 2.5, 0.5, 2.5, ">", 0.9),
         ("F9.3", "blinker", 80.0, 10.0, 10.0, 10.0, ">=", 0.5)],
        columns=["id", "kind", "yaw_deg", "at_m", "from_m", "to_m", "op", "accuracy"],
    )  # fmt: skip
    draw_stated(points, ax, kind="2d", by="yaw_deg", label="{:g}°")
    assert [text.get_text() for text in ax.texts] == ["F9.1: 0°, 40°"]
    spans = [line.get_xydata().tolist() for line in ax.lines if line.get_linestyle() == ":"]
    assert spans == [[[0.5, 0.9], [2.5, 0.9]]] * 2
    draw_stated(points, ax, kind="blinker")
    assert [text.get_text() for text in ax.texts] == ["F9.1: 0°, 40°", "F9.3"]
    assert "^" in {line.get_marker() for line in ax.lines}


def test_width_takes_the_place_of_distance(ax):
    draw_accuracy([4, 32], [0.5, 1], ax)
    set_width_axis(ax)
    assert ax.get_xlabel() == "width of the plate (px)"
    assert ax.get_xlim() == (0.7, 400)
