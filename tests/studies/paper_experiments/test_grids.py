"""The grids are those of the paper."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

import pandas as pd
import pytest

from bicode_lab import paper
from bicode_studies.claims.figure_claims import NOON_LUX
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.grids import conditions, seeds
from bicode_studies.trial import PERIOD_S

GRID_M = [0.5, 1, 2.5, 5, 7.5, 10, 15, 20, 25, 30, 35, 40, 50]
CLAIMS = pd.read_csv(
    Path(__file__).resolve().parents[3] / "data" / "paper_claims.csv", dtype=str, keep_default_na=False, index_col="id"
)
FIGURES = ("08", "09", "10", "11", "12", "14")
VARIED = {
    "08": ("current_ma", set(paper.FIG_8_CURRENTS_MA)),
    "09": ("yaw_deg", set(paper.FIG_9_YAWS_DEG)),
    "10": ("size_m", set(paper.FIG_10_SIZES_M)),
    "12": ("speed_m_per_s", set(paper.FIG_12_SPEEDS_M_PER_S)),
    "14": ("rpm", set(paper.FIG_14_SPEEDS_RPM)),
}


@pytest.mark.parametrize("figure", FIGURES)
def test_distances_are_those_of_the_grid_within_the_figure_s_range(figure: str) -> None:
    stated = CLAIMS["value"].get(f"F{int(figure)}.0", "0.5..50") if figure != "11" else "0.5..50"
    least, most = map(float, stated.split(".."))
    expected = [at for at in GRID_M if least <= at <= most]
    grid = pd.DataFrame([asdict(c) for c in conditions(figure)])
    others = [name for name in grid if name not in ("distance_m", "duration_s")]
    assert len(grid) == len(expected) * len(grid[others].drop_duplicates())
    for _, cells in grid.groupby(others):
        assert cells["distance_m"].tolist() == expected


@pytest.mark.parametrize("figure", sorted(VARIED))
def test_what_is_varied_is_the_paper_s_and_all_else_is_as_in_iv_a(figure: str) -> None:
    name, values = VARIED[figure]
    grid = conditions(figure)
    assert {getattr(c, name) for c in grid} == values
    standard = asdict(Condition(figure=figure, distance_m=1.0))
    free = {name, "distance_m", "duration_s"} | ({"current_ma"} if figure == "10" else set())
    for condition in grid:
        assert {k: v for k, v in asdict(condition).items() if k not in free} == {
            k: v for k, v in standard.items() if k not in free
        }


def test_each_size_has_its_own_current() -> None:
    pairs = {(c.size_m, c.current_ma) for c in conditions("10")}
    assert pairs == set(zip(paper.FIG_10_SIZES_M, paper.FIG_10_CURRENTS_MA, strict=True))


def test_outdoors_is_red_in_the_evening_and_infrared_in_office_evening_and_noon() -> None:
    settings = {(c.band, c.current_ma, c.illuminance_lux) for c in conditions("11")}
    assert ("red", 10.7, paper.EVENING_LUX) in settings
    infrared = sorted(lux for band, current, lux in settings if band == "infrared" and current == 20.4)
    assert infrared[:2] == [paper.OFFICE_LUX, paper.EVENING_LUX]
    assert infrared[2:] == list(NOON_LUX)  # both ends of "tens of thousands"
    assert len(settings) == 5


@pytest.mark.parametrize("figure", FIGURES)
def test_a_condition_has_about_200_periods_from_at_least_ten_seeds(figure: str) -> None:
    for condition in conditions(figure):
        tried = seeds(condition)
        whole = int(condition.duration_s / PERIOD_S + 1e-6)  # that a recording of this length holds
        assert len(tried) >= 10
        assert len(set(tried)) == len(tried)
        if condition.rpm:  # half turns are as long as they are
            assert len(tried) * whole >= 190
        else:
            assert len(tried) * whole == 200


@pytest.mark.parametrize("figure", FIGURES)
def test_the_quick_grid_has_all_settings_of_the_full_one_at_some_of_its_distances(figure: str) -> None:
    quick, full = conditions(figure, quick=True), conditions(figure)

    def settings(grid: list[Condition]) -> set[Condition]:
        return {replace(c, distance_m=1.0, duration_s=1.0) for c in grid}

    assert settings(quick) == settings(full)
    assert {c.distance_m for c in quick} < {c.distance_m for c in full}
    assert all(len(seeds(c, quick=True)) < 10 for c in quick)


def test_a_figure_without_a_grid_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'13' has no grid; choose one of 08"):
        conditions("13")
