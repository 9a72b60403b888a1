"""Where accuracy falls to a half, found again in curves that were drawn with a known place for it."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_studies.robustness.receiver_ranges import crossing_m, receiver_ranges
from bicode_studies.robustness.stressors import DISTANCE

DISTANCES = np.arange(10.0, 51.0, 2.5)


@given(at=st.floats(10.1, 49.9), steep=st.floats(0.05, 0.3))
def test_the_range_of_a_straight_fall_is_where_it_crosses(at: float, steep: float) -> None:
    accuracy = 0.5 - steep * (DISTANCES - at)
    assert crossing_m(DISTANCES, accuracy) == pytest.approx(at)


def test_the_first_fall_counts_and_none_is_beyond_all_distances() -> None:
    assert crossing_m([1, 2, 3, 4], [1, 0.4, 0.9, 0.0]) < 2
    assert crossing_m([1, 2], [1, 0.6]) == np.inf
    assert np.isnan(crossing_m([1, 2], [0.4, 0.2]))


def test_two_receivers_ranges_and_their_ratio_lie_in_their_intervals() -> None:
    rng = np.random.default_rng(3)
    rows = []
    for receiver, at in (("paper", 20.0), ("soft", 30.0)):
        for seed in range(20):
            for distance in DISTANCES:
                right = rng.binomial(15, 1 / (1 + np.exp((distance - at) / 1.5)))
                rows.append((DISTANCE.name, distance, seed, receiver, 15, right, 1))
    columns = ["stressor", "level", "seed", "receiver", "periods", "right", "wrong_ids"]
    table = pd.DataFrame(rows, columns=columns)
    other = table.assign(stressor="loss", right=0)
    found = receiver_ranges(pd.concat([other, table]), np.random.default_rng(0)).set_index("receiver")
    for receiver, at in (("paper", 20.0), ("soft", 30.0)):
        row = found.loc[receiver]
        assert row["range_m"] == pytest.approx(at, abs=0.5)
        assert row["low"] < row["range_m"] < row["high"]
        assert row["wrong_ids"] == 20 * DISTANCES.size
    assert found.loc["paper", "times_paper"] == found.loc["paper", "times_low"] == 1
    assert found.loc["soft", "times_low"] < 1.5 < found.loc["soft", "times_high"]
