"""``bicode calibrate`` runs, prints and writes what the calibration gives; the trials take no time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from bicode_lab.constants import constant
from bicode_studies.calibration.candidates import NAMES, NOT_IN_FIG_8, candidate_in_use
from bicode_studies.calibration.distance import TERMS
from bicode_studies.cli import calibrate as command_calibrate
from bicode_studies.cli.main import main

Calibrate = Callable[..., tuple[object, str, str]]


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """Return the numbers of jobs that were asked for; a run has two generations, and its tables one row."""
    asked: list[int] = []
    row = {name: [value] for name, value in vars(candidate_in_use()).items()}

    def calibrate(trials: SimpleNamespace) -> Iterator[SimpleNamespace]:
        for generation in (0, 1):
            yield SimpleNamespace(
                generation=generation, tolerance=20.0 - generation, points=range(100), effective_size=71.2, tried=900
            )

    def trials(store: Path, count: int) -> SimpleNamespace:
        assert store == tmp_path / command_calibrate.STORE
        asked.append(count)
        return SimpleNamespace()

    table = pd.DataFrame({**row, "is_medoid": [1], "weight": [1.0], "latency_z": [-3.0]})
    monkeypatch.setattr(command_calibrate, "Trials", trials)
    monkeypatch.setattr(command_calibrate, "calibrate", calibrate)
    monkeypatch.setattr(command_calibrate, "posterior_table", lambda found, trials: table)
    monkeypatch.setattr(command_calibrate, "tried_table", lambda trials: pd.DataFrame({"number": [0, 1]}))
    monkeypatch.setattr(
        command_calibrate, "terms_in_use",
        lambda trials, times: pd.DataFrame([dict.fromkeys(("distance", *TERMS), 1.25)] * times),
    )  # fmt: skip
    monkeypatch.setattr(command_calibrate, "repository_root", lambda: tmp_path)
    return asked


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Calibrate:
    """Return a function that runs ``bicode calibrate`` with some words and returns (exit code, stdout, stderr)."""

    def calibrate(*words: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["calibrate", *words])
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return calibrate


def test_only_the_files_constants_are_judged_and_nothing_is_written(
    run: Calibrate, jobs: list[int], tmp_path: Path
) -> None:
    code, out, err = run("--only-current", "--jobs", "3")
    assert (code, err, jobs) == (0, "", [3])
    lines = out.splitlines()
    assert [line.split()[0] for line in lines[:2]] == ["distance", TERMS[0]]
    assert lines[0].split()[1:] == ["1.25"] * command_calibrate.TIMES
    assert not list(tmp_path.iterdir())


def test_a_run_tells_its_generations_and_writes_two_tables(run: Calibrate, jobs: list[int], tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    code, out, _ = run("--jobs", "1")
    assert code == 0
    assert (
        "generation 1: tolerance 19.0, 100 different sets (worth 71 of equal weight), 900 of at most 6000 tried" in out
    )
    assert f"blur_px {constant('blur_px'):g}" in out
    assert "-3.0 standard deviations" in out
    assert {*NAMES} < {*pd.read_csv(tmp_path / command_calibrate.TABLE).columns}
    assert len(pd.read_csv(tmp_path / "results" / "posterior_tried.csv")) == 2


def test_the_tables_go_where_they_are_asked_to(run: Calibrate, jobs: list[int], tmp_path: Path) -> None:
    assert run("--jobs", "1", "--out", str(tmp_path / "mine.csv"))[0] == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.csv", "mine_tried.csv"]


def test_what_fig_8_cannot_see_is_fitted_to_its_claims(run: Calibrate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_calibrate, "fit_constant", lambda name: float(len(name)))
    code, out, _ = run("--beyond")
    assert code == 0
    assert [line.split(":")[0] for line in out.splitlines()] == [*NOT_IN_FIG_8]
    assert f"edge_glow: 9 (in the file: {constant('edge_glow'):g})" in out


def test_claims_are_judged_with_sets_of_both_origins(
    run: Calibrate, jobs: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def predict(claims: pd.DataFrame, sets: dict[str, list[object]], store: Path, jobs: int) -> pd.DataFrame:
        assert {origin: len(each) for origin, each in sets.items()} == {"posterior": 1, "prior": 3}
        assert (store, jobs, len(claims) > 80) == (tmp_path / command_calibrate.PREDICTION_STORE, 2, True)
        row = {"set": 0, "weight": 1.0, "claim": "F9.1", "reading": "a", "value": 0.4}
        return pd.DataFrame(
            [{**row, "origin": "posterior", "verdict": "inside"}, {**row, "origin": "prior", "verdict": "outside"}]
        )

    (tmp_path / "results").mkdir()
    sets = pd.DataFrame([{**vars(candidate_in_use()), "weight": 1.0}])
    sets.drop(columns="weight").to_csv(tmp_path / command_calibrate.TABLE)
    code, _, err = run("--predict", "3")
    assert (code, err.count("\n")) == (2, 1)
    assert "posterior.csv has no column weight" in err
    sets.to_csv(tmp_path / command_calibrate.TABLE)
    monkeypatch.setattr(command_calibrate, "predict_claims", predict)
    code, out, _ = run("--predict", "3", "--jobs", "2")
    assert code == 0
    assert out.splitlines()[0] == "results/posterior.csv: 1 sets, worth 1 of equal weight"
    assert out.splitlines()[2].split() == ["F9.1", "a", "1.0", "0.0"]
    assert len(pd.read_csv(tmp_path / command_calibrate.PREDICTIONS)) == 2
    assert not jobs


@pytest.mark.parametrize("words", [("--jobs", "0"), ("--jobs", "many"), ("0.8",)])
def test_misuse_is_one_line(run: Calibrate, jobs: list[int], words: tuple[str, ...]) -> None:
    code, _, err = run(*words)
    assert code == 2
    assert err.count("\n") == 1
    assert words[-1] in err
    assert not jobs
