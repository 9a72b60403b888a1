"""Ranges are found again in curves that fall to one half at a known distance."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_studies.robustness.receiver_ranges import receiver_ranges
from bicode_studies.robustness.stressors import DISTANCE
from bicode_studies.statistics import ranges_m

DISTANCES = np.arange(10.0, 51.0, 2.5)


@given(at=st.floats(10.1, 49.9), steep=st.floats(0.05, 0.3))
def test_the_range_of_a_straight_fall_is_where_it_crosses(at: float, steep: float) -> None:
    accuracy = 0.5 - steep * (DISTANCES - at)
    assert ranges_m(DISTANCES, accuracy[None]) == pytest.approx(at)


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
    found = receiver_ranges(pd.concat([other, table])).set_index("receiver")
    for receiver, at in (("paper", 20.0), ("soft", 30.0)):
        row = found.loc[receiver]
        assert row["range_m"] == pytest.approx(at, abs=0.5)
        assert row["low"] < row["range_m"] < row["high"]
        assert row["wrong_ids"] == 20 * DISTANCES.size
    assert (found.loc["paper", ["times_paper", "times_low", "times_high"]] == 1).all()
    low, high = found.loc["soft", ["times_low", "times_high"]]
    assert low < 1.5 < high
    logs = np.log(found[["range_m", "low", "high"]].to_numpy(float))  # of the paper's receiver, of the soft one
    middle = logs[1, 0] - logs[0, 0]
    assert np.log(low) == pytest.approx(middle - np.hypot(logs[1, 0] - logs[1, 1], logs[0, 2] - logs[0, 0]))
    assert np.log(high) == pytest.approx(middle + np.hypot(logs[1, 2] - logs[1, 0], logs[0, 0] - logs[0, 1]))


def test_a_receiver_without_a_range_has_no_ratio() -> None:
    rows = [
        (DISTANCE.name, distance, seed, receiver, 15, right, 0)
        for receiver, right in (("paper", 0), ("soft", 15))
        for seed in range(3)
        for distance in DISTANCES
    ]
    columns = ["stressor", "level", "seed", "receiver", "periods", "right", "wrong_ids"]
    paper, soft = receiver_ranges(pd.DataFrame(rows, columns=columns)).to_dict("records")
    assert (paper["range_m"], soft["range_m"]) == (0.0, DISTANCES[-1])
    assert np.isnan([paper["times_paper"], soft["times_paper"], soft["times_low"], soft["times_high"]]).all()
