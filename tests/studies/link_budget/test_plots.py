"""Tests of the figures of the link budget: the drawn values are the given ones."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bicode_studies.link_budget.plots import draw_budget, draw_error_rates, draw_ranges, draw_shares, draw_undetected


def test_rates_are_marks_theory_is_a_line_and_none_seen_is_a_triangle_at_the_upper_end() -> None:
    measured = {"rule": pd.DataFrame({"rate": [0.5, 0.1, 0.0], "low": [0.4, 0.05, 0.0], "high": [0.6, 0.2, 0.01]})}
    ax = draw_error_rates(
        [1, 3, 9], measured, {"rule": [0.5, 0.12, 0.001]}, Figure().subplots(), quantity="bits not read"
    )
    drawn = [np.asarray(line.get_ydata(), float).tolist() for line in ax.get_lines()]
    assert [0.5, 0.1] in drawn
    assert [0.01] in drawn
    assert [0.5, 0.12, 0.001] in drawn
    assert ax.get_yscale() == "log"
    assert ax.get_ylabel() == "bits not read (share)"


def test_each_group_has_its_curve() -> None:
    rows = [(name, d, 0.5, 0.4, 0.6) for name in ("a", "b") for d in (100, 200)]
    table = pd.DataFrame(rows, columns=["name", "d_us", "share", "low", "high"])
    ax = draw_shares(table, Figure().subplots(), over="d_us", xlabel="d (us)", ylabel="share")
    assert ax.get_legend_handles_labels()[1] == ["a", "b"]


def test_bars_have_their_heights_and_say_them() -> None:
    ax = draw_undetected({"sum": [0.33, 0.05], "CRC": [0.07, 0.16]}, ["2 bits", "3 bits"], Figure().subplots())
    assert sorted(bar.get_height() for bar in ax.patches) == [0.05, 0.07, 0.16, 0.33]
    assert {text.get_text() for text in ax.texts} == {"33", "5", "7", "16"}


def test_a_budget_is_a_line_and_recordings_are_marks() -> None:
    table = pd.DataFrame(
        {
            "distance_m": [10.0, 20.0],
            "budget": [1.0, 0.4],
            "recorded": [0.9, 0.5],
            "low": [0.8, 0.3],
            "high": [1.0, 0.7],
        }
    )
    ax = draw_budget(table, Figure().subplots())
    assert np.array_equal(ax.get_lines()[0].get_ydata(), table["budget"])
    assert ax.get_xlabel() == "distance (m)"


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
