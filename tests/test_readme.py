"""The README is true: every command in it runs, every file it names is there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from bicode_studies.cli.main import main

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", README, flags=re.DOTALL)
SHELL = [line.split("#")[0].strip() for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()]
MAKE = sorted({line for line in [*SHELL, *re.findall(r"`(make [^`]+)`", README)] if line.startswith("make")})
BICODE = [line for line in SHELL if line.startswith("bicode")]


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


def test_every_row_of_the_figure_table_can_be_run() -> None:
    numbers = re.findall(r"`bicode figures --only (\d\d)`", README)
    assert numbers == [f"{n:02}" for n in range(1, len(numbers) + 1)]
    for number in numbers:
        assert len(list((ROOT / "notebooks").glob(f"{number}_*.ipynb"))) == 1


def test_every_file_it_points_to_is_there() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_its_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = [text for kind, text in BLOCKS if kind == "python"]
    exec(compile(code, "README.md", "exec"), {})
    assert "37" in capsys.readouterr().out
