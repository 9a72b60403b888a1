"""The receiver of the figures: it has the opening and the least region of `constants.csv`; trials are read with it."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from bicode_lab.constants import constant
from bicode_lab.events import make_events
from bicode_lab.marker import LedWaveform
from bicode_lab.recognition import ReceiverSettings, find_regions
from bicode_studies.paper_experiments import trial_rows
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.trial import PERIOD_S

CONDITION = Condition(figure="09", distance_m=10.0, duration_s=2 * PERIOD_S)
OPENING_PX, LEAST_PIXELS = round(constant("opening_px")), round(constant("min_region_pixels"))
SIDE_PX = max(OPENING_PX, 1)  # of the smallest square that the opening leaves


def is_found(width_px: int, height_px: int) -> bool:
    """Return whether the receiver of the figures finds a rectangle that blinks."""
    y, x = np.divmod(np.arange(width_px * height_px), width_px)
    times_us, levels = LedWaveform(payload=0x25, phase_us=0).steps(0, 33_000)
    n, size = times_us.size - 1, x.size
    t_us = np.repeat(times_us[1:] + 40, size)
    events = make_events(np.tile(300 + x, n), np.tile(200 + y, n), np.repeat(levels[1:] > 0, size), t_us)
    return bool(find_regions(events[events["t"] < 33_000], 0, receiver_settings(CONDITION)))


def test_it_differs_from_the_package_s_receiver_in_opening_least_region_and_pattern_size_alone() -> None:
    own, figures = asdict(ReceiverSettings()), asdict(receiver_settings(replace(CONDITION, size_m=0.1)))
    changed = {name: value for name, value in figures.items() if value != own[name]}
    assert changed == {"opening_px": OPENING_PX, "min_region_pixels": LEAST_PIXELS, "pattern_size_m": 0.1}


def test_a_thin_line_is_opened_away() -> None:
    long = LEAST_PIXELS + SIDE_PX  # far more pixels than the least region has
    for width, height in ((SIDE_PX, long), (long, SIDE_PX)):
        assert is_found(width, height)
    for width, height in ((SIDE_PX - 1, long), (long, SIDE_PX - 1)):
        assert not is_found(width, height)


def test_a_region_has_the_least_number_of_pixels() -> None:
    """A block as wide as the opening grows row by row; it is found from the row on that makes it large enough."""
    rows = np.arange(SIDE_PX, 2 * LEAST_PIXELS)
    assert [is_found(SIDE_PX, int(n)) for n in rows] == (rows * SIDE_PX >= LEAST_PIXELS).tolist()


@pytest.mark.parametrize("changes", [{"min_region_pixels": 10_000}, {"opening_px": 12}])
def test_trials_are_read_with_it(monkeypatch: pytest.MonkeyPatch, changes: dict[str, int]) -> None:
    (row,) = trial_rows.run_trial(CONDITION, seed=0)
    assert row["id_right"] == row["periods"] == 2
    strict = replace(receiver_settings(CONDITION), **changes)  # type: ignore[arg-type]
    monkeypatch.setattr(trial_rows, "receiver_settings", lambda condition: strict)
    (row,) = trial_rows.run_trial(CONDITION, seed=0)
    assert row["id_right"] == 0
