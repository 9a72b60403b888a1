"""The points to draw are those of the paper's claims, and each lies where its claim says."""

import pandas as pd
import pytest

from bicode_lab import paper
from bicode_studies.claims.in_notebooks import stated_points
from bicode_studies.claims.table import read_claims


@pytest.fixture(scope="module")
def claims() -> pd.DataFrame:
    return read_claims()


def point(claims: pd.DataFrame, figure: str, by: str, levels, name: str) -> pd.DataFrame:
    points = stated_points(claims, figure, by, levels)
    return points[points["id"] == name]


@pytest.mark.parametrize(
    ("figure", "by", "levels", "name", "expected"),
    [
        ("08", "current_ma", paper.FIG_8_CURRENTS_MA, "F8.1", [("2d", 10.7, 2.5, 0.5, 2.5, "==", 1.0)]),
        ("08", "current_ma", paper.FIG_8_CURRENTS_MA, "F8.4", [("blinker", 21.3, 30, 30, 30, ">=", 0.5)]),
        ("09", "yaw_deg", paper.FIG_9_YAWS_DEG, "F9.1",
         [("2d", 0, 2.5, 0.5, 2.5, ">", 0.9), ("2d", 40, 2.5, 0.5, 2.5, ">", 0.9)]),
        ("10", "size_m", paper.FIG_10_SIZES_M, "F10.6", [("2d", 0.025, 1, 1, 1, ">=", 0.5)]),
        ("12", "speed_m_per_s", paper.FIG_12_SPEEDS_M_PER_S, "F12.4", [("blinker", 0.314, 20, 20, 20, ">", 0.9)]),
        ("14", "rpm", paper.FIG_14_SPEEDS_RPM, "F14.1",
         [("2d", rpm, 1, 0.5, 1, "==", 1.0) for rpm in paper.FIG_14_SPEEDS_RPM]),
    ],
)  # fmt: skip
def test_a_claim_is_where_it_says(claims, figure, by, levels, name, expected):
    rows = point(claims, figure, by, levels, name).drop(columns="id").itertuples(index=False)
    assert [tuple(row) for row in rows] == expected


def test_beyond_and_any_distance_are_spans_with_the_mark_inside(claims):
    beyond = point(claims, "08", "current_ma", paper.FIG_8_CURRENTS_MA, "F8.2").iloc[0]
    anywhere = point(claims, "09", "yaw_deg", paper.FIG_9_YAWS_DEG, "F9.2").iloc[0]
    assert (beyond.from_m, beyond.to_m, anywhere.from_m, anywhere.to_m) == (5, 50, 0.5, 35)
    assert beyond.from_m < beyond.at_m < beyond.to_m
    assert anywhere.yaw_deg == 80


def test_a_range_of_levels_is_about_those_within(claims):
    noon = point(claims, "11", "illuminance_lux", [350, 2000, 20_000], "F11.4")
    assert set(noon["illuminance_lux"]) == {20_000}
    assert set(noon["kind"]) == {"blinker", "2d"}


def test_no_number_about_accuracy_or_range_of_a_figure_is_left_out(claims):
    about = claims["quantity"].str.match(r"^(acc_ID|acc_2D|max_dist)") & (claims["kind"] == "number")
    for figure, by, levels in (("08", "current_ma", paper.FIG_8_CURRENTS_MA), ("10", "size_m", paper.FIG_10_SIZES_M)):
        mine = claims[about & claims["id"].str.startswith(f"F{int(figure)}.")]["id"]
        assert set(stated_points(claims, figure, by, levels)["id"]) == set(mine)


def test_an_unknown_column_is_refused_with_those_there_are(claims):
    with pytest.raises(ValueError, match="by='colour' is stated by no claim; choose one of current_ma"):
        stated_points(claims, "08", "colour", [1])
