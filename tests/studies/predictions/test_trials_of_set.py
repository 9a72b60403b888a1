"""Trials with another set of constants: its scene and receiver, and rows in the form of the figures' tables."""

from __future__ import annotations

from dataclasses import asdict, replace

import pandas as pd
import pytest

from bicode_lab.constants import constant
from bicode_studies.calibration.candidates import NAMES, candidate_in_use, other_constants
from bicode_studies.paper_experiments import grids
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.paper_experiments.trial_rows import run_trial
from bicode_studies.predictions import trials_of_set
from bicode_studies.predictions.trials_of_set import (
    FIGURES,
    PAN_M,
    FigureOfSet,
    conditions_of,
    run_figure_of_set,
    scene_and_receiver,
    seeds_of,
)
from bicode_studies.trial import PERIOD_S

OTHER = replace(candidate_in_use(), led_to_ambient=0.9, aruco_id=5, min_region_pixels=9, opening_px=4)


@pytest.mark.parametrize("figure", grids.FIGURES)
def test_conditions_are_those_of_the_figure_and_shorter(figure: str) -> None:
    found = conditions_of(figure)
    whole = [replace(each, duration_s=0.0) for each in grids.conditions(figure)]
    wanted = [each for each in whole if not each.speed_m_per_s or each.distance_m in PAN_M]
    assert [replace(each, duration_s=0.0) for each in found] == wanted
    periods = {(each.distance_m >= 1) + (each.distance_m >= 10): round(each.duration_s / PERIOD_S) for each in found}
    assert set(periods.items()) <= {(0, 3), (1, 5), (2, 10)}


def test_pans_have_one_seed() -> None:
    assert {figure: len(seeds_of(figure)) for figure in FIGURES if len(seeds_of(figure)) != 2} == {"12": 1}


@pytest.mark.parametrize(
    ("condition", "size_px", "finds_2d"),
    [
        (Condition(figure="08", distance_m=2.5), (1280, 125), True),
        (Condition(figure="08", distance_m=0.5, size_m=0.3), (1280, 720), True),
        (Condition(figure="08", distance_m=20.0), (96, 72), False),
        (Condition(figure="12", distance_m=20.0, speed_m_per_s=0.1), (1280, 79), False),
    ],
)
def test_the_sensor_is_as_small_as_it_may_be(condition: Condition, size_px: tuple[int, int], finds_2d: bool) -> None:
    scene, settings = scene_and_receiver(condition, 0, OTHER)
    assert (scene.optics.width, scene.optics.height) == size_px == (settings.width, settings.height)
    assert settings.detect_2d == finds_2d
    assert (settings.min_region_pixels, settings.opening_px) == (9, 4)
    assert (scene.light.led_to_ambient, scene.markers[0].marker.board.aruco_id) == (0.9, 5)
    same, usual = scene_and_receiver(condition, 0, candidate_in_use())
    whole = scene_of(condition, 0)
    assert (same.light, same.pixel_model) == (whole.light, whole.pixel_model)
    assert same.markers[0].marker == whole.markers[0].marker
    assert replace(same.optics, width=1280, height=720) == whole.optics
    assert replace(usual, width=1280, height=720, detect_2d=True) == receiver_settings(condition)


def test_a_figure_has_the_columns_and_conditions_of_its_table(monkeypatch: pytest.MonkeyPatch) -> None:
    two = [Condition(figure="08", distance_m=d, duration_s=2 * PERIOD_S) for d in (2.5, 20.0)]
    monkeypatch.setattr(trials_of_set, "conditions_of", lambda figure: two)
    wanted = FigureOfSet(figure="08", candidate=candidate_in_use(), others=other_constants(NAMES))
    rows = pd.DataFrame(run_figure_of_set(wanted, 1))
    usual = pd.DataFrame(run_trial(two[0], 1))
    assert list(rows.columns) == list(usual.columns)
    assert rows["distance_m"].tolist() == [2.5] * 3 + [20.0] * 3
    assert (rows["seed"] == 1).all()
    assert rows["id_right"].tolist()[:3] == usual["id_right"].tolist()
    blind = run_figure_of_set(replace(wanted, candidate=replace(candidate_in_use(), min_region_pixels=10_000)), 1)
    assert [row["id_right"] for row in blind][3:] == [0] * 3  # near, the 2D marker shows where the ID is
    assert rows["id_right"].tolist()[3:] == [2] * 3


def test_the_panels_of_fig_13_are_those_of_the_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials_of_set, "PANELS", ("b",))
    regions = []
    for bright in (0.001, 1.0):
        candidate = replace(candidate_in_use(), led_to_ambient=bright)
        (row,) = run_figure_of_set(FigureOfSet(figure="13", candidate=candidate, others=other_constants(NAMES)), 0)
        assert (row["panel"], row["figure"]) == ("b", "13")
        regions.append(row["region_px"])
    assert regions[0] < 20 < regions[1]


def test_trials_are_kept_under_the_other_constants() -> None:
    assert "aruco_id" not in other_constants(NAMES)
    assert f'"edge_glow": {constant("edge_glow")}' in other_constants(NAMES)
    wanted = FigureOfSet(figure="08", candidate=candidate_in_use(), others="{}")
    with pytest.raises(ValueError, match="has changed since the run"):
        run_figure_of_set(wanted, 0)
    assert set(asdict(wanted)) == {"figure", "candidate", "others"}
