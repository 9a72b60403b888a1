"""Tests of the figures of notebook 15: the drawn values are the given ones."""

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot as plt

from bicode_studies.what_if.plots import draw_rate_map, draw_share, mark_choice


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


@pytest.fixture
def table():
    grid = [(f, t) for f in (500.0, 1000.0, 2000.0) for t in (100, 250, 400)]
    rows = [{"f_id_hz": f, "delta_t_id_us": t, "accuracy": f / 4000 if t <= 5e5 / f else np.nan} for f, t in grid]
    return pd.DataFrame(rows)


def test_a_map_draws_every_place_and_leaves_the_impossible_open(ax, table):
    draw_rate_map(table, ax, value="accuracy", label="accuracy", largest=1.0)
    drawn = ax.collections[0].get_array()
    expected = table.pivot(index="delta_t_id_us", columns="f_id_hz", values="accuracy").to_numpy()
    assert np.array_equal(drawn.mask, np.isnan(expected))
    assert np.array_equal(drawn[~drawn.mask], expected[~np.isnan(expected)])


def test_a_map_draws_the_bounds(ax, table):
    draw_rate_map(table, ax, value="accuracy", label="accuracy", bounds_hz=(600.0, 1200.0))
    rates, times = ax.lines[0].get_data()
    assert np.allclose(rates * times, 5e5)
    assert [line.get_xdata()[0] for line in ax.lines[1:3]] == [600.0, 1200.0]
    mark_choice(1000, 250, ax, name="paper", paper=True)
    assert ax.lines[-1].get_xydata().tolist() == [[1000, 250]]


def test_a_share_is_drawn_with_its_interval(ax):
    draw_share([1, 2], [0.5, 1.0], ax, label="a", xlabel="x (us)", low=[0.4, 0.8], high=[0.7, 1.0], ticks=(1, 2))
    assert ax.lines[0].get_ydata().tolist() == [0.5, 1.0]
    ends = ax.collections[0].get_segments()
    assert np.allclose([segment[:, 1] for segment in ends], [[0.4, 0.7], [0.8, 1.0]])
    assert ax.get_xscale() == "log"
