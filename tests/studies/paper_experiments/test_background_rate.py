"""The background's rate, of a pan and of a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_studies.paper_experiments.background_rate import rates_mev_per_s, recording_rates, wall_rates
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.grids import PERIODS, conditions


def test_rates_of_even_events_are_their_rate_however_they_are_cut() -> None:
    times = np.arange(0, 100_001, 10)
    zeros = np.zeros(times.size, int)
    events = make_events(zeros, zeros, zeros, times)
    whole, pieces = rates_mev_per_s([events]), rates_mev_per_s([events[:1234], events[1234:]])
    assert np.allclose(whole, 0.1)
    assert np.array_equal(whole, pieces)
    assert rates_mev_per_s([]).size == 0


def test_a_faster_pan_makes_more_events() -> None:
    slow, fast = (
        next(c for c in conditions("12") if c.distance_m == 10.0 and c.speed_m_per_s == speed)
        for speed in (0.105, 0.314)
    )
    assert wall_rates(fast, seeds=1, periods=2).mean() > wall_rates(slow, seeds=1, periods=2).mean()


def test_what_does_not_pan_is_refused() -> None:
    with pytest.raises(ValueError, match=r"speed_m_per_s=0 .* choose more than 0"):
        wall_rates(Condition(figure="12", distance_m=2.5), seeds=1, periods=1)


def test_a_recording_that_is_not_there_has_no_rate(tmp_path: Path) -> None:
    assert recording_rates(tmp_path / "none.raw") is None


def test_the_real_scene_has_its_known_mean(real_recordings: Path) -> None:
    rates = recording_rates(real_recordings / "evk4_scene_evt3.raw")
    assert rates is not None
    assert rates.mean() == pytest.approx(1_218_618 / (21_968_221 - 11_200_224), rel=0.01)


def test_the_wall_is_as_busy_as_the_real_scene_over_a_trial(real_recordings: Path) -> None:
    rates = recording_rates(real_recordings / "evk4_scene_evt3.raw")
    assert rates is not None
    pan = next(c for c in conditions("12") if c.distance_m == 2.5 and c.speed_m_per_s == 0.314)
    wall = wall_rates(pan, seeds=4, periods=PERIODS)
    # a step of the contrast's last digit is 10 %, seeds scatter by 0.014 Mev/s
    assert wall.mean() == pytest.approx(rates.mean(), abs=0.1 * rates.mean() + 3 * 0.014 / np.sqrt(4))
