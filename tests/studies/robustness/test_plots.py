"""The stress curves and the funnel show the given data with their labels."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from bicode_studies.robustness.plots import draw_funnel, draw_stress


@pytest.fixture
def ax():
    return Figure().add_subplot()


def test_each_receiver_has_a_curve_with_its_bars_by_level(ax):
    rows = [("paper", 0.5, 0.2, 0.1, 0.4), ("paper", 0.0, 0.9, 0.8, 1.0), ("soft", 0.0, 1.0, 0.9, 1.0)]
    table = pd.DataFrame(rows, columns=["receiver", "level", "accuracy", "low", "high"])
    draw_stress(table, ax, label="events lost (share)")
    paper, soft = ax.containers
    np.testing.assert_allclose(paper.lines[0].get_ydata(), [0.9, 0.2])
    np.testing.assert_allclose([s[:, 1] for s in paper.lines[2][0].get_segments()], [[0.8, 1.0], [0.1, 0.4]])
    np.testing.assert_allclose(soft.lines[0].get_ydata(), [1.0])
    assert [text.get_text() for text in ax.get_xticklabels()] == ["0", "0.5"]
    assert ax.get_xlabel() == "events lost (share)"
    assert paper.lines[0].get_marker() != soft.lines[0].get_marker()
    assert paper.lines[0].get_linestyle() != soft.lines[0].get_linestyle()
    assert ax.get_legend_handles_labels()[1] == ["paper", "soft"]


def test_where_less_is_worse_the_worst_stands_on_the_right(ax):
    table = pd.DataFrame({"receiver": "paper", "level": [1.0, 0.1], "accuracy": [1, 0], "low": [1, 0], "high": [1, 0]})
    draw_stress(table, ax, label="the link carries (Mev/s)", worse_is_less=True)
    assert ax.get_xlim()[0] > ax.get_xlim()[1]


def test_the_funnel_writes_every_count_also_none(ax):
    counts = pd.DataFrame({"row": ["a", "b"], "looked_at": [1000, 20], "passed": [3, 0]})
    draw_funnel(counts, ax, stages=("looked_at", "passed"), of="row")
    assert sorted(text.get_text() for text in ax.texts) == ["0", "1000", "20", "3"]
    assert [text.get_text() for text in ax.get_yticklabels()] == ["a", "b"]
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # the first row is on top
    assert ax.get_xscale() == "log"
