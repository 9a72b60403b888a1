"""The stand-in for the authors' computer: more events never lose fewer periods, and what is lost has two bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab import paper
from bicode_studies.paper_experiments.processing_limit import delay_ms, delay_periods, periods_lost

rates = st.floats(0, 500)
limits = st.floats(0.1, 500)
seeds = st.integers(0, 2**32 - 1)


def lost(rate: float, seed: int, **settings: float) -> int:
    return periods_lost(rate, np.random.default_rng(seed), **settings)  # type: ignore[arg-type]


@given(rates, rates, limits, seeds)
def test_more_events_never_lose_fewer(one: float, other: float, limit: float, seed: int) -> None:
    fewer, more = sorted((one, other))
    assert lost(fewer, seed, limit_mev_per_s=limit) <= lost(more, seed, limit_mev_per_s=limit)


@given(rates, limits, limits, seeds)
def test_a_faster_computer_never_loses_more(rate: float, one: float, other: float, seed: int) -> None:
    slow, fast = sorted((one, other))
    assert lost(rate, seed, limit_mev_per_s=fast) <= lost(rate, seed, limit_mev_per_s=slow)


@given(rates, limits, seeds)
def test_it_is_the_buffered_periods_and_the_delay_and_less_than_one_by_chance(
    rate: float, limit: float, seed: int
) -> None:
    least = 2 + rate / limit
    assert least - 1 < lost(rate, seed, limit_mev_per_s=limit) < least + 1


def test_without_events_only_the_hits_are_waited_for() -> None:
    """SORT as published reports a track when it is found for the third time (min_hits is 3): two periods are lost."""
    assert {lost(0.0, seed) for seed in range(20)} == {2}
    assert {lost(0.0, seed, hits=1) for seed in range(20)} == {0}


def test_chance_loses_on_average_what_the_delay_is() -> None:
    found = np.array([lost(30.0, seed, limit_mev_per_s=20.0) for seed in range(4000)])
    half_width = 4 * found.std() / np.sqrt(found.size)
    assert abs(found.mean() - (2 + 1.5)) < half_width


def test_at_the_limit_a_period_takes_a_period() -> None:
    assert delay_periods(7.0, 7.0) == 1.0
    assert delay_ms(7.0, 7.0) == paper.DELTA_T_WHOLE_US / 1e3


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_limit_that_is_none_is_refused(limit: float) -> None:
    with pytest.raises(ValueError, match=r"limit_mev_per_s=.* choose more than 0"):
        lost(1.0, 0, limit_mev_per_s=limit)
