"""Fig. 8 and its kin: the curves hold the data given, and grey print tells them apart."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from bicode_lab.plots import draw_accuracy, draw_paper_accuracy


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
