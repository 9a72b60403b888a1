"""``bicode sweep`` and the tables it writes, with trials that take no time."""

from __future__ import annotations

import types
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.cli.main import main
from bicode_studies.paper_experiments import results
from bicode_studies.paper_experiments.results import figure_table, is_current, read_results
from bicode_studies.sweep.workers import default_jobs
from tests.studies.sweep import cheap_trials
from tests.studies.sweep.cheap_trials import Cheap

Sweep = Callable[..., tuple[object, str, str]]


@pytest.fixture
def experiments(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> types.SimpleNamespace:
    """Replace the experiments by cheap trials at two distances, and the repository by one of their own."""
    stub = types.SimpleNamespace(
        conditions=lambda figure, quick: [Cheap(distance_m=float(figure)), Cheap(distance_m=float(figure) + 0.5)],
        seeds=lambda condition, quick: range(2 if quick else 3),
    )
    monkeypatch.setattr(results, "grids", stub)
    monkeypatch.setattr(results, "run_trial", cheap_trials.run)
    monkeypatch.setattr(results, "Condition", Cheap)
    for name in ("notebooks", "bicode_lab"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BICODE_JOBS", "2")
    return stub


@pytest.fixture
def sweep(experiments: types.SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> Sweep:
    """Return a function that runs ``bicode sweep`` with some words and returns (exit code, stdout, stderr)."""

    def run(*words: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["sweep", *words])
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return run


def test_it_prints_the_accuracies_of_each_condition(sweep: Sweep, tmp_path: Path) -> None:
    code, out, err = sweep("8", "14", "--full")
    assert (code, err) == (0, "")
    assert out.count("Figure 8\n") == out.count("Figure 14\n") == 1
    line = next(line for line in out.splitlines() if line.split()[:2] == ["8.5", "authors"])
    rows = [row for seed in range(3) for row in cheap_trials.run(Cheap(distance_m=8.5), seed)]
    shares = [row["id_right"] / 200 for row in rows if row["receiver"] == "authors"]
    assert line.split()[2:5] == ["3", "600", f"{sum(shares) / 3:.3f}"]
    assert (tmp_path / "build" / "sweeps.sqlite").is_file()


def expected_rows(figure: float, seeds: int) -> pd.DataFrame:
    """Return the table of a figure as a loop would make it."""
    distances = (figure, figure + 0.5)
    rows = [row for d in distances for seed in range(seeds) for row in cheap_trials.run(Cheap(distance_m=d), seed)]
    return pd.DataFrame(rows)


def test_notebooks_take_what_the_command_has_run(sweep: Sweep, monkeypatch: pytest.MonkeyPatch) -> None:
    assert sweep("all", "--store", "kept.sqlite", "--jobs", "1")[0] == 0
    monkeypatch.setattr("bicode_studies.sweep.sweep.LocalWorkers", None)  # nothing may be left to run
    expected = expected_rows(11, seeds=2)
    pd.testing.assert_frame_equal(figure_table("11", quick=True), expected, check_dtype=False)
    read = read_results("11", quick=True)
    assert read is not None
    assert read["share"].tolist() == expected["share"].tolist()  # to the last bit
    for path in Path("results/quick").glob("11.*"):
        path.unlink()
    pd.testing.assert_frame_equal(figure_table("11", quick=True, store="kept.sqlite"), expected, check_dtype=False)


def test_the_papers_scale_and_the_short_grid_have_files_of_their_own(sweep: Sweep, tmp_path: Path) -> None:
    assert read_results("14", quick=True) is None
    assert sweep("14", "--full")[0] == 0
    assert sorted(path.name for path in (tmp_path / "results").glob("*.*")) == ["14.csv", "14.json"]
    assert is_current("14", quick=False)
    assert not is_current("14", quick=True)
    assert len(figure_table("14", quick=False)) == len(expected_rows(14, seeds=3))
    assert len(figure_table("14", quick=True)) == len(expected_rows(14, seeds=2))
    assert (tmp_path / "results" / "quick" / "14.csv").is_file()


def test_a_table_is_made_again_where_its_code_or_grid_has_changed(
    experiments: types.SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    csv, made_by = (tmp_path / "results" / "quick" / name for name in ("09.csv", "09.json"))
    figure_table("09", quick=True)
    first = csv.read_bytes(), made_by.read_bytes()
    csv.write_text("distance_m\n1\n")
    assert len(figure_table("09", quick=True)) == 1  # it is read, not made, where nothing says that it is old
    made_by.write_text("{")
    assert not is_current("09", quick=True)
    figure_table("09", quick=True)
    assert (csv.read_bytes(), made_by.read_bytes()) == first
    experiments.seeds = lambda condition, quick: range(4)
    assert not is_current("09", quick=True)
    assert len(figure_table("09", quick=True)) == len(expected_rows(9, seeds=4))
    monkeypatch.setattr(results, "digest_of", lambda function, files: "b")
    assert not is_current("09", quick=True)


def test_trials_that_fail_are_one_line_and_exit_code_1(
    sweep: Sweep, experiments: types.SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(results, "run_trial", cheap_trials.run_or_raise)
    experiments.conditions = lambda figure, quick: [Cheap(distance_m=5), Cheap(distance_m=20)]
    code, out, err = sweep("09")
    assert code == 1
    assert err.count("\n") == 1
    assert "1 trial failed and is not kept" in err
    assert "seed 1: ArithmeticError: no light at all" in err
    assert "20" in out
    with pytest.raises(RuntimeError, match="no light at all"):
        figure_table("09", quick=True)
    assert not list((tmp_path / "results" / "quick").iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["7"], "no trials for figure '07'; choose of 08, 09, 10, 11, 12, 14, or all"),
        (["x"], "no trials for figure 'x'"),
        ([], "Missing argument"),
        (["8", "--jobs", "0"], "--jobs"),
        (["8", "--cluster", "tcp://127.0.0.1:1"], "no cluster answers at tcp://127.0.0.1:1"),
    ],
)
def test_misuse_is_one_line(sweep: Sweep, words: list[str], said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bicode_studies.sweep.workers.TIMEOUT_S", 1)
    code, _, err = sweep(*words)
    assert code == 2
    assert err.count("\n") == 1
    assert said in err


def test_jobs_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BICODE_JOBS", "7")
    assert default_jobs() == 7
    monkeypatch.delenv("BICODE_JOBS")
    assert default_jobs() >= 1
    for wrong in ("0", "many", "-1"):
        monkeypatch.setenv("BICODE_JOBS", wrong)
        with pytest.raises(ValueError, match="BICODE_JOBS"):
            default_jobs()
    with pytest.raises(ValueError, match="figure '13' has no grid"):
        figure_table("13", quick=True)
