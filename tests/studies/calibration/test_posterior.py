"""The run: it resumes with the same tables, any number of workers gives the same, and the tables are right."""

from __future__ import annotations

from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bicode_studies.calibration import posterior
from bicode_studies.calibration.candidates import NAMES, Candidate, candidate_in_use
from bicode_studies.calibration.distance import TERMS, Proposal
from bicode_studies.calibration.evidence import latency_misfit
from bicode_studies.calibration.population import Rule
from bicode_studies.calibration.posterior import (
    COLUMNS,
    Trials,
    calibrate,
    posterior_table,
    quantiles,
    read_posterior,
    tension,
    terms_in_use,
    tried_table,
)

RULE = Rule(
    first_draws=60, first_tolerance=30.0, size=20, rounds=2, last_rounds=3, share=0.5, last_tolerance=2.0,
    most_tried=400,
)  # fmt: skip


def try_toy(proposal: Proposal, seed: int) -> list[dict[str, Any]]:
    """Measure how far a candidate is from an LED of 1 and a blur of 1 px, in place of `distance.try_proposal`."""
    one = proposal.candidate
    off = 3 * np.log(one.led_to_ambient) ** 2 + 3 * np.log(one.blur_px) ** 2 + np.random.default_rng(seed).random()
    whole = int(off <= proposal.tolerance)
    return [{**vars(one), "number": seed, "distance": off, "is_whole": whole, "latency": 0.0}]


class InThisProcess:
    """Workers that run a trial when it is submitted; as many are submitted at a time as there would be processes."""

    def __init__(self, jobs: int) -> None:
        self.at_once = jobs

    def submit(self, task: Any, trial: Any) -> Future[Any]:
        """Run a trial."""
        future: Future[Any] = Future()
        future.set_result(task(*trial))
        return future

    def check(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


@pytest.fixture(autouse=True)
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the toy in the place of the real trial, and this process in that of the workers."""
    monkeypatch.setattr(posterior, "try_proposal", try_toy)
    monkeypatch.setattr("bicode_studies.sweep.sweep.LocalWorkers", InThisProcess)


def run(store: Path, jobs: int = 1) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Run the calibration of the toy and return its two tables."""
    trials = Trials(store, jobs)
    *_, found = calibrate(trials, RULE)
    return posterior_table(found, trials), tried_table(trials)


def test_a_run_that_is_stopped_goes_on_to_the_same_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(tmp_path / "whole.sqlite")
    done: list[Any] = []
    through = posterior.sweep

    def breaks(function: Any, trials: Any, *rest: Any, **more: Any) -> Any:
        trials = list(trials)
        if len(done) == 2:  # in the middle of the second generation, and of a round
            through(function, trials[:7], *rest, **more)
            raise KeyboardInterrupt
        done.append(trials)
        return through(function, trials, *rest, **more)

    monkeypatch.setattr(posterior, "sweep", breaks)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "broken.sqlite")
    monkeypatch.setattr(posterior, "sweep", through)
    again = run(tmp_path / "broken.sqlite", jobs=2)
    for one, other in zip(whole, again, strict=True):
        pd.testing.assert_frame_equal(one, other, check_exact=True)


def test_the_tables_hold_the_last_population_and_all_that_was_tried(tmp_path: Path) -> None:
    table, tried = run(tmp_path / "trials.sqlite")
    assert list(table.columns) == COLUMNS
    assert table["weight"].sum() == pytest.approx(1)
    assert table["weight"].is_monotonic_decreasing
    assert table["is_medoid"].sum() == 1
    assert (table["distance"] <= table["tolerance"]).all()
    assert table["generation"].nunique() == 1
    chosen = tried.set_index("number").loc[table["number"]]
    assert (chosen["distance"].to_numpy() == table["distance"].to_numpy()).all()
    assert (chosen[[*NAMES]].to_numpy() == table[[*NAMES]].to_numpy()).all()
    first = table.iloc[0]
    candidate = Candidate(**{name: first[name] for name in NAMES})
    assert first["latency_z"] == pytest.approx(latency_misfit(candidate), abs=0.02)  # rounded to three digits
    assert tried["number"].tolist() == list(range(len(tried)))


def test_the_constants_in_use_are_tried_with_seeds_of_their_own(tmp_path: Path) -> None:
    table = terms_in_use(Trials(tmp_path / "trials.sqlite", 1), 2)
    assert table["number"].tolist() == [posterior.FIRST_IN_USE, posterior.FIRST_IN_USE + 1]
    assert posterior.RULE.most_tried + posterior.RULE.last_rounds * posterior.RULE.size < posterior.FIRST_IN_USE
    assert table[[*NAMES]].iloc[0].to_dict() == vars(candidate_in_use())


def test_the_tension_is_that_of_the_weighted_sets() -> None:
    table = pd.DataFrame({"weight": [0.5, 0.3, 0.15, 0.05], "latency_z": [-2.0, -4.0, 0.0, 1.0]})
    found = tension(table)
    assert (found["z"], found["z_low"], found["z_high"]) == (-2.0, -4.0, 0.0)
    left = [1 / (1 + np.exp(0.5 * z**2)) for z in table["latency_z"]]
    assert found["probability"] == pytest.approx(float(np.dot(table["weight"], left)))


def test_quantiles_are_weighted() -> None:
    table = pd.DataFrame(
        {"weight": [0.04, 0.48, 0.4, 0.08], "one": [1.0, 2.0, 3.0, 9.0], "other": [9.0, 8.0, 7.0, 1.0]}
    )
    found = quantiles(table, ["one", "other"])
    assert found.loc["one"].tolist() == [2.0, 2.0, 9.0]
    assert found.loc["other"].tolist() == [1.0, 8.0, 8.0]


def test_a_table_without_weights_is_no_posterior(tmp_path: Path) -> None:
    table, _ = run(tmp_path / "trials.sqlite")
    table.to_csv(tmp_path / "sets.csv", index=False)
    assert list(read_posterior(tmp_path / "sets.csv").columns) == list(table.columns)
    table.drop(columns="weight").to_csv(tmp_path / "sets.csv", index=False)
    with pytest.raises(ValueError, match=r"sets\.csv has no column weight, so it is no table of sets"):
        read_posterior(tmp_path / "sets.csv")


def test_the_rule_is_the_one_that_was_written_down() -> None:
    page = (Path(posterior.__file__).parents[2] / "docs" / "calibration.md").read_text(encoding="utf-8")
    for said in ("800 draws", "within 150", "six times", "twelve times", "`20261129`", "8 or less", "6,000"):
        assert said in page
    rule = posterior.RULE
    assert (rule.first_draws, rule.first_tolerance, rule.size) == (800, 150, 100)
    assert (rule.rounds, rule.last_rounds) == (6, 12)
    assert (rule.share, rule.last_tolerance, rule.most_tried, posterior.SEED) == (0.5, 8, 6000, 20261129)
    assert all(f"`{term}`" in page for term in ("latency", "quiet_rate", "refractory", "blinks"))
    assert len(TERMS) == len(set(TERMS)) == 14
