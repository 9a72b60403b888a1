"""The null model: its laws against numbers worked out by hand, and its anchors."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd
import pytest

from bicode_studies.claims.beside_null import counts_by_class, judge_beside_null, summary_line
from bicode_studies.claims.null_model import (
    contrast,
    foreshortened,
    id_accuracy,
    lost_of_a_cell,
    null_tables,
    pose_accuracy,
    region_px,
    share_kept,
)
from bicode_studies.claims.table import read_claims
from bicode_studies.paper_experiments.conditions import Condition

STILL = Condition(figure="08", distance_m=2.5)
INFRARED = replace(STILL, band="infrared", current_ma=20.4)


@pytest.mark.parametrize(
    ("condition", "range_m"),
    [
        (STILL, 22.36),  # sqrt(20 * 25)
        (replace(STILL, current_ma=5.5), 16.03),  # 22.36 * sqrt(5.5 / 10.7)
        (replace(STILL, current_ma=21.3), 31.55),
        (replace(STILL, size_m=0.1, current_ma=40.9), 43.72),  # the light of four plates, nearly
        (replace(STILL, size_m=0.025, current_ma=2.7), 11.23),
        (replace(STILL, yaw_deg=80), 11.66),  # 22.36 * sqrt(0.1736 + 0.1 * 0.9848)
        (replace(STILL, yaw_deg=40), 20.39),
        (INFRARED, 20.0),
        (replace(INFRARED, illuminance_lux=2000), 20.0),
    ],
)
def test_the_range_of_an_id_goes_with_the_root_of_light_and_area(condition: Condition, range_m: float) -> None:
    assert id_accuracy(replace(condition, distance_m=0.5)) == 1
    assert id_accuracy(replace(condition, distance_m=0.998 * range_m)) == 1
    assert id_accuracy(replace(condition, distance_m=1.002 * range_m)) == 0


def test_half_is_read_at_the_very_end_of_the_infrared_range() -> None:
    assert id_accuracy(replace(INFRARED, distance_m=20)) == 0.5


def test_daylight_drowns_a_plate_however_near() -> None:
    """Near, the light of 10.7 mA is (22.36 / 12)^2 = 3.47 times what is needed; 2000 lx are 5.7 times the office."""
    for condition in (replace(STILL, illuminance_lux=2000), replace(INFRARED, illuminance_lux=1e4)):
        assert id_accuracy(replace(condition, distance_m=0.5)) == 0
        assert pose_accuracy(replace(condition, distance_m=0.5)) == 0
    assert id_accuracy(replace(STILL, illuminance_lux=350 * 3.4)) == 1
    assert id_accuracy(replace(STILL, illuminance_lux=350 * 3.5)) == 0


@pytest.mark.parametrize(
    ("condition", "lost"),
    [
        (replace(STILL, distance_m=4.33), 0.49999),  # sqrt(2.5 * 7.5) m
        (STILL, 0.28868),
        (replace(STILL, current_ma=21.4), 0.40825),  # times sqrt(2)
        (replace(STILL, size_m=0.1, current_ma=42.8, distance_m=5), 0.28868),
        (replace(STILL, yaw_deg=40), 0.37684),  # over cos 40
        (replace(STILL, distance_m=1, speed_m_per_s=0.314), 0.61285),  # 0.11547 + 4.1448 mm of 8.3333 mm
        (replace(STILL, rpm=64), 0.55408),  # 0.28868 + 0.088467 rad * 3 cells
    ],
)
def test_a_cell_is_lost_to_spread_and_motion(condition: Condition, lost: float) -> None:
    assert lost_of_a_cell(condition) == pytest.approx(lost, rel=1e-4)
    assert pose_accuracy(condition) == (lost < 0.5)


def test_a_plate_from_the_side_has_no_pose_at_any_distance() -> None:
    """Its side face is 4.9 mm wide then, and its face and side face together 13.6 mm, or 2.3 mm a cell."""
    for distance_m in (0.1, 0.5, 2.5):
        assert pose_accuracy(replace(STILL, yaw_deg=80, distance_m=distance_m)) == 0
    assert pose_accuracy(replace(STILL, yaw_deg=40)) == 1
    assert foreshortened(replace(STILL, yaw_deg=80)) == pytest.approx(0.2721, abs=1e-4)


@pytest.mark.parametrize(
    ("condition", "kept"),
    [
        (STILL, 1.0),
        (replace(STILL, rpm=64, distance_m=0.5), 1 - 4 / 14.2045),  # 30 / 64 s; 2 + 2 periods are lost
        (replace(STILL, rpm=16, distance_m=1), 1 - 2.5 / 56.8182),
        (replace(STILL, speed_m_per_s=0.314, distance_m=1), 1 - 2.5 / 75.045),  # 0.7776 m at 0.314 m/s
    ],
)
def test_the_first_periods_of_a_motion_are_lost(condition: Condition, kept: float) -> None:
    assert share_kept(condition) == pytest.approx(kept, rel=1e-4)


def test_the_region_is_the_plate_grown_by_the_spread_and_foreshortened() -> None:
    """At 2.5 m a side has 32.92 px, and 0.28868 of a cell of 5.487 px is added."""
    assert region_px(STILL) == pytest.approx((32.922 + 1.584) ** 2, rel=1e-3)
    assert region_px(replace(STILL, yaw_deg=80)) / region_px(STILL) == pytest.approx(0.2721, abs=1e-4)
    assert contrast(replace(STILL, current_ma=21.4)) == pytest.approx(2)
    assert region_px(replace(STILL, current_ma=21.4)) == pytest.approx((32.922 + 1.584 * math.sqrt(2)) ** 2, rel=1e-3)


@pytest.fixture(scope="module")
def judged() -> pd.DataFrame:
    """Return all claims without any trial of ours, beside the null model."""
    return judge_beside_null(read_claims(), {}).set_index("id", drop=False)


def test_the_null_model_keeps_its_anchors(judged: pd.DataFrame) -> None:
    for name in ("F8.1", "F8.2", "F8.3", "F8.4", "F8.5", "F9.3", "F11.0", "F11.2", "F14.5", "A2"):
        assert judged.loc[name, "null_verdict"] == "reproduced", name


def test_without_chance_it_reads_all_or_nothing(judged: pd.DataFrame) -> None:
    """So it cannot give the paper's halves of moving markers, whatever its constants are."""
    for name in ("F12.1", "F14.3"):
        assert judged.loc[name, "null_verdict"] == "contradicted", name
    assert judged.loc["F10.5", "null_model"] == "depends on the reading: a: reproduced; b: contradicted"
    assert judged.loc["F10.5", "null_ours"] == "a: 10 m; b: 10 m"


