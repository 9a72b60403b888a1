"""``bicode compare-receivers`` makes the tables that it is asked for, and goes on where it was stopped."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bicode_studies.cli.comparisons import compare_receivers as command
from bicode_studies.cli.main import main
from bicode_studies.robustness import compare as module
from bicode_studies.robustness.link_conditions import balanced_conditions, clutter_conditions
from tests.studies.sweep import cheap_trials


def run(*words: str) -> object:
    with pytest.raises(SystemExit) as ended:
        main(["compare-receivers", *words])
    return ended.value.code


@pytest.fixture
def words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """Return options for a folder of their own, and let trials cost nothing."""
    cheap = {
        "never-worse": (cheap_trials.read_by_two, cheap_trials.read_by_one),
        "clutter": (cheap_trials.read_by_two, cheap_trials.read_by_one),
        "range": (cheap_trials.count_periods,),
        "false-ids": (cheap_trials.count_clutter,),
    }
    tables = {name: replace(each, functions=cheap[name]) for name, each in module.COMPARISONS.items()}
    monkeypatch.setattr(module, "COMPARISONS", tables)
    monkeypatch.setattr(command, "COMPARISONS", tables)
    monkeypatch.setattr("bicode_studies.sweep.sweep.LocalWorkers", cheap_trials.Here)
    return ("--out", str(tmp_path / "tables"), "--store", str(tmp_path / "s.sqlite"), "--jobs", "1")


def test_a_verdict_is_written_for_each_condition(
    tmp_path: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("never-worse", "--seeds", "2", *words) == 0
    table = pd.read_csv(tmp_path / "tables" / "receivers_never_worse.csv")
    verdicts = pd.read_csv(tmp_path / "tables" / "receivers_verdicts.csv")
    conditions = balanced_conditions()
    assert len(table) == len(conditions) * 2 * 3
    assert list(table)[-1] == "digest"
    columns = list(asdict(conditions[0]))
    pd.testing.assert_frame_equal(
        verdicts[columns], pd.DataFrame([asdict(each) for each in conditions]), check_dtype=False
    )
    assert (verdicts["is_worse"] == (verdicts["distance_m"] == 40)).all()
    said = capsys.readouterr().out
    assert f"in {(verdicts['distance_m'] == 40).sum()} of {len(verdicts)} conditions" in said
    # A table that is there is not replaced without a word.
    assert run("never-worse", "--seeds", "2", *words) == 2
    assert "receivers_never_worse.csv" in capsys.readouterr().err


def test_all_tables_are_made_without_a_name_and_seeds_are_added(tmp_path: Path, words: tuple[str, ...]) -> None:
    assert run("clutter", "--seeds", "2", *words) == 0
    assert [path.name for path in (tmp_path / "tables").iterdir()] == ["receivers_clutter.csv"]
    assert run("--seeds", "3", "--hours", "0.02", "--force", *words) == 0
    sizes = {path.name: len(pd.read_csv(path)) for path in (tmp_path / "tables").iterdir()}
    assert sizes["receivers_clutter.csv"] == len(clutter_conditions()) * 3 * 3
    assert sizes["receivers_range.csv"] == 16 * 3 * 3
    assert sizes["receivers_false_ids.csv"] == 3 * 2
    assert len(sizes) == 5


def test_other_amounts_do_not_replace_the_whole_tables(
    tmp_path: Path, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[Path] = []

    def compare(name: str, path: Path, **options: Any) -> pd.DataFrame:
        written.append(path)
        return pd.DataFrame(row for each in (0, 1) for row in cheap_trials.count_clutter(None, each))

    monkeypatch.setattr(command, "compare", compare)
    monkeypatch.setattr("bicode_studies.repository.repository_root", lambda: tmp_path)
    assert run("false-ids") == run("false-ids", "--hours", "0.5") == 0
    results = tmp_path / "results"
    assert written == [results / "receivers_false_ids.csv", results / "quick" / "receivers_false_ids.csv"]


def test_misuse_and_failed_trials_are_one_line(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("speed", *words) == 2
    assert run("range", "--seeds", "1", *words) == 2
    assert run("false-ids", "--hours", "0", *words) == 2
    assert "--hours 0 is no time" in capsys.readouterr().err
    failing = replace(module.COMPARISONS["range"], functions=(cheap_trials.fail,))
    monkeypatch.setitem(module.COMPARISONS, "range", failing)
    assert run("range", "--seeds", "2", *words) == 1
    assert "32 trials failed and are not kept" in capsys.readouterr().err
