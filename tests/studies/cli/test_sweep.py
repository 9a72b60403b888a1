"""``bicode sweep``, and the table that notebooks take, with trials that cost nothing."""

from __future__ import annotations

import types
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from tests.evaluation import cheap_trials

from bicode_studies.cli.main import main
from bicode_studies.paper_experiments.figure_table import default_jobs, figure_table
from tests.studies.sweep.cheap_trials import Cheap

Sweep = Callable[..., tuple[object, str, str]]


@pytest.fixture
def experiments(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> types.SimpleNamespace:
    """In place of the experiments: cheap trials at two distances, and a repository of their own to keep them in."""
    stub = types.SimpleNamespace(
        run_trial=cheap_trials.run,
        conditions=lambda figure, quick: [Cheap(distance_m=float(figure)), Cheap(distance_m=float(figure) + 0.5)],
        seeds=lambda condition, quick: range(2 if quick else 3),
    )
    monkeypatch.setattr("bicode_studies.paper_experiments.figure_table.experiments", stub)
    monkeypatch.setattr("bicode_studies.paper_experiments.figure_table.Condition", Cheap)
    for name in ("notebooks", "bicode_lab"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BICODE_JOBS", "2")
    return stub


@pytest.fixture
def sweep(experiments: types.SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> Sweep:
    """A function: words typed after ``bicode sweep`` in; (exit code, stdout, stderr) out."""

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


def test_notebooks_take_what_the_command_has_run(
    sweep: Sweep, experiments: types.SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert sweep("all", "--store", "kept.sqlite", "--jobs", "1")[0] == 0
    monkeypatch.setattr("bicode_studies.sweep.sweep._workers", None)  # nothing may be left to run
    table = figure_table("11", quick=True, store="kept.sqlite")
    expected = [
        row for d in (11.0, 11.5) for seed in range(2) for row in cheap_trials.run(Cheap(distance_m=d), seed)
    ]  # fmt: skip
    pd.testing.assert_frame_equal(table, pd.DataFrame(expected), check_dtype=False)


def test_trials_that_fail_are_one_line_and_exit_code_1(sweep: Sweep, experiments: types.SimpleNamespace) -> None:
    experiments.run_trial = cheap_trials.run_or_raise
    experiments.conditions = lambda figure, quick: [Cheap(distance_m=5), Cheap(distance_m=20)]
    code, out, err = sweep("09")
    assert code == 1
    assert err.count("\n") == 1
    assert "1 trial failed and is not kept" in err
    assert "seed 1: ArithmeticError: no light at all" in err
    assert "20" in out
    with pytest.raises(RuntimeError, match="no light at all"):
        figure_table("09", quick=True)


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
    monkeypatch.setattr("bicode_studies.sweep.cluster.TIMEOUT_S", 1)
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
