"""``bicode calibrate``: what is tried, printed and written, with cells that cost nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from bicode_lab.evaluation.calibration import ID_CELLS, PLATE_CELLS, Candidate, in_the_file
from bicode_lab.lab import command_calibrate
from bicode_lab.lab.cli import main

Calibrate = Callable[..., tuple[object, str, str]]


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Candidate, int]]:
    """What was tried: candidate and seeds; each brighter LED reads every ID a little better."""
    asked: list[tuple[Candidate, int]] = []

    def cells(candidate: Candidate, seeds: int) -> dict[str, float]:
        asked.append((candidate, seeds))
        plates = {f"2D {ma:g} mA {d:g} m": float(d <= 2.5) for ma, d in PLATE_CELLS}
        return plates | {f"ID {ma:g} mA {d:g} m": candidate.led_to_ambient / 2 for ma, d in ID_CELLS}

    monkeypatch.setattr("bicode_lab.evaluation.calibration.fig_8_cells", cells)
    return asked


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Calibrate:
    """A function: words typed after ``bicode calibrate`` in; (exit code, stdout, stderr) out."""

    def calibrate(*words: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["calibrate", *words])
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return calibrate


def test_only_the_files_constants_are_tried_and_nothing_is_written(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command_calibrate, "repository_root", lambda: tmp_path)
    code, out, err = run("--only-current", "--seeds", "1", "--jobs", "1")
    assert (code, err) == (0, "")
    assert tried == [(in_the_file(), 1)]
    assert f"{in_the_file().led_to_ambient:g}" in out
    assert not list(tmp_path.iterdir())


def test_all_candidates_are_written_the_best_first(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "figures").mkdir()
    monkeypatch.setattr(command_calibrate, "repository_root", lambda: tmp_path)
    code, out, _ = run("--seeds", "2", "--jobs", "1")
    assert code == 0
    table = pd.read_csv(tmp_path / command_calibrate.TABLE)
    assert len(table) == len(tried) == len({candidate for candidate, _ in tried})
    assert {seeds for _, seeds in tried} == {2}
    assert table["sum"].is_monotonic_increasing
    assert f"all {len(tried)} candidates: calibration.csv" in out


def test_the_table_goes_where_it_is_asked_to(
    run: Calibrate, tried: list[tuple[Candidate, int]], tmp_path: Path
) -> None:
    path = tmp_path / "mine.csv"
    assert run("--only-current", "--seeds", "1", "--jobs", "1", "--out", str(path))[0] == 0
    (row,) = pd.read_csv(path).to_dict("records")
    assert {name: row[name] for name in vars(in_the_file())} == vars(in_the_file())


@pytest.mark.parametrize("words", [("--seeds", "0"), ("--jobs", "0"), ("--seeds", "many"), ("0.8",)])
def test_misuse_is_one_line(run: Calibrate, tried: list[tuple[Candidate, int]], words: tuple[str, ...]) -> None:
    code, _, err = run(*words)
    assert code == 2
    assert err.count("\n") == 1
    assert words[-1] in err
    assert not tried
