"""Losses beside rates of events, and late boxes: laws that hold for all constants of the camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bicode_lab.boxes import Box
from bicode_lab.camera import record
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.grids import conditions
from bicode_studies.paper_experiments.motion_loss import (
    at_distances,
    box_of,
    expected_overlap,
    ids_in_box,
    lag_table,
    rate_and_loss,
)
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.trial import PERIOD_S

STILL = Condition(figure="08", distance_m=2.5)


def trials(shares: dict[tuple[str, float], float], rate: float) -> pd.DataFrame:
    rows = [
        {"receiver": receiver, "frame_rule_2d": "any", "rpm": rpm, "distance_m": 1.0, "seed": seed, "periods": 10,
         "id_right": round(10 * share), "marker_2d_right": 0, "mev_per_s": rate}
        for (receiver, rpm), share in shares.items()
        for seed in range(3)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def test_losses_are_what_accuracy_leaves_and_stand_beside_their_rates() -> None:
    still = trials({("ours", 0.0): 1.0, ("authors", 0.0): 1.0}, rate=7.0)
    spin = trials({("ours", 16.0): 1.0, ("authors", 16.0): 0.9, ("authors", 64.0): 0.6, ("ours", 64.0): 1.0}, rate=8.0)
    rates = rate_and_loss({"still": still, "spin": spin}, {"still": "", "spin": "rpm"})
    lost = at_distances(rates, "lost").loc[1.0]
    assert lost.round(6).to_dict() == {
        "still, ours": 0.0, "still, authors": 0.0, "spin 16, ours": 0.0, "spin 16, authors": 0.1,
        "spin 64, authors": 0.4, "spin 64, ours": 0.0,
    }  # fmt: skip
    assert at_distances(rates, "mev_per_s").loc[1.0].to_dict() == {"still": 7.0, "spin 16": 8.0, "spin 64": 8.0}
    assert (rates["low"] <= rates["lost"] + 1e-9).all()
    assert (rates["lost"] <= rates["high"] + 1e-9).all()


@pytest.mark.parametrize("lag", [0, 1, 2, 4, 8])
@pytest.mark.parametrize("distance_m", [2.5, 10.0])
def test_the_overlap_of_a_panned_box_is_the_same_at_every_distance(lag: int, distance_m: float) -> None:
    pan = next(c for c in conditions("12") if c.distance_m == distance_m and c.speed_m_per_s == 0.314)
    settings, scene = receiver_settings(pan), scene_of(pan, 5)
    late = box_of(scene, -lag * settings.delta_t_whole_us, settings)
    rounding = 4 / (0.05 * 1646 / distance_m)  # boxes are whole pixels
    now = box_of(scene, 0, settings)
    assert now.shared_area(late) / now.area == pytest.approx(expected_overlap(0.314, lag), abs=rounding)


def test_a_spinning_marker_stays_in_its_box() -> None:
    spin = next(c for c in conditions("14") if c.distance_m == 1.0 and c.rpm == 64)
    settings, scene = receiver_settings(spin), scene_of(spin, 0)
    now = box_of(scene, 0, settings)
    late = [box_of(scene, -lag * settings.delta_t_whole_us, settings) for lag in range(20)]
    shares = [now.shared_area(box) / now.area for box in late]
    assert min(shares) > 0.45  # an upright box around a turned square is at most twice as large


def test_an_id_is_read_in_the_marker_s_box_and_none_beside_it_or_off_the_sensor() -> None:
    settings, scene = receiver_settings(STILL), scene_of(STILL, 1)
    events = record(scene, PERIOD_S, np.random.default_rng(0))
    x, y, w, h = box_of(scene, 0, settings)
    assert ids_in_box(events, Box(x, y, w, h), 0, settings) == {scene.markers[0].marker.payload}
    assert ids_in_box(events, Box(x + 200, y, w, h), 0, settings) == set()
    assert ids_in_box(events, Box(-50, y, 40, h), 0, settings) == set()


def test_a_box_that_is_late_by_nothing_reads_all_and_one_that_misses_reads_none() -> None:
    pan = next(c for c in conditions("12") if c.distance_m == 10.0 and c.speed_m_per_s == 0.314)
    late = lag_table([replace(pan, duration_s=1.0)], [0, 40], seeds=1, periods=2)
    assert late["lag"].tolist() == [0, 40]
    assert late["id_right"].tolist() == [2, 0]
    assert late["overlap"].tolist() == [1.0, 0.0]
