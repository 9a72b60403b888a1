"""A damaged compiled kernel is found and named, by the command that meets it and by ``bicode doctor``."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bicode_studies.cli import doctor
from bicode_studies.cli.helpers.kernel_files import (
    count_kernels,
    damaged_kernels,
    explain_damage,
    kernel_modules,
    say_if_compiling,
)

ROOT = Path(__file__).resolve().parents[4]
COMPILE = """
from bicode_lab.kernels import njit
@njit(cache=True)
def twice(x):
    return 2 * x
twice({value})
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache that holds one compiled kernel, of integers; `kernel_files` looks there."""
    (tmp_path / "kept_kernel.py").write_text(COMPILE.format(value=3), encoding="utf-8")
    assert call(tmp_path) == ""
    (folder,) = (tmp_path / "cache").glob("kernels-*")
    monkeypatch.setattr("bicode_lab.kernels.cache_folder", lambda module: folder)
    return folder


def call(folder: Path) -> str:
    """Run the kernel in a new process, as a command would, and return the last line of its errors."""
    code = (
        "import sys\nfrom bicode_studies.cli.helpers.kernel_files import explain_damage\n"
        "import bicode_lab.kernels as k\nimport pathlib\n"
        "try:\n    import kept_kernel\n"
        "except Exception as error:\n"
        "    (place,) = pathlib.Path('cache').glob('kernels-*')\n    k.cache_folder = lambda module: place\n"
        "    sys.exit(explain_damage(error))\n"
    )
    here = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    here["PYTHONPATH"] = os.pathsep.join([str(folder), str(ROOT), *sys.path])
    words = [sys.executable, "-B", "-c", code]
    return subprocess.run(words, cwd=folder, env=here, capture_output=True, text=True, check=False).stderr.strip()


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("left", [0, 30])
def test_a_file_that_is_cut_is_found_and_its_folder_named(cache: Path, tmp_path: Path, ending: str, left: int) -> None:
    assert damaged_kernels() == []
    assert doctor.check_kernels() == "1 compiled, none is damaged"
    (file,) = cache.rglob(f"*.{ending}")
    os.truncate(file, left)
    assert [damage.file for damage in damaged_kernels()] == [file]
    with pytest.raises(RuntimeError, match=f"{file.name} is damaged or cut short"):
        doctor.check_kernels()
    said = call(tmp_path)
    assert f"the compiled kernel {file.name} is damaged or cut short; delete {Path('cache') / cache.name}" in said
    assert "Traceback" not in said
    file.unlink()
    assert damaged_kernels() == []  # numba compiles what is not there
    assert call(tmp_path) == ""
    assert count_kernels() == 1


def test_an_error_of_another_kind_is_not_explained(cache: Path) -> None:
    (file,) = cache.rglob("*.nbi")
    os.truncate(file, 0)
    assert explain_damage(EOFError()) is None


def test_all_modules_with_kernels_are_looked_at() -> None:
    assert {"bicode_lab.recognition.event_codes", "bicode_lab.camera.pixels"} <= set(kernel_modules())


@pytest.mark.parametrize(
    ("terminal", "kept", "said"), [(True, True, ""), (True, False, "compiling"), (False, False, "")]
)
def test_compiling_is_said_on_a_terminal(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    terminal: bool,
    kept: bool,
    said: str,
) -> None:
    monkeypatch.setattr("bicode_lab.kernels.cache_folder", lambda module: tmp_path)
    if kept:
        (tmp_path / "a.nbi").touch()
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    say_if_compiling()
    err = capsys.readouterr().err
    assert err.startswith(said)
    assert bool(err) == bool(said)


def test_where_nothing_can_be_kept_the_way_out_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("bicode_lab.kernels.cache_folder", lambda module: None)
    say_if_compiling()
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "set NUMBA_CACHE_DIR to a folder" in err
