"""Tests of the list of parts: Ohm's law, the E24 series, and values that are refused."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.fabrication import Driver, leds, nearest_e24, parts_list
from bicode_lab.marker import Board, Marker

SERIES = {f"{e / 10:.1f}" for e in (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30,
                                    33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91)}  # fmt: skip
RED, INFRARED = leds()["red"], leds()["ir"]


@given(st.floats(0.5, 1e7))
def test_e24_values_are_near_and_of_the_series(ohm: float) -> None:
    near, above, below = nearest_e24(ohm), nearest_e24(ohm, above=True), nearest_e24(ohm, below=True)
    assert below * (1 - 1e-9) <= ohm < above
    assert near in (below, above)
    assert max(near / ohm, ohm / near) <= math.sqrt(16 / 13) + 1e-9  # half of the series' widest step
    assert f"{near:.1e}"[:3] in SERIES


@given(st.floats(0.1, 40.9), st.floats(2.5, 24))
def test_current_obeys_ohm_and_the_limit(current_ma: float, supply_v: float) -> None:
    driver = Driver(led=RED, current_ma=current_ma, supply_v=supply_v)
    total_v = driver.real_current_ma * 1e-3 * driver.resistor_ohm + RED.forward_v + 0.1
    assert total_v == pytest.approx(supply_v)
    assert driver.real_current_ma <= RED.max_ma * (1 + 1e-9)
    assert driver.real_current_ma == pytest.approx(current_ma, rel=0.25)
    pin_ma = (3.3 - 0.7) / driver.base_ohm * 1e3
    assert driver.real_current_ma / 20 <= pin_ma * (1 + 1e-9)
    assert driver.base_ohm <= 1000


def test_the_papers_currents() -> None:
    """Compare a circuit of 5 V with 2.1 V across the LED with a calculation by hand."""
    chosen = {ma: Driver(led=RED, current_ma=ma).resistor_ohm for ma in (2.7, 5.5, 10.7, 21.3, 40.9)}
    assert chosen == {2.7: 1000, 5.5: 510, 10.7: 270, 21.3: 130, 40.9: 75}  # 68 would be nearest to 68.5: 41.2 mA


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"current_ma": 41}, "above 40.9 mA"),
        ({"current_ma": 0}, "more than 0"),
        ({"current_ma": float("nan")}, "more than 0"),
        ({"supply_v": 2.2}, "choose a supply above 2.2 V"),
        ({"supply_v": float("nan")}, "choose a supply"),
        ({"led": replace(RED, forward_v=-1.0)}, "forward"),
        ({"led": INFRARED, "current_ma": 20.5}, "IV-D"),
        ({"led": replace(RED, max_ma=30.0, max_from="as given"), "current_ma": 31}, "above 30 mA, as given"),
    ],
)
def test_misuse_is_refused_with_words(change: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Driver(**{"led": RED, "current_ma": 10.7, **change})  # type: ignore[arg-type]


def test_list_names_the_papers_parts_and_marks_assumptions() -> None:
    driver = Driver(led=INFRARED, current_ma=20.4)
    text = parts_list(Marker(board=Board(glow="white"), band="infrared"), driver, "D0")
    for word in ("OSI5LA5A33A-B", "XIAO RP2040", "reflection tape", "shading plate", "acrylic", "transistor", "IR88",
                 "assumption", "200 ohm", "18.50 mA", "pattern_size_m=0.0375", "14 ms"):  # fmt: skip
        assert word in text
    assert "OSR5CA5B61P" in parts_list(Marker(), Driver(led=RED, current_ma=10.7), "D0")
