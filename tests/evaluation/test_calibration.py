"""The fit to Fig. 8: what a candidate changes, what a misfit is, and that the file's constants are the ones tried."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab import paper
from bicode_lab.constants import constant
from bicode_lab.evaluation import calibration
from bicode_lab.evaluation.calibration import (
    ID_CELLS,
    LOW_MA,
    NEAR_PX,
    PLATE_CELLS,
    STANDARD_MA,
    Candidate,
    calibrate,
    candidate_scene,
    candidates,
    cell_accuracy,
    in_the_file,
    misfit,
)
from bicode_lab.evaluation.setups import Condition, scene_of

PERFECT = {
    **{f"2D {ma:g} mA {d:g} m": 1.0 for ma, d in PLATE_CELLS if d <= 2.5},
    **{f"2D {ma:g} mA {d:g} m": 0.0 for ma, d in PLATE_CELLS if d > 2.5},
    "2D 5.5 mA 5 m": 0.4,  # ranges of about 4.6, 3.8 and 1.8 m
    "2D 21.3 mA 2.5 m": 0.0,
    **{f"ID {ma:g} mA {d:g} m": float((ma, d) in {(10.7, 20.0), (21.3, 30.0)}) for ma, d in ID_CELLS},
}
WORSE = [  # a cell, what would be wrong of it, and the claims that must notice
    ("2D 10.7 mA 1 m", 0.9, {"F8.1"}),
    ("2D 10.7 mA 2.5 m", 0.6, {"F8.1", "A2"}),
    ("2D 10.7 mA 5 m", 0.6, {"F8.6", "A2"}),
    ("2D 10.7 mA 7.5 m", 0.2, {"F8.2"}),
    ("2D 21.3 mA 2.5 m", 1.0, {"F8.6"}),
    ("ID 5.5 mA 15 m", 0.5, {"F8.5"}),
    ("ID 10.7 mA 20 m", 0.5, {"F8.3"}),
    ("ID 10.7 mA 25 m", 0.4, {"F8.3"}),
    ("ID 21.3 mA 30 m", 0.6, {"F8.4"}),
    ("ID 21.3 mA 35 m", 1.0, {"F8.4"}),
]


def test_candidates_are_every_combination() -> None:
    found = list(candidates((0.5, 1.0), (0.9,), (100.0, 150.0), (17, 34)))
    assert len(found) == len(set(found)) == 8
    assert found[0] == Candidate(led_to_ambient=0.5, blur_px=0.9, time_constant_us=100.0, aruco_id=17)


def test_the_file_is_the_candidate_in_use() -> None:
    assert vars(in_the_file()) == {name: constant(name) for name in vars(in_the_file())}
    scene = scene_of(Condition(figure="08", distance_m=2.5), seed=3)
    same = candidate_scene(scene, in_the_file(), (scene.optics.width, scene.optics.height))
    assert same.light == scene.light
    assert same.optics == scene.optics
    assert same.pixel_model == scene.pixel_model
    assert same.markers[0].marker == scene.markers[0].marker


def test_a_candidates_scene_has_its_values_and_nothing_else_is_changed() -> None:
    scene = scene_of(Condition(figure="08", distance_m=5.0, current_ma=21.3), seed=0)
    candidate = Candidate(led_to_ambient=1.23, blur_px=0.77, time_constant_us=111.0, aruco_id=5)
    changed = candidate_scene(scene, candidate, (96, 72))
    assert changed.light.led_to_ambient == 1.23
    assert changed.optics.blur_px == 0.77
    assert changed.pixel_model.time_constant_us == 111.0
    assert changed.markers[0].marker.board.aruco_id == 5
    assert (changed.optics.width, changed.optics.height) == (96, 72)
    before, after = scene.markers[0], changed.markers[0]
    assert after.path == before.path
    assert (after.marker.payload, after.marker.phase_us) == (before.marker.payload, before.marker.phase_us)
    assert after.marker.current_ma == 21.3
    assert changed.optics.focal_px == scene.optics.focal_px
    back = candidate_scene(changed, in_the_file(), (scene.optics.width, scene.optics.height))
    assert back.light == scene.light
    assert back.optics == scene.optics


def test_what_fig_8_asks_for_lacks_nothing() -> None:
    assert misfit(PERFECT) == dict.fromkeys(misfit(PERFECT), 0.0)


@pytest.mark.parametrize(("cell", "accuracy", "claims"), WORSE)
def test_a_cell_that_is_off_is_noticed_by_its_claims_and_no_other(cell: str, accuracy: float, claims: set[str]) -> None:
    lacks = misfit({**PERFECT, cell: accuracy})
    assert {name for name, value in lacks.items() if value > 1e-9} - {"sum"} == claims
    assert lacks["sum"] == pytest.approx(sum(lacks[name] for name in claims))


@pytest.mark.parametrize("cell", sorted(PERFECT))
def test_a_misfit_is_never_negative_and_asks_for_cells_of_fig_8_only(cell: str) -> None:
    for accuracy in np.linspace(0, 1, 6):
        assert all(lacks >= 0 for lacks in misfit({**PERFECT, cell: float(accuracy)}).values())
    missing = {name: value for name, value in PERFECT.items() if name != cell}
    with pytest.raises(KeyError, match=cell):
        misfit(missing)


def test_only_conditions_of_fig_8_are_tried() -> None:
    assert {ma for ma, _ in (*PLATE_CELLS, *ID_CELLS)} == set(paper.FIG_8_CURRENTS_MA)
    assert {(ma, d) for ma, d in ID_CELLS if ma == LOW_MA} == {(LOW_MA, 15.0)}
    assert NEAR_PX[0] == 1280  # ArUco's least size is a share of the larger side


def test_without_light_no_cell_is_right_and_with_much_of_it_the_id_is() -> None:
    dark = Candidate(led_to_ambient=0.001, blur_px=0.9, time_constant_us=150.0, aruco_id=17)
    bright = Candidate(led_to_ambient=1.5, blur_px=0.6, time_constant_us=100.0, aruco_id=17)
    assert cell_accuracy(dark, STANDARD_MA, 20.0, plate=False, seeds=1) == 0
    assert cell_accuracy(bright, STANDARD_MA, 15.0, plate=False, seeds=1) == 1


def test_the_best_candidate_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    def cells(candidate: Candidate, seeds: int) -> dict[str, float]:
        return {**PERFECT, "ID 10.7 mA 20 m": candidate.led_to_ambient}

    monkeypatch.setattr(calibration, "fig_8_cells", cells)
    found = calibrate(candidates((0.2, 0.6, 0.4), (0.9,), (150.0,), (17,)), jobs=1, seeds=1)
    assert list(found["led_to_ambient"]) == [0.6, 0.4, 0.2]
    assert found["sum"].is_monotonic_increasing
    assert {"F8.1", "F8.6", "A2", "ID 10.7 mA 20 m"} <= set(found)
