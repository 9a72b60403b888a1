"""A receiver is called worse where it reads less than the better of the others, beyond chance, and nowhere else."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest

from bicode_studies.robustness.link_conditions import HOME, LinkCondition
from bicode_studies.robustness.never_worse import clutter_curves, totals, verdicts

FAR = replace(HOME, distance_m=40.0)


def rows(condition: LinkCondition, **right: list[int]) -> list[dict[str, object]]:
    """Return rows of trials with given counts of right periods, one for each seed."""
    rest = {"right_first": 1, "right_fifth": 0, "wrong_ids": 1, "packets": 20, "packets_right": 5, "false_rows": 2,
            "rows": 10, "first_right_ms": 33.0, "ms_per_period": 4.0}  # fmt: skip
    return [
        {**asdict(condition), "seed": seed, "receiver": name, "periods": 10, "right": count, **rest}
        for name, counts in right.items()
        for seed, count in enumerate(counts)
    ]


def judged(**right: list[int]) -> pd.Series:
    return verdicts(pd.DataFrame(rows(HOME, **right))).iloc[0]


def test_the_better_of_the_others_is_what_counts() -> None:
    row = judged(paper=[10, 10, 9], soft=[0, 0, 0], sequential=[2, 3, 2])
    assert row["better"] == "paper"
    assert row["difference"] == pytest.approx(7 / 30 - 29 / 30)
    assert row["is_worse"]
    assert row["seeds"] == 3
    assert row["wrong_ids"] == 3
    row = judged(paper=[0, 0, 0], soft=[10, 10, 9], sequential=[10, 10, 9])
    assert (row["better"], row["difference"], row["is_worse"], row["is_worse_apart"]) == ("soft", 0, False, False)


def test_each_seed_is_compared_with_itself() -> None:
    same = judged(paper=[10, 0, 5, 2], soft=[0] * 4, sequential=[9, 0, 4, 1])  # seeds differ more than receivers
    assert not same["is_worse_apart"]
    assert same["low"] < -0.075 < same["high"]
    always = judged(paper=[10, 1, 5, 2], soft=[0] * 4, sequential=[9, 0, 4, 1])
    assert always["is_worse"]
    assert not always["is_worse_apart"]
    own = pd.DataFrame(rows(HOME, sequential=[9, 0, 4, 1])).iloc[::-1]
    mixed = pd.concat([pd.DataFrame(rows(HOME, paper=[10, 1, 5, 2], soft=[0] * 4)), own])
    assert verdicts(mixed).iloc[0]["is_worse"]


def test_a_receiver_that_never_reads_is_worse_by_either_interval() -> None:
    row = judged(paper=[10] * 6, soft=[0] * 6, sequential=[0] * 6)
    assert row["is_worse"]
    assert row["is_worse_apart"]
    assert row["difference"] == -1


def test_equal_receivers_are_worse_as_rarely_as_the_interval_says() -> None:
    rng = np.random.default_rng(1)
    found = [
        judged(**{name: rng.binomial(10, 0.6, 6).tolist() for name in ("paper", "soft", "sequential")})["is_worse"]
        for _ in range(200)
    ]
    # The better of the two is chosen by the same trials, so more than 2.5 % of equal receivers are called worse.
    assert 0.02 < np.mean(found) < 0.15


def test_conditions_stay_apart_and_in_their_order() -> None:
    table = pd.DataFrame(
        rows(FAR, paper=[0, 0], soft=[1, 1], sequential=[4, 4])
        + rows(HOME, paper=[9, 9], soft=[1, 1], sequential=[9, 9])
    )
    found = verdicts(table)
    assert found["distance_m"].tolist() == [40.0, 10.0]
    np.testing.assert_allclose(found["difference"], [0.3, 0.0])
    np.testing.assert_allclose(found[["paper", "soft", "sequential"]], [[0, 0.1, 0.4], [0.9, 0.1, 0.9]])


def test_totals_are_per_period_and_per_recording() -> None:
    table = pd.DataFrame(rows(HOME, paper=[9, 7], soft=[1, 1]) + rows(FAR, paper=[2, 2]))
    table.loc[table["distance_m"] == 40, ["first_right_ms", "right_first"]] = [None, 0]
    paper, soft = totals(table).to_dict("records")
    assert (paper["periods"], paper["accuracy"], paper["wrong_ids"]) == (40, 0.5, 4)
    assert (paper["right_first"], paper["right_fifth"], paper["packets_right"]) == (0.5, 0, 0.25)
    assert (paper["false_rows"], paper["rows"], paper["ms_per_period"]) == (0.2, 1.0, 4.0)
    assert (paper["first_right_ms"], soft["first_right_ms"]) == (33.0, 33.0)
    near, far = totals(table[table["receiver"] == "paper"], ("distance_m",)).to_dict("records")
    assert (near["accuracy"], far["accuracy"]) == (0.8, 0.2)
    assert np.isnan(far["first_right_ms"])


def test_curves_of_clutter_begin_without_it() -> None:
    tiles, lamps = (replace(HOME, clutter=kind, amount=5.0) for kind in ("tiles", "lamps"))
    table = pd.DataFrame(
        rows(HOME, paper=[10, 10]) + rows(tiles, paper=[4, 6]) + rows(lamps, paper=[0, 0]) + rows(FAR, paper=[0, 0])
    )
    curve = clutter_curves(table, "tiles", 10.0)
    assert curve["level"].tolist() == [0.0, 5.0]
    np.testing.assert_allclose(curve["accuracy"], [1.0, 0.5])
    assert (curve["low"] <= curve["accuracy"]).all()
