"""The committed tables of comparisons hold what the present code counts, wherever they say that it made them."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bicode_studies.robustness.compare import COMPARISONS
from bicode_studies.robustness.link_conditions import COLUMNS, LinkCondition
from bicode_studies.robustness.link_trials import TIMES
from bicode_studies.robustness.never_worse import verdicts
from bicode_studies.robustness.stressors import StressCondition
from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.sweep import CONSTANTS

RESULTS = Path(__file__).resolve().parents[3] / "results"
SAMPLE = 3  # trials of each table and function
LINKS = ("never-worse", "clutter")


def committed(name: str) -> pd.DataFrame:
    path = RESULTS / COMPARISONS[name].file
    if not path.is_file():
        pytest.skip(f"results/{path.name} is not made yet: run bicode compare-receivers {name}")
    return pd.read_csv(path)


def condition_of(name: str, row: dict[str, Any]) -> tuple[Any, int]:
    """Return the condition and the seed of a row."""
    if name == "range":
        return StressCondition(stressor=row["stressor"], level=row["level"]), row["seed"]
    whole = {field.name for field in fields(LinkCondition) if field.type == "int"}
    own = {each: int(row[each]) if each in whole else row[each] for each in COLUMNS}
    return LinkCondition(**own), row["seed"]


@pytest.mark.parametrize("name", ["never-worse", "clutter", "range"])
def test_a_sample_of_trials_is_counted_again(name: str) -> None:
    table = committed(name)
    made_here = 0
    for function in COMPARISONS[name].functions:
        own = table[table["digest"] == digest_of(function, CONSTANTS)]
        for _, row in own.iloc[:: max(len(own) // SAMPLE, 1)].head(SAMPLE).iterrows():
            made_here += 1
            again = pd.DataFrame(function(*condition_of(name, row.to_dict())))
            there = table
            for column in again.columns.intersection([*COLUMNS, "stressor", "level", "seed", "receiver"]):
                there = there[there[column].isin(again[column])]
            kept = [column for column in again if column not in TIMES]
            again = again[kept].astype(there[kept].dtypes.to_dict())  # where no ID is read, a file has NaN for its time
            pd.testing.assert_frame_equal(there[kept].reset_index(drop=True), again)
    if not made_here:
        pytest.skip(f"{COMPARISONS[name].file} was made by earlier code: run bicode compare-receivers {name}")


@pytest.mark.parametrize("name", [*COMPARISONS])
def test_no_trial_is_missing_or_there_twice(name: str) -> None:
    table = committed(name)
    keys = {"range": ["level", "seed", "receiver"], "false-ids": ["piece", "checksum"]}
    by = keys.get(name, [*COLUMNS, "seed", "receiver"])
    assert not table.duplicated(by).any()
    assert set(table.groupby(by[:-1]).size()) == {table[by[-1]].nunique()}


def test_verdicts_are_those_of_the_table() -> None:
    table = committed("never-worse")
    saved = pd.read_csv(RESULTS / "receivers_verdicts.csv")
    pd.testing.assert_frame_equal(saved, verdicts(table), check_dtype=False, rtol=1e-3)
    assert len(saved) >= 200
