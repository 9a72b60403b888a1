"""The plot of differences shows every condition with its interval, the worse ones apart."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bicode_studies.robustness.compare_plots import draw_differences


def test_conditions_stand_by_their_difference_and_worse_ones_have_their_own_marks() -> None:
    rows = [(0.5, 0.3, 0.7, False), (-0.4, -0.6, -0.2, True), (0.0, -0.1, 0.1, False)]
    table = pd.DataFrame(rows, columns=["difference", "low", "high", "is_worse"])
    ax = draw_differences(table, Figure().add_subplot())
    worse, good = ax.containers
    np.testing.assert_allclose(np.transpose(worse.lines[0].get_data()), [[0, -0.4]])
    np.testing.assert_allclose(np.transpose(good.lines[0].get_data()), [[1, 0.0], [2, 0.5]])
    np.testing.assert_allclose([bar[:, 1] for bar in good.lines[2][0].get_segments()], [[-0.1, 0.1], [0.3, 0.7]])
    np.testing.assert_allclose([bar[:, 1] for bar in worse.lines[2][0].get_segments()], [[-0.6, -0.2]])
    assert worse.lines[0].get_marker() != good.lines[0].get_marker()
    assert worse.lines[0].get_color() != good.lines[0].get_color()
    assert ax.get_legend_handles_labels()[1] == ["worse (1)", "at least as good (2)"]
    assert "difference" in ax.get_ylabel()
