"""Bounds are those that two readers wrote down independently of each other, and both readings of a sentence count."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.claims.readings import by_reading, one_verdict, readings_of
from bicode_studies.claims.table import read_claims
from bicode_studies.claims.verdicts import judge_claim

ROOT = Path(__file__).resolve().parents[3]
FIRST, SECOND = (
    pd.read_csv(ROOT / "data" / "readings" / f"{name}.csv", dtype=str, keep_default_na=False)
    for name in ("first", "second")
)
CLAIMS = read_claims()
MEASURED = CLAIMS[CLAIMS["kind"].isin(["number", "order"])].set_index("id", drop=False)
ACCURACIES = {"accuracy_id", "accuracy_2d"}
Bounds = tuple[float, float, bool, bool]
ORDER: Bounds = (0.0, math.inf, True, False)


def bounds_read(row: pd.Series) -> Bounds:
    """Return the bounds of a reader's row as the table of claims has them.

    An order is a difference above 0 in the direction of the sentence, whichever way round a reader wrote it; a region
    larger than another is an order, too. Accuracies end at 0 and 1.
    """
    is_accuracy = row["quantity"] in ACCURACIES
    least, most = (0.0, 1.0) if is_accuracy else (-math.inf, math.inf)
    lo, hi = (float(row["lo"]) if row["lo"] else least), (float(row["hi"]) if row["hi"] else most)
    opened = (row["lo_open"] == "yes", row["hi_open"] == "yes")
    if row["quantity"] == "order":
        assert (lo, hi, *opened) in {(0.0, math.inf, True, False), (-math.inf, 0.0, False, True)}
        return ORDER
    if (row["quantity"], lo) == ("region_ratio", 1.0):
        return ORDER
    return (lo, hi, *opened)


def bounds_of(readers: list[pd.DataFrame], name: str) -> set[Bounds]:
    """Return all bounds that readers gave a claim."""
    return {bounds_read(row) for reader in readers for _, row in reader[reader["id"] == name].iterrows()}


def test_both_readers_read_every_number_and_order() -> None:
    assert set(FIRST["id"]) == set(SECOND["id"]) == set(MEASURED.index)


@pytest.mark.parametrize("name", MEASURED.index)
def test_the_first_bounds_of_a_claim_are_what_both_readers_agree_on(name: str) -> None:
    a = readings_of(MEASURED.loc[name])[0]
    bounds = (a.lo, a.hi, a.lo_open, a.hi_open)
    assert bounds in bounds_of([FIRST], name)
    assert bounds in bounds_of([SECOND], name)


@pytest.mark.parametrize("name", MEASURED.index)
def test_what_a_reader_left_open_is_tested_and_nothing_else(name: str) -> None:
    readings = readings_of(MEASURED.loc[name])
    tested = {(each.lo, each.hi, each.lo_open, each.hi_open) for each in readings}
    read = bounds_of([FIRST, SECOND], name)
    if name == "A2":  # its reading b is the one that was used before; see docs/reading_the_claims.md
        assert tested - read == {(2.5, 2.5, False, False)}
        assert read < tested
    else:
        assert tested == read
    open_to = [reader["reading"][reader["id"] == name].max() for reader in (FIRST, SECOND)]
    says_more = {"F9.5", "F14.8"}  # a sentence that is the wrong way round; one half of it only the first reader read
    assert (len(readings) == 2) == ("b" in open_to or name in says_more)


def test_only_sentences_with_two_readings_have_words_for_them() -> None:
    both = CLAIMS["reading_b"] != ""
    assert (CLAIMS.loc[both, ["reading_a"]] != "").all(axis=None)
    assert (CLAIMS.loc[~both, ["reading_a", "lo_b", "hi_b", "lo_b_open", "hi_b_open"]] == "").all(axis=None)
    assert (CLAIMS.loc[both, ["lo_b", "hi_b"]] != "").any(axis=1).all()
    assert set(CLAIMS[["lo_open", "hi_open", "lo_b_open", "hi_b_open"]].to_numpy().ravel()) == {"", "yes"}


def test_the_table_of_differences_names_each_claim_in_which_the_readers_differ() -> None:
    text = (ROOT / "docs" / "reading_the_claims.md").read_text(encoding="utf-8")
    table = text[text.index("## Where the two readers differ") :]
    named = {line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")} - {"claim"}
    differ = {name for name in MEASURED.index if rows_of(FIRST, name) != rows_of(SECOND, name)}
    assert differ <= named
    assert named <= set(MEASURED.index)


def rows_of(reader: pd.DataFrame, name: str) -> set[tuple[str, str, Bounds]]:
    """Return the readings of a reader, each with its letter, what it is about, and its bounds."""
    return {(row["reading"], row["quantity"], bounds_read(row)) for _, row in reader[reader["id"] == name].iterrows()}


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        (("0.995", "1", "", ""), "0.995 .. 1"),
        (("0.9", "1", "yes", ""), "above 0.9, at most 1"),
        (("0", "0.5", "", "yes"), "at least 0, below 0.5"),
        (("20", "20", "", ""), "20"),
        (("7.5", "", "", ""), "at least 7.5"),
        (("20", "", "yes", ""), "above 20"),
        (("", "0.1", "", ""), "at most 0.1"),
        (("", "", "", ""), ""),
    ],
)
def test_bounds_are_told_in_words(bounds: tuple[str, str, str, str], words: str) -> None:
    claim = dict(zip(["lo", "hi", "lo_open", "hi_open"], bounds, strict=True)) | {"reading_a": "", "reading_b": ""}
    assert readings_of(claim)[0].bounds == words


def static_trials(accuracies: dict[float, float]) -> dict[str, pd.DataFrame]:
    """Return trials of Fig. 8 at 10.7 mA, of many seeds that all have the same accuracy."""
    rows = [
        {"distance_m": d, "seed": seed, "receiver": "ours", "frame_rule_2d": "any", "current_ma": 10.7,
         "periods": 2000, "id_right": 2000 * share, "marker_2d_right": 2000 * share}
        for d, share in accuracies.items() for seed in range(400)
    ]  # fmt: skip
    return {"08": pd.DataFrame(rows)}


@pytest.mark.parametrize(
    ("accuracies", "verdicts", "together"),
    [
        ({10: 1, 20: 0.7, 25: 0.1}, ("reproduced", "reproduced"), "reproduced"),
        ({10: 1, 20: 0.7, 25: 0.7, 30: 0.1}, ("reproduced", "contradicted"), "depends on the reading"),
        ({10: 0.3, 20: 0.7, 25: 0.1}, ("contradicted", "reproduced"), "depends on the reading"),
        ({10: 1, 20: 0.3, 25: 0.1}, ("contradicted", "contradicted"), "contradicted"),
    ],
)
def test_a_claim_with_two_readings_is_judged_by_both(
    accuracies: dict[float, float], verdicts: tuple[str, str], together: str
) -> None:
    row = judge_claim(MEASURED.loc["F8.3"].to_dict(), static_trials(accuracies))
    assert (row["verdict_a"], row["verdict_b"]) == verdicts
    assert row["verdict"] == together
    assert row["ours"].startswith("a: ")
    assert "; b: " in row["ours"]


def test_readings_that_agree_in_a_verdict_have_it_together() -> None:
    assert one_verdict(["undecided", "undecided"]) == "undecided"
    assert one_verdict(["contradicted", "undecided"]) == "depends on the reading"
    assert by_reading(["x", "y"]) == "a: x; b: y"
