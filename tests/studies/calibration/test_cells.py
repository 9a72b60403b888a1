"""The cells of Fig. 8: the misfit of each claim, and what a candidate's constants do to its accuracy."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bicode_lab import paper
from bicode_studies.calibration.candidates import (
    Candidate,
)
from bicode_studies.calibration.cells import CELLS, NEAR_PX, Cell, cell_accuracy, misfit
from bicode_studies.calibration.search import FIRST_SEED
from bicode_studies.paper_experiments.grids import conditions, seeds

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
