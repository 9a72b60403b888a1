"""Each claim is reproduced in a made-up world where it is plainly true, and contradicted where it is plainly false."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import accumulate
from bicode_studies.claims import text_claims, worked_out
from bicode_studies.claims.figure_claims import TESTS
from bicode_studies.claims.text_claims import FACTS
from bicode_studies.claims.verdicts import judge_claim
from tests.studies.claims.counter_worlds import WORLDS, Part, tables_of

CLAIMS = pd.read_csv(
    Path(__file__).resolve().parents[3] / "data" / "paper_claims.csv", dtype=str, keep_default_na=False
).set_index("id", drop=False)


def verdict_in(name: str, parts: Sequence[Part]) -> tuple[str, str]:
    """Return the verdict on a claim in a world, and our finding in words.

    What a constant was fitted to is left out, for the verdict on the value alone is asked.
    """
    claim = {**CLAIMS.loc[name].to_dict(), "calibrated_on": ""}
    row = judge_claim(claim, tables_of(parts))
    return row["verdict"], row["ours"]


def test_every_claim_has_a_true_and_a_false_world_and_one_that_divides_its_readings() -> None:
    assert set(WORLDS) == set(TESTS)
    for name, worlds in WORLDS.items():
        assert worlds.true, name
        assert worlds.false, name
        assert bool(worlds.split) == bool(CLAIMS.loc[name, "reading_b"]) or name == "F14.2", name


@pytest.mark.parametrize("name", [name for name, worlds in WORLDS.items() if not worlds.excluding])
def test_a_claim_is_reproduced_where_it_is_true(name: str) -> None:
    for parts in WORLDS[name].true:
        found, ours = verdict_in(name, parts)
        assert found == "reproduced", ours


@pytest.mark.parametrize("name", WORLDS)
def test_a_claim_is_contradicted_where_it_is_false(name: str) -> None:
    worlds = WORLDS[name]
    for change in worlds.false:
        found, ours = verdict_in(name, [*worlds.true[0], *change])
        assert found == "contradicted", f"{change}: {ours}"


@pytest.mark.parametrize("name", [name for name, worlds in WORLDS.items() if worlds.split])
def test_a_claim_whose_readings_differ_is_neither(name: str) -> None:
    worlds = WORLDS[name]
    for change in worlds.split:
        found, ours = verdict_in(name, [*worlds.true[0], *change])
        assert found not in ("reproduced", "contradicted"), f"{change}: {ours}"


# Statements without chance: none holds where the paper would say another number, or where the package did otherwise.

OTHER_NUMBER = [
    *("P01", "P02", "P03", "P04", "P05", "P06", "P07", "P09", "P11", "P14", "A3"),
    *("I01", "I02", "I03", "I04", "I05", "I06", "I07", "I08", "I09", "I16", "I17", "I18", "I19", "I20"),
    *("I21", "I22", "I23", "I24", "I25", "I26", "I27", "F8.0", "F9.0", "F12.0", "F14.0"),
]


def darker_with_distance(*, distance_m: float) -> SimpleNamespace:
    """Return the link budget of a world in which light falls with the distance, not with its square."""
    return SimpleNamespace(contrast=np.log1p(1 / distance_m))


def brighter_by_the_square(*, current_ma: float) -> SimpleNamespace:
    """Return a marker of a world in which light grows with the square of the current."""
    return SimpleNamespace(luminance_ratio=current_ma**2)


OTHERWISE: dict[str, tuple[ModuleType, str, object]] = {
    "P08": (worked_out, "led_state", lambda n_on, n_off: (np.asarray(n_on) >= n_off).astype(int)),
    "P10": (worked_out, "longest_accepted_us", lambda name: 50_000),
    "P12": (worked_out, "accumulate", lambda events, width, height, rule: accumulate(events, width, height, "last")),
    "P13": (worked_out, "PacketFormat", lambda: PacketFormat(start_bits=8)),
    "P15": (worked_out, "longest_blink_us", lambda: 2_500),
    "P16": (worked_out, "read", lambda payloads: [SimpleNamespace(id=payload) for payload in payloads][:2]),
    "I13": (text_claims, "IR88_TRANSMITTANCE", 0.5),
    "F8.8": (text_claims, "Marker", brighter_by_the_square),
    "F8.9": (worked_out, "link_budget", darker_with_distance),
    "F10.8": (worked_out, "Marker", lambda board, current_ma: SimpleNamespace(luminance_ratio=current_ma)),
}
NOT_MODELLED = ["I10", "I11", "I12", "I14", "I15", "F12.7"]  # names of parts, and the authors' computer


def fact_holds(name: str, stated: str) -> bool | None:
    """Return whether the package says what a claim would state."""
    return FACTS[name](tables_of([]), stated).holds


def test_every_statement_without_chance_has_another_world_or_is_not_modelled() -> None:
    assert sorted([*OTHER_NUMBER, *OTHERWISE, *NOT_MODELLED]) == sorted(FACTS)
    for name in NOT_MODELLED:
        assert FACTS[name]({}, "").why_not


@pytest.mark.parametrize("name", OTHER_NUMBER)
def test_a_statement_with_another_number_does_not_hold(name: str) -> None:
    """Each number of the statement is changed by itself, to more than twice as much, and the digits of an ID, too."""
    stated = CLAIMS.loc[name, "value"]
    numbers = list(re.finditer(r"\d+(?:\.\d+)?", stated))
    assert numbers
    for number in numbers:
        other = f"{2.5 * float(number[0]) + 1:g}"
        assert fact_holds(name, stated[: number.start()] + other + stated[number.end() :]) is False


@pytest.mark.parametrize("name", OTHERWISE)
def test_a_statement_does_not_hold_for_a_package_that_does_otherwise(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stated = CLAIMS.loc[name, "value"]
    assert fact_holds(name, stated)
    monkeypatch.setattr(*OTHERWISE[name])
    assert fact_holds(name, stated) is False
