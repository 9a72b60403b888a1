"""``bicode stress`` runs each condition with each seed and writes one table."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.cli import stress as command
from bicode_studies.cli.main import main
from bicode_studies.robustness.stressors import DISTANCE, STRESSORS
from tests.studies.sweep import cheap_trials


def run(*words: str) -> object:
    with pytest.raises(SystemExit) as ended:
        main(["stress", *words])
    return ended.value.code


def test_seeds_are_recordings_of_each_condition_in_a_fixed_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "stress_trial", cheap_trials.count_periods)
    out, store = tmp_path / "stress.csv", tmp_path / "s.sqlite"
    words = ("--out", str(out), "--store", str(store), "--jobs", "1", "--force")
    assert run("--seeds", "1", *words) == 0
    first = pd.read_csv(out)
    assert run("--seeds", "2", *words) == 0
    table = pd.read_csv(out)
    conditions = [(s.name, float(level)) for s in (*STRESSORS, DISTANCE) for level in s.levels]
    expected = [(*condition, seed) for seed in (0, 1) for condition in conditions for _ in range(3)]
    assert list(table[["stressor", "level", "seed"]].itertuples(index=False, name=None)) == expected
    pd.testing.assert_frame_equal(table[table["seed"] == 0], first)
    assert list(table) == [
        "stressor", "level", "distance_m", "seed", "receiver", "periods", "right", "wrong_ids", "digest",
    ]  # fmt: skip
    said = capsys.readouterr().out
    assert "hot pixels" in said
    assert "times_paper" in said


def test_trials_that_fail_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "stress_trial", cheap_trials.fail)
    out = tmp_path / "stress.csv"
    assert run("--seeds", "1", "--jobs", "1", "--out", str(out), "--store", str(tmp_path / "s.sqlite")) == 1
    assert "50 trials failed and are not kept" in capsys.readouterr().err
    assert not out.exists()
    assert run("--seeds", "0") == 2


def test_fewer_seeds_do_not_replace_the_whole_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[Path] = []

    def to_csv(function: object, trials: object, path: Path, **options: object) -> pd.DataFrame:
        written.append(path)
        return pd.DataFrame(row for trial in trials for row in cheap_trials.count_periods(*trial))  # type: ignore[attr-defined]

    monkeypatch.setattr(command, "sweep_to_csv", to_csv)
    monkeypatch.setattr("bicode_studies.repository.repository_root", lambda: tmp_path)
    assert run() == run("--seeds", "2") == 0
    assert written == [tmp_path / "results" / "stress.csv", tmp_path / "results" / "quick" / "stress.csv"]
