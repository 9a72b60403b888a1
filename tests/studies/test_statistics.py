"""Accuracies over seeds, and their intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bicode_studies.score import accuracy
from bicode_studies.statistics import bootstrap, over_seeds


def test_the_interval_over_seeds_covers_the_mean() -> None:
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(200):
        low, high = bootstrap(rng.binomial(15, 0.6, 12) / 15, 180, rng, n=300)
        inside += low <= 0.6 <= high
    assert inside >= 174  # 95 % asked, a little less with twelve seeds; 87 % would be found so often by chance
    assert bootstrap(np.ones(10), 150, rng) == (pytest.approx(0.975, abs=1e-3), 1.0)


def test_each_condition_has_its_own_row() -> None:
    table = pd.DataFrame(
        {
            "distance_m": [1.0, 1.0, 20.0, 20.0, 20.0],
            "receiver": ["ours"] * 5,
            "periods": [100, 100, 50, 150, 0],  # of the last, the marker never came into view
            "id_right": [100, 100, 50, 0, 0],
        }
    )
    near, far = over_seeds(table, ["distance_m", "receiver"]).to_dict("records")
    assert near["accuracy"] == 1
    assert near["high"] == 1
    assert 0.97 < near["low"] < 1  # 200 of 200
    assert far["accuracy"] == 0.5  # the mean of the seeds, 1 and 0, not of their periods
    assert (far["seeds"], far["periods"], far["low"], far["high"]) == (2, 200, 0, 1)


def test_seeds_that_are_all_the_same_have_wilsons_interval() -> None:
    for right, of in ((0, 20), (3, 20), (10, 20), (20, 20), (199, 200)):
        expected = accuracy(np.arange(of) < right)
        for shares in (np.array([right / of]), np.full(5, right / of)):
            assert bootstrap(shares, of, np.random.default_rng(0)) == pytest.approx(expected[1:], abs=1e-4)
