"""The README is true: its commands run, its numbers are those of the tables, its Python prints what it says."""

from __future__ import annotations

import json
import re
import shlex
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from bicode_studies.cli.main import main
from bicode_studies.notebook.run_times import read_run_times, with_minutes
from bicode_studies.notebook.runner import find_notebooks

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FLAT = README.replace("\n", " ")
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", README, flags=re.DOTALL)
SHELL = [line.split("#")[0].strip() for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()]
MAKE = sorted({line for line in [*SHELL, *re.findall(r"`(make [^`]+)`", README)] if line.startswith("make")})
BICODE = [line for line in SHELL if line.startswith("bicode")]
ROWS = [re.split(r" ?\| ?", line)[1:-1] for line in README.splitlines() if "](notebooks/" in line and "|" in line]
NAMED = re.compile(r"\b[FA]\d+\.\d\b")


def test_every_make_target_is_in_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert {"make figures", "make test"} <= set(MAKE)
    for command in MAKE:
        target = command.split()[1]
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), command


def test_every_bicode_command_runs_in_the_order_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notebooks").symlink_to(ROOT / "notebooks")
    (tmp_path / "bicode_lab").symlink_to(ROOT / "bicode_lab")
    monkeypatch.setenv("BICODE_FIGURES", str(tmp_path / "figures"))
    assert len(BICODE) >= 4
    for command in BICODE:
        with pytest.raises(SystemExit) as ended:
            main(shlex.split(command)[1:])
        assert ended.value.code == 0, f"{command}: {capsys.readouterr().err}"


def test_the_table_has_a_row_for_every_notebook() -> None:
    names = [re.findall(r"\(notebooks/(\w+)\.ipynb\)", row[0]) for row in ROWS]
    assert names == [[path.stem] for path in find_notebooks()]
    for row in ROWS:
        number = row[0][1:3]
        assert f"[{number} " in row[0]
        assert f"notebooks/{number}_" in row[0]
        assert row[1] == (f"Fig. {int(number)}" if 1 <= int(number) <= 14 else ""), "the paper's figure"
        assert f"(figures/fig_{number}_" in row[2]


def test_the_minutes_are_those_of_the_table_of_run_times() -> None:
    assert all(re.fullmatch(r"[\d.?]+ / [\d.?]+", row[3]) for row in ROWS)
    assert with_minutes(README, read_run_times(ROOT / "results" / "run_times.csv")) == README, (
        "bicode figures --times; bicode figures --full --times"
    )


@pytest.mark.slow
def test_the_agreement_is_that_of_the_claims(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    with pytest.raises(SystemExit) as ended:
        main(["claims", "--format", "json"])
    assert ended.value.code == 0
    judged = [row for row in json.loads(capsys.readouterr().out) if row["kind"] in ("number", "order")]
    classes = Counter(row["class"] for row in judged)
    counted = r"states (\d+) numbers and orders\. Of these, (\d+) were used .* (\d+) follow .* (\d+) test"
    (sentence,) = re.findall(counted, FLAT)
    said = [int(number) for number in sentence]
    assert said == [
        len(judged),
        *(classes[name] for name in ("calibrated on", "follows from a fit", "tests the model")),
    ]
    outside = {row["id"]: row for row in judged if row["class"] == "tests the model" and is_outside(row)}
    listed = re.findall(r"(?m)^- ([FA]\d+\.\d): ", README)
    assert listed == list(outside)
    ((many, first),) = re.findall(r"In these (\w+) our value is outside the bounds, and the first (\w+) are", FLAT)
    words = {"three": 3, "four": 4, "five": 5, "six": 6}
    assert words[many] == len(listed)
    verdicts = [outside[each]["verdict"] == "contradicted" for each in listed]
    assert verdicts == [place < words[first] for place in range(len(listed))]
    in_table = {each for row in ROWS for each in NAMED.findall(row[4])}
    assert in_table == set(listed)


def is_outside(row: dict[str, Any]) -> bool:
    """Return whether our value is outside the paper's bounds in every reading of the sentence."""
    read = [each for each in "ab" if row[f"value_{each}"] is not None]
    ends = {each: (row[f"lo_{each}"], row[f"hi_{each}"]) for each in read}
    return all(
        (low is not None and row[f"value_{each}"] < low) or (high is not None and row[f"value_{each}"] > high)
        for each, (low, high) in ends.items()
    )


def test_its_python_prints_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    ((kind, code), (_, said)) = [block for block in BLOCKS if block[0] in ("python", "")]
    assert kind == "python"
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == said


def test_it_is_short() -> None:
    assert len(README.encode()) < 9_000


def test_every_notebook_was_timed() -> None:
    """``bicode figures --times`` was run with short settings and at the paper's scale."""
    assert not [row for row in ROWS if "?" in row[3]]
