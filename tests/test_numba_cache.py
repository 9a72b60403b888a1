"""Kernels compiled from other sources are not used: a changed file that a kernel calls into counts, too."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bicode_lab._numba import STAMP, forget_stale_kernels

OUTER = """
import numba as nb
from kept.inner import twice
@nb.njit(cache=True)
def outer(x):
    return twice(x) + 1
"""
INNER = """
import numba as nb
@nb.njit(inline="always")
def twice(x):
    return {times} * x
"""
ASK = """
from pathlib import Path
from bicode_lab._numba import forget_stale_kernels
if {watch}:
    forget_stale_kernels(Path("kept"))
from kept.outer import outer
print(outer(10))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of one source and one kept kernel, whose stamp has been written."""
    folder = tmp_path / "kept"
    (folder / "deep" / "__pycache__").mkdir(parents=True)
    (folder / "deep" / "kernel.py").write_text("x = 1\n", encoding="utf-8")
    assert forget_stale_kernels(folder)
    for ending in ("nbi", "nbc"):
        (folder / "deep" / "__pycache__" / f"kernel.{ending}").write_bytes(b"compiled")
    return folder


def kernels(folder: Path) -> list[Path]:
    return [*folder.rglob("*.nb[ic]")]


def test_kernels_are_kept_while_sources_stay(package: Path) -> None:
    assert not forget_stale_kernels(package)
    assert len(kernels(package)) == 2


@pytest.mark.parametrize("change", ["text", "time", "another"])
def test_a_changed_source_forgets_them(package: Path, change: str) -> None:
    source = package / "deep" / "kernel.py"
    if change == "text":
        source.write_text("x = 22\n", encoding="utf-8")
    elif change == "time":
        os.utime(source, ns=(1, 1))
    else:
        (package / "new.py").write_text("", encoding="utf-8")
    assert forget_stale_kernels(package)
    assert not kernels(package)
    assert not forget_stale_kernels(package)


def test_a_folder_that_cannot_be_written_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "__pycache__").write_text("a file where the folder should be", encoding="utf-8")
    assert not forget_stale_kernels(tmp_path)


def test_the_package_has_its_stamp() -> None:
    import bicode_lab

    assert (Path(bicode_lab.__file__).parent / "__pycache__" / STAMP).is_file()


def test_numba_alone_goes_on_with_the_old_one_and_so_would_we(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "outer.py").write_text(OUTER, encoding="utf-8")

    def ask(times: int, watch: bool) -> str:
        (folder / "inner.py").write_text(INNER.format(times=times), encoding="utf-8")
        os.utime(folder / "inner.py", ns=(times * 10**18, times * 10**18))
        words = [sys.executable, "-B", "-c", ASK.format(watch=watch)]
        here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
        return subprocess.run(words, cwd=tmp_path, env=here, check=True, capture_output=True, text=True).stdout.strip()

    assert ask(1, watch=True) == "11"
    assert ask(2, watch=True) == "21"
    assert ask(3, watch=False) == "21"  # the trap: without the stamp the old kernel is used
    assert ask(4, watch=True) == "41"
