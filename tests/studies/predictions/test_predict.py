"""Claims are judged set by set: inside or outside, from sets of the posterior and of the prior."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bicode_studies.calibration.candidates import NAMES, candidate_in_use
from bicode_studies.claims.claim_result import ClaimResult, NoTrials
from bicode_studies.claims.readings import Reading
from bicode_studies.claims.table import read_claims
from bicode_studies.predictions import predict as module
from bicode_studies.predictions.predict import (
    COLUMNS,
    INSIDE,
    NO_VALUE,
    OUTSIDE,
    judge_set,
    predict,
    sets_of_posterior,
    sets_of_prior,
    shares,
    verdict_of_value,
)
from bicode_studies.predictions.trials_of_set import FigureOfSet, conditions_of
from bicode_studies.sweep.sweep import Sweep

USUAL = candidate_in_use()


def reading(lo: float, hi: float, *, lo_open: bool = False, hi_open: bool = False) -> Reading:
    """Return a reading with bounds."""
    return Reading(name="a", words="", lo=lo, hi=hi, lo_open=lo_open, hi_open=hi_open)


@pytest.mark.parametrize(
    ("result", "bounds", "verdict"),
    [
        (ClaimResult(value=0.5), reading(0.5, 1), INSIDE),
        (ClaimResult(value=0.5), reading(0.5, 1, lo_open=True), OUTSIDE),
        (ClaimResult(value=0.5), reading(0, 0.5, hi_open=True), OUTSIDE),
        (ClaimResult(value=0.48, band=0.02), reading(0.5, 1), INSIDE),
        (ClaimResult(value=0.47, band=0.02), reading(0.5, 1), OUTSIDE),
        (ClaimResult(value=1.1), reading(0.5, 1), OUTSIDE),
        (ClaimResult(value=0.3, lo=0.2, hi=0.4), reading(0.5, 1), INSIDE),
        (ClaimResult(value=0.1, is_order=True), reading(-math.inf, math.inf), INSIDE),
        (ClaimResult(value=0.0, is_order=True), reading(-math.inf, math.inf), OUTSIDE),
        (ClaimResult(value=0.1, is_order=True, broken="at 5 m"), reading(-math.inf, math.inf), OUTSIDE),
        (ClaimResult(why_not="no model"), reading(0, 1), NO_VALUE),
    ],
)
def test_a_value_is_inside_or_outside(result: ClaimResult, bounds: Reading, verdict: str) -> None:
    assert verdict_of_value(result, bounds) == verdict


def made_up(figure: str, reach_m: float, seed: int = 0) -> list[dict[str, Any]]:
    """Return rows of a world in which all is read up to a distance."""
    rows = []
    for condition in conditions_of(figure):
        right = 5 if condition.distance_m <= reach_m else 0
        about = {**asdict(condition), "seed": seed, "periods": 5, "receiver": "ours", "frame_rule_2d": "any"}
        rows.append({**about, "id_right": right, "marker_2d_right": right})
    return rows


def test_a_set_is_judged_by_its_own_trials_and_readings() -> None:
    claims = read_claims()
    tables = {"08": pd.DataFrame(made_up("08", 20.0))}
    found = pd.DataFrame(judge_set(claims, tables)).set_index(["claim", "reading"])
    assert found.loc[("F8.3", "a"), "verdict"] == INSIDE
    assert found.loc[("F8.3", "b"), "verdict"] == INSIDE
    assert found.loc[("F8.4", "a"), "verdict"] == OUTSIDE  # not read at 30 m
    assert found.loc[("F8.2", "a"), "verdict"] == OUTSIDE  # the 2D marker is read beyond 5 m
    assert found.loc[("F8.3", "b"), "value"] == 20
    assert not any(claim.startswith("F9") for claim, _ in found.index)


def test_two_sets_give_two_verdicts_and_resume(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    far = replace(USUAL, led_to_ambient=4.0)
    asked: list[Any] = []

    def run(function: Any, trials: Any, store: Path, **_: object) -> Sweep:
        trials = list(trials)
        asked.append(trials)
        rows: list[dict[str, Any]] = []
        for wanted, seed in trials:
            assert isinstance(wanted, FigureOfSet)
            rows += made_up(wanted.figure, 25.0 if wanted.candidate == far else 20.0, seed)
        return Sweep(table=pd.DataFrame(rows))

    monkeypatch.setattr(module, "sweep", run)
    sets: Mapping[str, Any] = {"posterior": [(USUAL, 0.75), (far, 0.25)], "prior": [(far, 1.0)]}
    table = predict(read_claims(), sets, tmp_path / "none.sqlite", figures=("08",))
    assert list(table.columns) == COLUMNS
    assert len(asked[0]) == 3 * 2  # sets and seeds
    one = table[(table["claim"] == "F8.3") & (table["reading"] == "b")]
    assert one["verdict"].tolist() == [INSIDE, OUTSIDE, OUTSIDE]
    assert one["value"].tolist() == [20, 25, 25]
    found = shares(table).set_index(["claim", "reading"])
    assert found.loc[("F8.3", "b"), "posterior"] == pytest.approx(0.75)
    assert found.loc[("F8.3", "b"), "prior"] == 0


def test_failures_are_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(module, "sweep", lambda *_, **__: Sweep(table=pd.DataFrame(), failures=("one",)))
    with pytest.raises(RuntimeError, match="1 trial failed"):
        predict(read_claims(), {"prior": [(USUAL, 1.0)]}, tmp_path / "none.sqlite", figures=("08",))


def test_the_heaviest_sets_are_taken_and_their_weights_sum_to_one() -> None:
    rows = [{**vars(replace(USUAL, aruco_id=k)), "weight": w} for k, w in enumerate((0.1, 0.6, 0.3))]
    found = sets_of_posterior(pd.DataFrame(rows), 2)
    assert [candidate.aruco_id for candidate, _ in found] == [1, 2]
    assert [weight for _, weight in found] == pytest.approx([2 / 3, 1 / 3])
    drawn = sets_of_prior(5)
    assert drawn == sets_of_prior(5)
    assert sum(weight for _, weight in drawn) == pytest.approx(1)
    assert len({candidate.blur_px for candidate, _ in drawn}) == 5
    assert set(vars(drawn[0][0])) == set(NAMES)


def test_claims_without_trials_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> ClaimResult:
        raise NoTrials("none")

    monkeypatch.setattr(module, "TESTS", {"F8.3": missing})
    monkeypatch.setattr(module, "SECOND", {})
    assert judge_set(read_claims(), {}) == []
