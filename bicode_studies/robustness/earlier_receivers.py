"""Trials of the receivers that were there before the sequential one.

They are kept apart from those of `sequential_trials`, so that a change of the sequential receiver does not make them
run again. The recordings of a condition and seed are the same in both.
"""

from __future__ import annotations

from typing import Any

from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.paper_experiments.scenes import WINDOW_RECEIVER
from bicode_studies.robustness.link_conditions import LinkCondition
from bicode_studies.robustness.link_scenes import settings_of
from bicode_studies.robustness.link_trials import link_rows, range_rows
from bicode_studies.robustness.stressors import StressCondition


def read_link_by_earlier(condition: LinkCondition, seed: int) -> list[dict[str, Any]]:
    """Read a link with the paper's receiver and with the soft one, see `link_trials.link_rows`."""
    settings = settings_of(condition)
    return link_rows(condition, seed, {"paper": settings, "soft": SoftSettings(receiver=settings)})


def read_distance_by_earlier(condition: StressCondition, seed: int) -> list[dict[str, Any]]:
    """Read the paper's marker at a distance with the paper's receiver, see `link_trials.range_rows`."""
    return range_rows(condition, seed, {"paper": WINDOW_RECEIVER})
