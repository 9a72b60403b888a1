"""``bicode calibrate`` tries, prints and writes candidates; the trials take no time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from bicode_lab.constants import constant
from bicode_studies.calibration.candidates import EARLIER, Candidate, candidate_in_use
from bicode_studies.calibration.cells import CELLS, cell_name
from bicode_studies.calibration.other_claims import WANTED
from bicode_studies.calibration.search import AGAIN, BEST, NEIGHBOURS, ROUNDS
from bicode_studies.cli import calibrate as command_calibrate
from bicode_studies.cli.main import main
from bicode_studies.sweep.sweep import Sweep

Calibrate = Callable[..., tuple[object, str, str]]


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[tuple[Candidate, int]]:
    """Return what was tried, candidates and blocks of seeds; the sharper the lens, the better the fit."""
    asked: list[tuple[Candidate, int]] = []

    def run(_: object, trials: list[tuple[Candidate, int]], store: Path, **__: object) -> Sweep:
        assert store == tmp_path / command_calibrate.STORE
        asked.extend(trials)
        cells = {cell_name(cell): accuracy for cell, accuracy in CELLS.items()}
        rows = [
            {**vars(one), "led_to_ambient": 0.7, **cells, "2D 10.7 mA 1 m": 1 - one.blur_px / 2} for one, _ in trials
        ]
        return Sweep(table=pd.DataFrame(rows))

    monkeypatch.setattr("bicode_studies.calibration.search.sweep", run)
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


def test_only_the_files_constants_are_tried_and_nothing_is_written(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path
) -> None:
    code, out, err = run("--only-current", "--jobs", "1")
    assert (code, err) == (0, "")
    assert tried == [(candidate_in_use(), block) for block in AGAIN]
    assert f"{candidate_in_use().blur_px:g}" in out
    assert not list(tmp_path.iterdir())


def test_all_candidates_are_written_the_best_first(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path
) -> None:
    (tmp_path / "results").mkdir()
    code, out, _ = run("--draws", "20", "--jobs", "1")
    assert code == 0
    table = pd.read_csv(tmp_path / command_calibrate.TABLE)
    assert len(table) == 20 + len(EARLIER) + ROUNDS * BEST * NEIGHBOURS
    assert table["blur_px"].iloc[0] == table["blur_px"].min()
    assert f"all {len(table)} candidates: calibration.csv" in out


def test_the_table_goes_where_it_is_asked_to(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path
) -> None:
    path = tmp_path / "mine.csv"
    assert run("--only-current", "--jobs", "1", "--out", str(path))[0] == 0
    (row,) = pd.read_csv(path).to_dict("records")
    assert row["blur_px"] == candidate_in_use().blur_px


def test_what_fig_8_cannot_see_is_fitted_to_its_claims(run: Calibrate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_calibrate, "fit_constant", lambda name: float(len(name)))
    code, out, _ = run("--beyond")
    assert code == 0
    assert [line.split(":")[0] for line in out.splitlines()] == [*WANTED, "processing_mev_per_s"]
    assert f"edge_glow: 9 (in the file: {constant('edge_glow'):g})" in out


@pytest.mark.parametrize("words", [("--draws", "0"), ("--jobs", "0"), ("--draws", "many"), ("0.8",)])
def test_misuse_is_one_line(run: Calibrate, tried: list[tuple[Candidate, int]], words: tuple[str, ...]) -> None:
    code, _, err = run(*words)
    assert code == 2
    assert err.count("\n") == 1
    assert words[-1] in err
    assert not tried
