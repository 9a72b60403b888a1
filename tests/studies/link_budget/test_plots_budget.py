"""Ranges over light: what is drawn is what was given, and the line is the inverse square."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bicode_studies.link_budget.plots_budget import draw_ranges


def test_marks_are_the_data_and_the_line_goes_as_the_root() -> None:
    table = pd.DataFrame(
        {
            "light_ma": [10.0, 20.0, 2.5], "paper_m": [20.0, 30.0, 10.0], "budget_m": [21.0, 29.0, 9.0],
            "current_ma": [10.0, 20.0, 9.0], "size_m": [0.05, 0.05, 0.05], "yaw_deg": [0.0, 0.0, 80.0],
        }
    )  # fmt: skip
    ax = draw_ranges(table, Figure().subplots())
    line, budget, paper = ax.get_lines()
    assert np.array_equal(budget.get_ydata(), table["budget_m"])
    assert np.array_equal(paper.get_xdata(), table["light_ma"])
    x, y = (np.asarray(values, float) for values in line.get_data())
    assert np.allclose(x / y**2, 10.0 / 20.0**2)
    assert {text.get_text() for text in ax.texts} == {"5 cm, 10 mA", "5 cm, 20 mA", "5 cm, 9 mA, 80°"}
    assert ax.get_xlabel().endswith("(mA)")
    assert ax.get_ylabel().endswith("(m)")
