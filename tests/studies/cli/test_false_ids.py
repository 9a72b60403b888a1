"""``bicode false-ids`` continues where it was stopped and writes one table."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.cli import false_ids as command
from bicode_studies.cli.main import main
from bicode_studies.robustness import false_ids as module
from tests.studies.sweep import cheap_trials

ROOT = Path(__file__).resolve().parents[3]


def run(*words: str) -> object:
    with pytest.raises(SystemExit) as ended:
        main(["false-ids", *words])
    return ended.value.code


@pytest.fixture
def notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder where each piece that is counted leaves a file; counting costs nothing."""
    (tmp_path / "notes").mkdir()
    monkeypatch.setattr(command, "count_piece", cheap_trials.count)
    monkeypatch.setenv("NOTES", str(tmp_path / "notes"))
    return tmp_path / "notes"


def test_a_stopped_count_goes_on_where_it_was(tmp_path: Path, notes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "counts.csv"
    words = ("--out", str(out), "--store", str(tmp_path / "s.sqlite"), "--jobs", "1", "--force")
    both = ("paper", "soft")
    runs = [
        ("0.01", "both", {(number, receiver) for number in (0, 1) for receiver in both}),
        ("0.02", "paper", {(2, "paper")}),
        ("0.02", "both", {(2, "soft")}),
        ("0.02", "both", set()),
    ]
    for hours, receiver, missing in runs:
        assert run("--hours", hours, "--receiver", receiver, *words) == 0
        asked = [path.name.split("_") for path in notes.iterdir()]
        assert sorted((int(number), name) for number, name in asked) == sorted(missing)
        for path in notes.iterdir():
            path.unlink()
    table = pd.read_csv(out)
    assert len(table) == 3 * 2 * len(module.CHECKSUMS)
    assert not table.duplicated(["piece", "receiver", "checksum"]).any()
    assert table["piece"].is_monotonic_increasing
    assert (table.columns[0], table.columns[-1]) == ("piece", "digest")
    # Other code, such as another constant of the camera, counts all of them again.
    monkeypatch.setattr("bicode_studies.sweep.sweep.digest_of", lambda function, files: "b")
    monkeypatch.setattr("bicode_studies.sweep.sweep.LocalWorkers", cheap_trials.Here)
    monkeypatch.setattr("bicode_studies.sweep.workers.digest_of", lambda function, files: "b")
    assert run("--hours", "0.01", "--receiver", "paper", *words) == 0
    assert sorted(path.name for path in notes.iterdir()) == ["0_paper", "1_paper"]
    assert set(pd.read_csv(out)["digest"]) == {"b"}


def test_misuse_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = tmp_path / "s.sqlite"
    store.write_bytes(b"\x00\xff no table" * 100)
    words = ("--hours", "0.01", "--out", str(tmp_path / "counts.csv"))
    assert run(*words, "--store", str(store)) == 2
    assert "s.sqlite is not a store of trials" in capsys.readouterr().err
    assert run("--hours", "-1") == 2
    assert "--hours -1 is no time to count in" in capsys.readouterr().err


def test_a_piece_that_fails_leaves_no_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "count_piece", cheap_trials.fail)
    out = tmp_path / "counts.csv"
    assert run("--hours", "0.01", "--out", str(out), "--store", str(tmp_path / "s.sqlite"), "--jobs", "1") == 1
    assert "4 trials failed and are not kept" in capsys.readouterr().err
    assert not out.exists()


def test_fewer_hours_do_not_replace_the_whole_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[Path] = []

    def to_csv(function: object, trials: object, path: Path, **options: object) -> pd.DataFrame:
        written.append(path)
        return pd.read_csv(ROOT / "results" / "false_ids.csv")

    monkeypatch.setattr(command, "sweep_to_csv", to_csv)
    monkeypatch.setattr("bicode_studies.repository.repository_root", lambda: tmp_path)
    assert run() == run("--hours", "1") == run("--receiver", "soft") == 0
    full, short = tmp_path / "results" / "false_ids.csv", tmp_path / "results" / "quick" / "false_ids.csv"
    assert written == [full, short, short]
