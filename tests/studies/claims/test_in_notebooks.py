"""The end of the notebooks on section IV: constants, points and verdicts."""

from pathlib import Path

import pandas as pd
import pytest

from bicode_lab.constants import all_constants
from bicode_studies.claims.in_notebooks import NOT_ENOUGH, claims_of, fitted_for, points_of
from bicode_studies.claims.verdicts import VERDICTS

ROOT = Path(__file__).resolve().parents[3]


def trials(right: int) -> pd.DataFrame:
    """Return trials of a hundred seeds with 20 periods, `right` of them right, at two distances and three angles."""
    rows = [
        {"figure": "09", "distance_m": d, "yaw_deg": yaw, "seed": seed, "receiver": "ours", "frame_rule_2d": "any",
         "periods": 20, "id_right": right, "marker_2d_right": right}
        for d in (1.0, 2.5) for yaw in (0.0, 40.0, 80.0) for seed in range(100)
    ]  # fmt: skip
    return pd.DataFrame(rows)


@pytest.fixture
def no_trials(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Work in a repository that has the claims and no table of trials."""
    for name in ("notebooks", "bicode_lab", "data"):
        (tmp_path / name).mkdir()
    (tmp_path / "data" / "paper_claims.csv").write_bytes((ROOT / "data" / "paper_claims.csv").read_bytes())
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("no_trials")
def test_every_number_and_order_of_the_figure_is_judged():
    judged = claims_of("09", trials(20), quick=False)
    assert list(judged.index) == ["F9.1", "F9.2", "F9.3", "F9.4", "F9.5"]
    assert set(judged["verdict"].str.split(":").str[0]) <= set(VERDICTS)
    assert judged.loc["F9.3", "verdict"] == "depends on the reading: a: reproduced; b: contradicted"
    assert judged.loc["F9.3", "class"] == "calibrated on"
    assert judged.loc["F9.1", "verdict"] == "reproduced"
    assert judged.loc["F9.5", "verdict"] == "no trials yet"
    assert claims_of("09", trials(0), quick=False).loc["F9.1", "verdict"] == "contradicted"


@pytest.mark.usefixtures("no_trials")
@pytest.mark.parametrize("right", [0, 20])
def test_short_trials_get_no_verdict(right: int) -> None:
    verdicts = claims_of("09", trials(right), quick=True)["verdict"]
    assert set(verdicts) == {NOT_ENOUGH, "no trials yet"}
    assert verdicts["F9.1"] == NOT_ENOUGH


def test_what_was_fitted_is_told_and_only_its_own_figure_owns_it():
    fitted = fitted_for("09")
    assert set(fitted.index) == {each.name for each in all_constants().values() if each.fitted_to}
    own = fitted[fitted["of this figure"]]
    assert all(value.startswith("F9.") or value == "Fig. 9" for value in own["fitted to"])
    assert fitted_for("10")["of this figure"].sum() == 0


def test_points_may_be_of_one_band_only():
    lux = [350.0, 2000.0]
    assert set(points_of("11", "illuminance_lux", lux, "red")["id"]) == {"F11.0"}
    assert "F11.0" not in set(points_of("11", "illuminance_lux", lux, "infrared")["id"])
