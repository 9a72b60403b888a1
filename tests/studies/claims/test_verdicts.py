"""The rule for verdicts: symmetric, with a band, and with regard to the number of claims that are judged."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from bicode_studies.claims.claim_result import ClaimResult
from bicode_studies.claims.curves import Curve
from bicode_studies.claims.figure_claims import SECOND, TESTS
from bicode_studies.claims.statistics import ACCURACY_BAND, FAMILY, FAMILY_LEVEL, both_intervals, worst_accuracy
from bicode_studies.claims.verdicts import order_verdict, verdict
from bicode_studies.statistics import interval_over_seeds, wilson

CLAIMS = pd.read_csv(
    Path(__file__).resolve().parents[3] / "data" / "paper_claims.csv", dtype=str, keep_default_na=False
)
ends = st.floats(-2, 2).flatmap(lambda low: st.tuples(st.just(low), st.floats(low, 2)))


@pytest.mark.parametrize(
    ("ours", "bounds", "strict", "expected"),
    [
        ((0.991, 1.0), (0.99, 1.0), "", "reproduced"),
        ((0.99, 1.0), (0.99, 1.0), "", "reproduced"),  # the bound belongs to it
        ((0.98, 1.0), (0.99, 1.0), "", "undecided"),  # our value may be inside, but its interval is not
        ((0.95, 0.99), (0.99, 1.0), "", "undecided"),  # reaches it and no more
        ((0.95, 0.985), (0.99, 1.0), "", "contradicted"),
        ((0.9, 0.95), (0.9, 1.0), "above", "undecided"),  # "more than 90 %"
        ((0.85, 0.9), (0.9, 1.0), "above", "contradicted"),
        ((0.91, 0.95), (0.9, 1.0), "above", "reproduced"),
        ((0.0, 0.01), (0.0, 0.01), "", "reproduced"),
        ((0.0, 0.02), (0.0, 0.01), "", "undecided"),
        ((0.02, 0.08), (0.0, 0.01), "", "contradicted"),
        ((20, 20), (20, 20), "", "reproduced"),
        ((15, 20), (20, 20), "", "undecided"),
        ((25, 30), (20, 20), "", "contradicted"),
        ((20, 20), (20, 50), "above", "contradicted"),  # "exceeding 20 m"
        ((0.66, 0.74), (0.35, 0.65), "", "contradicted"),
        ((0.2, 0.4), (0.35, 0.65), "", "undecided"),
        ((0.2, 0.8), (0.35, 0.65), "", "undecided"),  # leaves both bounds
        ((-1.0, 0.9), (-1.0, 1.0), "below", "reproduced"),
        ((0.5, 1.0), (0.0, 1.0), "below", "undecided"),
        ((1.0, 1.5), (0.0, 1.0), "below", "contradicted"),
    ],
)
def test_one_rule_for_intervals(
    ours: tuple[float, float], bounds: tuple[float, float], strict: str, expected: str
) -> None:
    assert verdict(*ours, *bounds, above=strict == "above", below=strict == "below") == expected


@pytest.mark.parametrize(
    ("ours", "expected"),
    [
        ((0.88, 0.98), "reproduced"),  # up to the end of the band
        ((0.879, 0.98), "undecided"),
        ((0.7, 0.88), "undecided"),
        ((0.7, 0.879), "contradicted"),
    ],
)
def test_a_band_widens_the_bounds_for_both_verdicts(ours: tuple[float, float], expected: str) -> None:
    assert verdict(*ours, 0.9, 1.0, band=0.02) == expected
    assert verdict(-ours[1], -ours[0], -1.0, -0.9, band=0.02) == expected


@given(ends, ends, st.booleans(), st.booleans(), st.sampled_from([0.0, 0.25]))
def test_the_rule_is_the_same_seen_from_the_other_side(
    ours: tuple[float, float], bounds: tuple[float, float], above: bool, below: bool, band: float
) -> None:
    turned = verdict(-ours[1], -ours[0], -bounds[1], -bounds[0], above=below, below=above, band=band)
    assert verdict(*ours, *bounds, above=above, below=below, band=band) == turned


@given(ends, st.floats(-2, 2))
def test_a_claim_and_its_reverse_change_their_verdicts(ours: tuple[float, float], bound: float) -> None:
    """What reproduces "more than x" contradicts "x or less": both ask for the same certainty."""
    more = verdict(*ours, bound, math.inf, above=True)
    less = verdict(*ours, -math.inf, bound)
    assert {"reproduced": "contradicted", "contradicted": "reproduced", "undecided": "undecided"}[more] == less


@pytest.mark.parametrize(
    ("low", "high", "broken", "expected"),
    [
        (0.1, 0.2, False, "reproduced"),
        (0.0, 0.2, False, "undecided"),
        (-0.1, 0.2, False, "undecided"),
        (0.0, 0.0, False, "undecided"),  # a tie to the last digit
        (-0.2, 0.0, False, "undecided"),
        (-0.2, -0.1, False, "contradicted"),
        (0.1, 0.2, True, "contradicted"),
    ],
)
def test_one_rule_for_orders(low: float, high: float, broken: bool, expected: str) -> None:
    assert order_verdict(low, high, broken) == expected


def test_intervals_are_widened_for_every_number_and_order_that_is_judged() -> None:
    measured = set(CLAIMS.loc[CLAIMS["kind"].isin(["number", "order"]), "id"])
    assert set(TESTS) == {*measured, "F12.6"}
    assert len(TESTS) == FAMILY
    assert set(SECOND) <= measured  # two readings of a sentence are one claim
    assert pytest.approx(0.05) == FAMILY * (1 - FAMILY_LEVEL)
    assert norm.ppf((1 + FAMILY_LEVEL) / 2) == pytest.approx(3.22, abs=0.01)


def test_the_interval_that_is_shown_is_of_95_percent_and_the_one_that_is_judged_is_wider() -> None:
    found = both_intervals(lambda level: tuple(float(end) for end in wilson(30, 40, level)))
    assert (found["low"], found["high"]) == pytest.approx(wilson(30, 40))
    assert (found["judged_low"], found["judged_high"]) == pytest.approx(wilson(30, 40, 1 - 0.05 / 40))
    once_of_four = both_intervals(lambda level: (1 - level, level), times=4)
    assert once_of_four["judged_low"] == pytest.approx(0.05 / 40 / 4)
    assert once_of_four["low"] == pytest.approx(0.05)


def trials(*shares: float, seeds: int = 20) -> tuple[dict[str, pd.DataFrame], Curve]:
    """Return trials of 50 periods, at 1 m, 2 m, ... with these shares of right periods, and their curve."""
    rows = [
        {"distance_m": 1.0 + at, "seed": seed, "periods": 50, "right": 50 * share}
        for at, share in enumerate(shares) for seed in range(seeds)
    ]  # fmt: skip
    return {"99": pd.DataFrame(rows)}, Curve(figure="99", right="right")


def test_an_accuracy_outside_its_bounds_is_judged_with_regard_to_the_number_of_places() -> None:
    """Chance may put any of four outside, so its interval is of a level with a quarter of the misses."""
    tables, curve = trials(0.96, 0.96, 0.7, 0.96)
    outside, inside = worst_accuracy(curve)(tables, 0.9, 1.0), worst_accuracy(curve)(tables, 0.6, 1.0)
    for result, times in ((outside, 4), (inside, 1)):
        ends = interval_over_seeds([35.0] * 20, [50.0] * 20, 1 - 0.05 / 40 / times)
        assert (result.judged_low, result.judged_high) == pytest.approx(ends, abs=1e-6)
        assert result.value == pytest.approx(0.7)
        assert result.band == ACCURACY_BAND


def test_a_place_that_is_surely_outside_counts_before_one_that_may_be_farther_outside() -> None:
    tables, curve = trials(0.78, 0.70)
    few = tables["99"]["distance_m"].eq(2.0) & (tables["99"]["seed"] > 1)
    result = worst_accuracy(curve)({"99": tables["99"][~few]}, 0.9, 1.0)
    assert result.value == pytest.approx(0.78)
    assert result.judged_high < 0.9 - ACCURACY_BAND


def test_all_right_is_certain_from_265_seeds_on() -> None:
    """Half of 0.975^n falls to half of 0.05 / 40 at 264.02 seeds: 0.975 is where 99.5 % and the band end."""
    assert math.log(0.05 / 40) / math.log(0.975) == pytest.approx(264.02, abs=0.01)
    for seeds, expected in ((250, "undecided"), (280, "reproduced")):
        tables, curve = trials(1.0, seeds=seeds)
        result = worst_accuracy(curve)(tables, 0.995, 1.0)
        assert result.judged_low is not None
        assert result.judged_high is not None
        assert verdict(result.judged_low, result.judged_high, 0.995, 1.0, band=result.band) == expected
    assert np.isclose(result.value or 0.0, 1.0)


def test_bounds_are_those_of_the_result_where_it_has_some_and_those_of_an_order_begin_at_0() -> None:
    assert ClaimResult().bounds(0.2, 0.9) == (0.2, 0.9)
    assert ClaimResult(lo=0.0).bounds(0.2, 0.9) == (0.0, 0.9)
    assert ClaimResult(hi=1.0).bounds(0.2, 0.9) == (0.2, 1.0)
    assert ClaimResult(is_order=True, lo=0.3, hi=0.4).bounds(0.2, 0.9) == (0.0, math.inf)
