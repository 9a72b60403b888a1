"""No command replaces a file without a word, and no two recordings share a truth."""

from __future__ import annotations

import errno
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bicode_lab.recordings import WRITABLE
from bicode_studies.cli.helpers.output_files import refuse_existing, write_whole, written
from bicode_studies.cli.main import main

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Return a function that runs ``bicode`` and returns exit code, standard output and standard error."""

    def run(*words: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


def test_every_recording_has_a_truth_of_its_own(call: Call, tmp_path: Path) -> None:
    kept = {}
    for number, ending in enumerate(WRITABLE):
        out = tmp_path / f"m{ending}"
        assert call("simulate", out, "--payload", number, "--seconds", 0.02)[0] == 0
        kept[out] = number
    for out, number in kept.items():
        truth = json.loads((tmp_path / f"{out.name}.truth.json").read_text(encoding="utf-8"))
        assert truth["markers"][0]["id"] == number


@pytest.mark.parametrize("there", ["mine.npz", "mine.npz.truth.json"])
@pytest.mark.parametrize("more", [[], ["--mystery", "1"]])
def test_simulate_replaces_nothing_unless_forced(call: Call, tmp_path: Path, there: str, more: list[str]) -> None:
    if more and there.endswith("json"):
        return  # an exercise has no truth
    (tmp_path / there).write_text("mine", encoding="utf-8")
    words = ["simulate", tmp_path / "mine.npz", *([] if more else ["--seconds", 0.02]), *more]
    code, out, err = call(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert there in err
    assert "--force" in err
    assert (tmp_path / there).read_text(encoding="utf-8") == "mine"
    assert [path.name for path in tmp_path.iterdir()] == [there]
    if not more:
        assert call(*words, "--force")[0] == 0
        assert (tmp_path / there).read_bytes() != b"mine"


def test_a_link_that_leads_nowhere_counts_as_a_file(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="a is there already and is not replaced"):
        refuse_existing([tmp_path / "a", tmp_path / "b"])
    (tmp_path / "b").touch()
    with pytest.raises(ValueError, match="are there already and are not"):
        refuse_existing([tmp_path / "a", tmp_path / "b"])
    refuse_existing([tmp_path / "a"], force=True)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (RuntimeError("No space left on device (os error 28)"), "No space left on device"),
        (RuntimeError("write failed: (os error 13)"), "Permission denied"),
    ],
)
def test_an_error_of_the_system_names_the_file(error: Exception, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(f"a.csv cannot be written ({said})")), written(Path("a.csv")):
        raise error
    with pytest.raises(RuntimeError, match=r"^of another kind$"), written(Path("a.csv")):
        raise RuntimeError("of another kind")


@pytest.mark.parametrize("name", ["write_recording", "write_whole"])
def test_a_full_disk_is_one_line(call: Call, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: Path, *_: object) -> None:
        with written(path):
            raise RuntimeError("No space left on device (os error 28)")

    monkeypatch.setattr(f"bicode_studies.cli.simulate.{name}", fail)
    code, out, err = call("simulate", tmp_path / "m.csv", "--seconds", 0.02)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "cannot be written (No space left on device)" in err


def test_a_text_is_whole_or_not_there(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match="folder cannot be written"):
        write_whole(tmp_path / "folder", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
    write_whole(tmp_path / "a.json", "{}")
    assert (tmp_path / "a.json").read_text(encoding="utf-8") == "{}"
