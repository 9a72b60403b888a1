"""The distance: each statement of section IV-A is asked for, by its own bound, and a bad candidate is given up."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from bicode_lab.constants import constant
from bicode_studies.calibration import distance
from bicode_studies.calibration.candidates import NAMES, NOT_IN_FIG_8, candidate_in_use, other_constants
from bicode_studies.calibration.cells import SEEDS, Cell, seeds_of
from bicode_studies.calibration.distance import FITTED, TERMS, Proposal, terms, try_proposal

SOFT = 2 * np.log(2)
RIGHT: dict[Cell, float] = {
    ("ID", 10.7, 20.0): 0.5, ("ID", 10.7, 25.0): 0.5, ("ID", 21.3, 30.0): 0.5, ("ID", 21.3, 35.0): 0.5,
    ("ID", 5.5, 30.0): 0.49, ("2D", 10.7, 0.5): 0.995, ("2D", 10.7, 1.0): 1.0, ("2D", 10.7, 2.5): 1.0,
    ("2D", 10.7, 7.5): 0.5, ("2D", 5.5, 2.5): 1.0, ("2D", 5.5, 5.0): 0.5, ("2D", 10.7, 5.0): 0.3,
    ("2D", 21.3, 2.5): 1.0, ("2D", 21.3, 5.0): 0.2,
}  # fmt: skip
FAR: dict[Cell, float] = {("ID", 5.5, 30.0): 0.5, ("ID", 5.5, 40.0): 0.4, ("ID", 21.3, 40.0): 0.5}
FARTHER: dict[Cell, float] = {**FAR, ("ID", 5.5, 40.0): 0.9, ("ID", 5.5, 50.0): 0.4, ("ID", 21.3, 50.0): 0.5}
WRONG: list[tuple[Mapping[Cell, float], dict[str, float]]] = [
    ({("ID", 10.7, 20.0): 0.3}, {"F8.3a": 4.0}),
    ({("ID", 21.3, 30.0): 0.4}, {"F8.4a": 1.0}),
    ({("ID", 10.7, 25.0): 1.0}, {"F8.3b": SOFT}),
    ({("ID", 21.3, 35.0): 1.0}, {"F8.4b": SOFT}),
    ({("2D", 10.7, 2.5): 0.945}, {"F8.1 2.5 m": 1.0}),
    ({("2D", 10.7, 1.0): 0.895}, {"F8.1 1 m": 4.0}),
    ({("2D", 10.7, 0.5): 0.945}, {"F8.1 0.5 m": 1.0}),
    ({("2D", 10.7, 7.5): 0.6}, {"F8.2": 1.0}),
    ({("2D", 10.7, 5.0): 0.4}, {}),  # what is at 5 m is open
    ({("2D", 21.3, 2.5): 0.0}, {}),
    # ranges of 5, 3.929 and 4.583 m: the last step is 0.655 m the wrong way
    ({("2D", 10.7, 5.0): 0.125, ("2D", 21.3, 5.0): 0.4}, {"F8.6": (1.25 / 0.6 - 1.25 / 0.875) ** 2 / 0.09}),
    # all three ranges are 5 m: they do not fall by 0.3 m
    ({("2D", 10.7, 5.0): 0.5, ("2D", 21.3, 5.0): 0.5}, {"F8.6": 1.0}),
    (FAR, {}),
    ({**FAR, ("ID", 21.3, 40.0): 0.3}, {"F8.5": 4.0}),
    (FARTHER, {}),
    ({**FARTHER, ("ID", 21.3, 50.0): 0.3}, {"F8.5": 4.0}),
    ({**FARTHER, ("ID", 5.5, 50.0): 0.7}, {"F8.5": 4.0}),
]  # fmt: skip


@pytest.fixture(autouse=True)
def evidence(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """Return the misfits that the evidence beyond Fig. 8 has, all 0 at first."""
    z = dict.fromkeys(("latency", "quiet", "refractory", "blink"), 0.0)
    for name in z:
        monkeypatch.setattr(distance, f"{name}_misfit", lambda candidate, name=name: z[name])
    return z


def found(accuracies: Mapping[Cell, float]) -> dict[str, float]:
    """Return the terms above 0."""
    return {name: term for name, term in terms(candidate_in_use(), accuracies.__getitem__) if term > 1e-9}


def test_what_the_paper_states_has_no_misfit() -> None:
    assert found(RIGHT) == {}
    assert tuple(name for name, _ in terms(candidate_in_use(), RIGHT.__getitem__)) == TERMS


@pytest.mark.parametrize(("change", "wanted"), WRONG)
def test_what_is_off_is_noticed_by_its_statement_and_no_other(
    change: Mapping[Cell, float], wanted: dict[str, float]
) -> None:
    assert found({**RIGHT, **change}) == pytest.approx(wanted, rel=1e-4)  # F8.3b comes close to its limit
    assert {*RIGHT, *change} <= set(SEEDS)


def test_evidence_adds_its_squares(evidence: dict[str, float]) -> None:
    evidence.update(latency=-9.0, quiet=2.0, refractory=1.0, blink=3.0)
    assert found(RIGHT) == pytest.approx({"latency": SOFT, "quiet_rate": 4.0, "refractory": 1.0, "blinks": 9.0})


def tried(monkeypatch: pytest.MonkeyPatch, tolerance: float, accuracies: Mapping[Cell, float]) -> dict[str, Any]:
    """Try the candidate in use, which has some accuracies."""

    def read(_: object, cell: Cell, seeds: range) -> float:
        assert seeds == seeds_of(cell, 7)
        return accuracies[cell]

    monkeypatch.setattr(distance, "cell_accuracy", read)
    proposal = Proposal(candidate=candidate_in_use(), tolerance=tolerance, others=other_constants(FITTED))
    (row,) = try_proposal(proposal, 7)
    return row


def test_a_candidate_is_tried_on_all_terms_or_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    accuracies = {**RIGHT, ("ID", 10.7, 20.0): 0.3, ("ID", 21.3, 30.0): 0.4}
    row = tried(monkeypatch, 5.1, accuracies)
    assert (row["is_whole"], row["number"]) == (1, 7)
    assert row["distance"] == pytest.approx(5.0)
    assert row["ID 10.7 mA 20 m"] == 0.3
    assert {name: row[name] for name in NAMES} == vars(candidate_in_use())
    row = tried(monkeypatch, 3.9, accuracies)
    assert row["is_whole"] == 0
    assert row["distance"] == pytest.approx(4.0)
    assert "ID 21.3 mA 30 m" not in row


def test_a_distance_that_is_the_tolerance_is_within(monkeypatch: pytest.MonkeyPatch) -> None:
    accuracies = {**RIGHT, ("ID", 10.7, 20.0): 0.3}
    whole = tried(monkeypatch, 100.0, accuracies)
    assert tried(monkeypatch, whole["distance"], accuracies) == whole


def test_a_candidate_that_fails_at_the_last_term_is_not_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    row = tried(monkeypatch, 0.5, {**RIGHT, ("2D", 10.7, 0.5): 0.945})
    assert row["is_whole"] == 1
    assert row["distance"] > 0.5


def test_other_constants_are_those_that_a_trial_depends_on() -> None:
    others = json.loads(other_constants(FITTED))
    assert others["halo_px"] == constant("halo_px")
    assert not {*NAMES, *NOT_IN_FIG_8} & set(others)
    with pytest.raises(ValueError, match="has changed since the run"):
        try_proposal(Proposal(candidate=candidate_in_use(), tolerance=1.0, others="{}"), 0)
