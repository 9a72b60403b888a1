"""The conditions are spread evenly over the grid, and none is chosen by hand."""

from dataclasses import asdict, replace

import pandas as pd
import pytest

from bicode_studies.robustness.link_conditions import (
    FACTORS,
    HOME,
    LinkCondition,
    balanced_conditions,
    clutter_conditions,
)


def test_each_level_comes_equally_often_before_the_lines() -> None:
    for count, seed in ((200, 20261127), (120, 5)):
        conditions = balanced_conditions(count, seed)
        lines = {replace(HOME, **level) for levels in FACTORS for level in levels}
        grid = pd.DataFrame([asdict(condition) for condition in conditions[: -len(lines)]])
        for levels in FACTORS:
            counts = grid.groupby(list(levels[0])).size()
            assert len(counts) == len(levels)
            assert counts.max() - counts.min() <= 5  # 1, and conditions that came twice
            assert counts.min() >= count / len(levels) - 5


def test_all_one_factor_lines_are_there_and_no_condition_comes_twice() -> None:
    conditions = balanced_conditions()
    assert len(conditions) == len(set(conditions)) > 200
    assert {replace(HOME, **level) for levels in FACTORS for level in levels} <= set(conditions)
    assert conditions == balanced_conditions()
    assert conditions != balanced_conditions(seed=1)


def test_levels_of_different_factors_come_together() -> None:
    table = pd.DataFrame([asdict(condition) for condition in balanced_conditions()])
    for one, other in (("f_id_hz", "distance_m"), ("payload_bits", "clutter"), ("speed_px_per_s", "current_ma")):
        pairs = table.groupby([one, other]).size()
        assert len(pairs) == table[one].nunique() * table[other].nunique()


def test_the_grid_is_the_one_that_was_asked_for() -> None:
    sizes = [len(levels) for levels in FACTORS]
    assert sizes == [5, 4, 6, 3, 3, 2]
    assert [level["f_id_hz"] for level in FACTORS[0]] == [500, 1000, 2000, 3000, 4000]
    assert [level["distance_m"] for level in FACTORS[2]] == [2.5, 5, 10, 20, 30, 40]
    assert [level["speed_px_per_s"] for level in FACTORS[3]] == [0, 100, 300]
    assert [level["amount"] for level in FACTORS[4]] == [0, 20, 4]
    assert [level["current_ma"] for level in FACTORS[5]] == [10.7, 21.3]
    assert HOME.packet_format.packet_us == 14_000
    assert replace(HOME, payload_bits=32, f_id_hz=2000.0).packet_format.packet_us == 19_000


def test_clutter_has_each_kind_at_each_distance() -> None:
    conditions = clutter_conditions()
    assert len(conditions) == len(set(conditions)) == 8 * 3
    assert {c.amount for c in conditions if c.clutter == "tiles"} == {5, 20, 60}
    assert {c.distance_m for c in conditions} == {5, 10, 20}


def test_unknown_clutter_is_refused() -> None:
    with pytest.raises(ValueError, match="clutter='rain' is not known; choose none, tiles"):
        LinkCondition(clutter="rain")  # type: ignore[arg-type]
