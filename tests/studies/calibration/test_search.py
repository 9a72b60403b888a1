"""The fit to Fig. 8: how candidates are drawn, what a candidate changes, the misfit, and the order of the search."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bicode_lab import paper
from bicode_lab.constants import all_constants, constant
from bicode_studies.calibration import search as calibration
from bicode_studies.calibration.candidates import (
    NAMES,
    Candidate,
    candidate_in_use,
    candidate_scene,
    draw_candidates,
    draw_neighbours,
)
from bicode_studies.calibration.cells import CELLS, NEAR_PX, Cell, cell_accuracy, cell_name, misfit
from bicode_studies.calibration.search import FIRST_SEED, calibrate, try_candidate
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.grids import conditions, seeds
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.sweep.sweep import Sweep

WORSE = [  # a cell, what would be wrong of it, and the claims that must notice
    (("2D", 10.7, 1.0), 0.9, {"F8.1"}),
    (("2D", 10.7, 2.5), 0.8, {"F8.1", "A2"}),
    (("2D", 10.7, 5.0), 0.3, {"F8.6", "A2"}),
    (("2D", 10.7, 7.5), 0.2, {"F8.2"}),
    (("2D", 21.3, 2.5), 1.0, {"F8.6"}),
    (("2D", 5.5, 2.5), 0.4, {"F8.6"}),
    (("ID", 5.5, 20.0), 0.5, {"F8.5"}),
    (("ID", 10.7, 20.0), 0.5, {"F8.3"}),
    (("ID", 10.7, 25.0), 0.4, {"F8.3"}),
    (("ID", 21.3, 30.0), 0.6, {"F8.4"}),
    (("ID", 21.3, 35.0), 1.0, {"F8.4"}),
]
PLAIN = Candidate(
    led_to_ambient=0.8, blur_px=0.9, halo_fraction=0.03, time_constant_us=150.0, aruco_id=17, min_region_pixels=3
)


def test_candidates_are_drawn_from_the_ranges_of_the_file() -> None:
    drawn = draw_candidates(400, np.random.default_rng(0))
    assert drawn == draw_candidates(400, np.random.default_rng(0))
    for name in NAMES:
        low, high = all_constants()[name].low, all_constants()[name].high
        values = np.array([getattr(one, name) for one in drawn], float)
        assert low <= values.min()
        assert values.max() <= high
        # of 400 even draws the least and the most miss a tenth of the range with a chance of 0.9^400
        assert values.min() < low + 0.1 * (high - low)
        assert values.max() > high - 0.1 * (high - low)
    least = np.bincount([one.min_region_pixels for one in drawn])[3:21]
    assert np.abs(least - 400 / 18).max() < 5 * np.sqrt(400 / 18)


def test_neighbours_keep_the_pattern_and_stay_in_the_ranges() -> None:
    edge = replace(PLAIN, blur_px=all_constants()["blur_px"].high)
    near = draw_neighbours(edge, 200, np.random.default_rng(1))
    assert {(one.aruco_id, one.min_region_pixels) for one in near} == {(PLAIN.aruco_id, PLAIN.min_region_pixels)}
    assert max(one.blur_px for one in near) == edge.blur_px
    low, high = all_constants()["time_constant_us"].low, all_constants()["time_constant_us"].high
    moved = (np.array([one.time_constant_us for one in near]) - PLAIN.time_constant_us) / (high - low)
    assert abs(moved.mean()) < 4 * 0.1 / np.sqrt(200)
    assert moved.std() == pytest.approx(0.1, rel=4 / np.sqrt(400))


def test_the_file_is_the_candidate_in_use() -> None:
    assert vars(candidate_in_use()) == {name: constant(name) for name in vars(candidate_in_use())}
    scene = scene_of(Condition(figure="08", distance_m=2.5), seed=3)
    same = candidate_scene(scene, candidate_in_use(), (scene.optics.width, scene.optics.height))
    assert same.light == scene.light
    assert same.optics == scene.optics
    assert same.pixel_model == scene.pixel_model
    assert same.markers[0].marker == scene.markers[0].marker


def test_a_candidates_scene_has_its_values_and_nothing_else_is_changed() -> None:
    scene = scene_of(Condition(figure="08", distance_m=5.0, current_ma=21.3), seed=0)
    candidate = Candidate(
        led_to_ambient=1.23, blur_px=0.77, halo_fraction=0.044, time_constant_us=111.0, aruco_id=5, min_region_pixels=12
    )  # fmt: skip
    changed = candidate_scene(scene, candidate, (96, 72))
    assert changed.light.led_to_ambient == 1.23
    assert (changed.optics.blur_px, changed.optics.halo_fraction) == (0.77, 0.044)
    assert changed.pixel_model.time_constant_us == 111.0
    assert changed.markers[0].marker.board.aruco_id == 5
    assert (changed.optics.width, changed.optics.height) == (96, 72)
    before, after = scene.markers[0], changed.markers[0]
    assert after.path == before.path
    assert (after.marker.payload, after.marker.phase_us) == (before.marker.payload, before.marker.phase_us)
    assert after.marker.current_ma == 21.3
    back = candidate_scene(changed, candidate_in_use(), (scene.optics.width, scene.optics.height))
    assert back.light == scene.light
    assert back.optics == scene.optics
    assert back.pixel_model == scene.pixel_model


def test_what_fig_8_asks_for_lacks_nothing() -> None:
    assert misfit(CELLS) == dict.fromkeys(misfit(CELLS), 0.0)
    assert misfit({}) == misfit(CELLS)


@pytest.mark.parametrize(("cell", "accuracy", "claims"), WORSE)
def test_a_cell_that_is_off_is_noticed_by_its_claims_and_no_other(
    cell: Cell, accuracy: float, claims: set[str]
) -> None:
    lacks = misfit({cell: accuracy})
    assert {name for name, value in lacks.items() if value > 1e-9} - {"sum"} == claims
    assert lacks["sum"] == pytest.approx(sum(lacks[name] for name in claims))


def test_only_conditions_of_fig_8_are_tried_with_seeds_that_no_figure_uses() -> None:
    grid = {(condition.current_ma, condition.distance_m) for condition in conditions("08")}
    assert {(current_ma, distance_m) for _, current_ma, distance_m in CELLS} <= grid
    assert {current_ma for _, current_ma, _ in CELLS} == set(paper.FIG_8_CURRENTS_MA)
    assert NEAR_PX[0] == 1280  # ArUco's least size is a share of the larger side
    assert all(max(seeds(one)) < FIRST_SEED for figure in ("08", "09", "12", "14") for one in conditions(figure))


def test_without_light_no_id_is_right_and_with_much_of_it_all_are() -> None:
    far = ("ID", 10.7, 20.0)
    assert cell_accuracy(replace(PLAIN, led_to_ambient=0.001), far, range(1)) == 0
    assert cell_accuracy(replace(PLAIN, led_to_ambient=3.0, blur_px=0.6), far, range(1)) == 1


def test_a_least_region_that_is_larger_reads_less_far() -> None:
    far = ("ID", 10.7, 20.0)
    bright = replace(PLAIN, led_to_ambient=1.6)
    assert cell_accuracy(bright, far, range(1)) == 1
    assert cell_accuracy(replace(bright, min_region_pixels=200), far, range(1)) == 0


def test_a_candidate_that_lacks_too_much_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[Cell] = []

    def reads(_: Candidate, cell: Cell, seeds: range) -> float:
        tried.append(cell)
        assert seeds == range(FIRST_SEED + 2 * len(seeds), FIRST_SEED + 3 * len(seeds))
        assert len(seeds) == calibration.SEEDS[cell[0]]
        return CELLS[cell] if cell[0] == "ID" else 0.0

    monkeypatch.setattr(calibration, "cell_accuracy", reads)
    (row,) = try_candidate(PLAIN, 2)
    last = ("2D", 10.7, 2.5)
    assert tried[-1] == last
    assert tried == list(CELLS)[: len(tried)]
    assert row["ID 10.7 mA 20 m"] == 1.0
    assert row[cell_name(last)] == 0.0
    assert "2D 10.7 mA 5 m" not in row


def test_the_search_goes_on_from_the_best_and_judges_them_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[tuple[Candidate, int]] = []

    def run(_: object, trials: list[tuple[Candidate, int]], *__: object, **___: object) -> Sweep:
        asked.extend(trials)
        rows: list[dict[str, Any]] = []
        for candidate, block in trials:
            plate = max(0.0, 1 - abs(candidate.blur_px - 1.0)) * (1.0 if block == 0 else 0.9)
            cells = {**{cell_name(cell): accuracy for cell, accuracy in CELLS.items()}, "2D 10.7 mA 2.5 m": plate}
            rows.append({**vars(candidate), **cells})
        return Sweep(table=pd.DataFrame(rows))

    monkeypatch.setattr(calibration, "sweep", run)
    table = calibrate(tmp_path / "none.sqlite", jobs=1, draws=30)
    n = 30 + len(calibration.EARLIER)
    near, best = calibration.ROUNDS * calibration.BEST * calibration.NEIGHBOURS, calibration.LAST
    assert [block for _, block in asked] == [0] * (n + near) + list(calibration.AGAIN) * best
    assert len(table) == n + near
    assert list(table["blocks"][: best + 1]) == [4] * best + [1]
    first = table[table["blocks"] == 4]
    assert first["sum"].is_monotonic_increasing
    assert abs(first["blur_px"].iloc[0] - 1.0) == (table["blur_px"] - 1.0).abs().min()
    assert first["2D 10.7 mA 2.5 m"].max() <= 0.9  # of the last round alone