def test_it_is_asked_about_numbers_and_orders_only(judged: pd.DataFrame) -> None:
    measured = judged["kind"].isin(["number", "order"])
    assert (judged.loc[~measured, "null_verdict"] == "not asked").all()
    assert not judged.loc[measured, "null_verdict"].isin(["not asked", "no trials yet"]).any()
    assert null_tables().keys() == {"08", "09", "10", "11", "12", "13", "14"}


def test_the_headline_counts_each_class_by_itself_and_the_null_model_beside_ours() -> None:
    rows = [
        ("tests the model", "reproduced", "contradicted"),
        ("tests the model", "reproduced", "reproduced"),
        ("tests the model", "depends on the reading", "depends on the reading"),
        ("calibrated on", "reproduced", "reproduced"),
        ("used as input", "used as stated", "not asked"),
    ]
    judged = pd.DataFrame(rows, columns=["class", "verdict", "null_verdict"])
    counts = counts_by_class(judged)
    assert counts.loc[("tests the model", "ours")].to_dict() == {
        "reproduced": 2, "depends on the reading": 1, "contradicted": 0, "all": 3,
    }  # fmt: skip
    assert counts.loc[("tests the model", "null model"), "contradicted"] == 1
    assert counts.loc[("calibrated on", "ours"), "all"] == 1
    assert counts.loc[("follows from a fit", "ours"), "all"] == 0
    assert summary_line(judged) == (
        "Of the 3 statements of the paper that test the simulation, it reproduces 2 (1 more in one of two readings); "
        "a model without sensor and receiver reproduces 1 (1 more)."
    )
