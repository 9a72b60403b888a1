"""The constants that other claims determine: more glow reads farther, more background less far, a slow PC less."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bicode_lab import paper
from bicode_lab.constants import all_constants, constant
from bicode_studies.calibration import other_claims
from bicode_studies.calibration.cells import FIRST_SEED
from bicode_studies.calibration.other_claims import (
    accuracy_in_time,
    accuracy_over,
    conditions_of,
    fit_constant,
    turning_rate_mev_per_s,
    with_value,
)
from bicode_studies.paper_experiments.scenes import scene_of

NAMES = ("edge_glow", "infrared_share_office", "infrared_share_evening")


@pytest.mark.parametrize("name", NAMES)
def test_the_files_value_is_what_the_scene_has_already(name: str) -> None:
    for condition in conditions_of(name):
        scene = scene_of(condition, 0)
        same = with_value(scene, name, constant(name))
        assert (same.edge_glow, same.light) == (scene.edge_glow, scene.light)
        other = with_value(scene, name, 0.123)
        assert (other.edge_glow, other.light) != (scene.edge_glow, scene.light)
        assert other.pixel_model == scene.pixel_model


def test_each_is_read_where_its_claim_is() -> None:
    assert [(c.figure, c.yaw_deg, c.distance_m) for c in conditions_of("edge_glow")] == [("09", 80, 10), ("09", 80, 15)]
    places = [conditions_of(name)[0] for name in NAMES[1:]]
    assert [c.illuminance_lux for c in places] == [paper.OFFICE_LUX, paper.EVENING_LUX]
    assert {(c.figure, c.band, c.distance_m) for c in places} == {("11", "infrared", 20.0)}


@pytest.mark.parametrize(("name", "much", "little"), [("edge_glow", 4.0, 0.0), ("infrared_share_evening", 0.02, 50.0)])
def test_much_light_is_read_and_little_is_not(name: str, much: float, little: float) -> None:
    table = accuracy_over(name, (little, much), range(2))
    near = table[table["distance_m"] == table["distance_m"].min()].set_index("value")["accuracy"]
    assert near[little] < 0.5 < near[much]
    assert (table["low"] <= table["accuracy"]).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_constant_is_fitted_to_where_its_claim_s_accuracies_sum_to_what_is_wanted(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = 0.7 * all_constants()[name].high

    def read(_: str, values: list[float], seeds: range) -> pd.DataFrame:
        assert min(seeds) == FIRST_SEED
        more = np.sign(np.log(values[0] / right)) * (1 if name == "edge_glow" else -1)
        return pd.DataFrame({"accuracy": np.full(len(conditions_of(name)), 0.5 + 0.3 * more)})

    monkeypatch.setattr(other_claims, "accuracy_over", read)
    span = np.log(all_constants()[name].high / all_constants()[name].low)
    assert abs(np.log(fit_constant(name) / right)) < span / 2**other_claims.HALVINGS


def test_the_computer_is_as_fast_as_the_nearest_marker_asks_for() -> None:
    limit = fit_constant("processing_mev_per_s")
    rate = turning_rate_mev_per_s(0.5, 64.0, FIRST_SEED)
    assert accuracy_in_time(rate, limit, 64) == pytest.approx(other_claims.MORE_THAN_70, abs=0.002)
    with pytest.raises(ValueError, match="name='blur_px' is not fitted here"):
        fit_constant("blur_px")


def test_a_near_marker_makes_more_events_and_loses_more_periods() -> None:
    near, far = (turning_rate_mev_per_s(d, 64.0) for d in (0.5, 2.5))
    assert near > 3 * far > 0
    assert accuracy_in_time(near, 20.0, 64) < accuracy_in_time(far, 20.0, 64)
    assert accuracy_in_time(near, 20.0, 64) < accuracy_in_time(near, 20.0, 16) < 1
    assert accuracy_in_time(near, 1e9, 64) == pytest.approx(1 - 2 / (30 / 64 / 0.033))
    assert accuracy_in_time(1e6, 1.0, 64) == 0


def test_another_constant_is_refused() -> None:
    with pytest.raises(ValueError, match="name='blur_px' is not read here"):
        with_value(scene_of(conditions_of("edge_glow")[0], 0), "blur_px", 1.0)
