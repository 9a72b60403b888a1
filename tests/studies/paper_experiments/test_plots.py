"""Figs 12 to 14 beyond their curves: what is drawn is what was given."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bicode_studies.paper_experiments.plots_fig_13 import draw_panels
from bicode_studies.paper_experiments.plots_motion import (
    WITH_LIMIT,
    draw_lag,
    draw_patterns,
    draw_rate_and_loss,
    draw_rates,
)


def test_panels_of_a_row_have_one_scale_and_their_marker_in_the_middle():
    frame = np.zeros((720, 1280), np.int8)
    axes = Figure().subplots(1, 2)
    draw_panels(
        [frame, frame], [(100, 100, 20, 20), (1270, 300, 10, 40)], ["a", "b"], axes, size_px=(90, 60), bar_px=20
    )
    for ax, (x, y) in zip(axes, [(110, 110), (1275, 320)], strict=True):
        (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
        assert (right - left, bottom - top) == (90, 60)
        assert ((left + right) / 2 + 0.5, (top + bottom) / 2 + 0.5) == (x, y)
    assert [ax.get_xlabel() for ax in axes] == ["a", "b"]
    (bar,) = axes[0].lines
    assert np.ptp(bar.get_xdata()) == 20


def test_rates_and_losses_are_those_of_the_fastest_and_in_the_last_picture_of_all():
    rows = [
        (how, level, receiver, distance_m, rate, 0.1, 0.05, 0.2)
        for how, level in (("still", 0.0), ("spin", 16.0), ("spin", 64.0))
        for receiver in ("ours", "authors")
        for distance_m, rate in ((0.5, 30.0 + level), (2.5, 1.0 + level))
    ]
    columns = ["how", "level", "receiver", "distance_m", "mev_per_s", "lost", "low", "high"]
    axes = Figure().subplots(1, 3)
    draw_rate_and_loss(pd.DataFrame(rows, columns=columns), axes)
    drawn = {line.get_label(): line.get_ydata().tolist() for line in axes[0].lines}
    assert drawn == {"still": [30.0, 1.0], "spin 64": [94.0, 65.0]}
    assert [bars.get_label() for bars in axes[1].containers] == [
        f"{name}{limit}" for name in ("still", "spin 64") for limit in ("", f", {WITH_LIMIT}")
    ]
    assert sum(line.get_xdata().size for line in axes[2].lines) == len(rows)
    assert axes[0].get_ylim()[0] > 0


def test_late_boxes_have_a_curve_a_level_and_the_overlap_beside_it():
    table = pd.DataFrame({"rpm": [16, 16, 64, 64], "lag": [0, 4, 0, 4], "accuracy": [1, 1, 1, 0.5]})
    table = table.assign(low=table["accuracy"], high=table["accuracy"])
    ax = draw_lag(table, table.assign(overlap=0.5), Figure().add_subplot(), by="rpm", label="{:g} rpm")
    assert [bars.get_label() for bars in ax.containers] == ["16 rpm", "64 rpm"]
    assert ax.containers[1].lines[0].get_ydata().tolist() == [1, 0.5]


def test_rates_are_shares_of_periods_with_their_means():
    ax = draw_rates({"wall": np.array([0.1, 0.1, 0.4]), "real": np.full(5, 0.2)}, Figure().add_subplot())
    np.testing.assert_allclose([line.get_xdata()[0] for line in ax.lines], [0.2, 0.2])
    assert {patch.get_label() for patch in ax.patches} >= {"wall", "real"}


def test_each_pattern_has_a_square_at_each_condition():
    told = pd.DataFrame(
        {
            "condition": ["a", "b", "a", "b"], "aruco_id": [17, 17, 34, 34],
            "accuracy": [1.0, 0.2, 0.9, 0.0], "low": [0.9, 0.1, 0.8, 0.0], "high": [1.0, 0.3, 1.0, 0.1],
        }
    )  # fmt: skip
    ax = draw_patterns(told, Figure().subplots())
    assert [label.get_text() for label in ax.get_xticklabels()] == ["a", "b"]
    drawn = [container.lines[0].get_ydata().tolist() for container in ax.containers]
    assert drawn == [[1.0, 0.2], [0.9, 0.0]]
    assert [container.get_label() for container in ax.containers] == ["pattern 17", "pattern 34"]
