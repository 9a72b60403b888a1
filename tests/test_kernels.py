"""Kernels compiled from other sources are not used, also where only a file that a kernel calls into has changed."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import pytest

from bicode_lab import kernels
from bicode_lab.kernels import cache_folder, njit

PIXELS = "bicode_lab.camera.pixels"
ROOT = Path(__file__).resolve().parents[1]
OUTER = """
from {library} import njit
from kept.inner import twice
@njit(cache=True)
def outer(x):
    return twice(x) + 1
"""
INNER = """
from numba import njit
@njit(inline="always")
def twice(x):
    return {times} * x
"""
ASK = "from kept.outer import outer; print(outer(10), sum(outer.stats.cache_hits.values()))"


def ask(folder: Path, times: int, library: str = "bicode_lab.kernels", **environment: str) -> tuple[str, str]:
    """Return what a new process gets from a package of two files, and how many kernels it found in the cache."""
    package = folder / "kept"
    package.mkdir(exist_ok=True)
    (package / "__init__.py").touch()
    (package / "outer.py").write_text(OUTER.format(library=library), encoding="utf-8")
    (package / "inner.py").write_text(INNER.format(times=times), encoding="utf-8")
    os.utime(package / "outer.py", ns=(10**18, 10**18))
    os.utime(package / "inner.py", ns=(times * 10**18, times * 10**18))
    here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT), *sys.path]), **environment}
    words = [sys.executable, "-B", "-c", ASK]
    done = subprocess.run(words, cwd=folder, env=here, check=True, capture_output=True, text=True)
    assert not done.stderr
    value, hits = done.stdout.split()
    return value, hits


def test_a_changed_file_that_a_kernel_calls_into_is_compiled_anew(tmp_path: Path) -> None:
    cache = str(tmp_path / "cache")
    assert ask(tmp_path, 1, NUMBA_CACHE_DIR=cache) == ("11", "0")
    assert ask(tmp_path, 1, NUMBA_CACHE_DIR=cache) == ("11", "1")
    first = sorted((tmp_path / "cache").rglob("*.nb[ic]"))
    assert ask(tmp_path, 2, NUMBA_CACHE_DIR=cache) == ("21", "0")
    assert ask(tmp_path, 4, NUMBA_CACHE_DIR=cache) == ("41", "0")
    assert first  # nothing is deleted, and the first sources still find their kernel
    assert set(first) < set((tmp_path / "cache").rglob("*.nb[ic]"))
    assert ask(tmp_path, 1, NUMBA_CACHE_DIR=cache) == ("11", "1")


def test_numba_alone_goes_on_with_the_old_one(tmp_path: Path) -> None:
    """The trap that the cache folder avoids."""
    cache = str(tmp_path / "cache")
    assert ask(tmp_path, 2, "numba", NUMBA_CACHE_DIR=cache) == ("21", "0")
    assert ask(tmp_path, 3, "numba", NUMBA_CACHE_DIR=cache) == ("21", "1")


def test_two_processes_at_once_agree(tmp_path: Path) -> None:
    ask(tmp_path, 3, NUMBA_CACHE_DIR=str(tmp_path / "other"))  # writes the files
    here = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    here["PYTHONPATH"] = os.pathsep.join([str(tmp_path), str(ROOT), *sys.path])
    both = [
        subprocess.Popen([sys.executable, "-B", "-c", ASK], env=here, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    assert [process.communicate()[0].split()[0] for process in both] == ["31", "31"]
    assert ask(tmp_path, 3, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == ("31", "1")


def test_without_a_cache_folder_of_the_user_the_package_keeps_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    folder = cache_folder(PIXELS)
    assert folder is not None
    assert folder.parent == Path(kernels.__file__).parent / "__pycache__"
    assert folder.is_dir()


def test_files_that_a_module_reaches_by_imports_choose_its_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    real = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read.append(path) or real(path))
    kernels._hash_of_sources.cache_clear()
    cache_folder(PIXELS)
    kernels._hash_of_sources.cache_clear()
    names = {path.name for path in read}
    assert {"pixels.py", "pixel_steps.py", "constants.py", "kernels.py"} <= names
    assert not names & {"recorder.py", "decode.py", "trial.py"}  # these import pixels.py or have nothing to do with it


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package that cannot be written, a user without a home, and a folder for temporary files."""
    blocked = tmp_path / "blocked"
    blocked.write_text("a file where a folder should be", encoding="utf-8")
    monkeypatch.setattr(kernels, "PACKAGE", blocked)
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "nonexistent"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    kernels._first_writable.cache_clear()
    yield tmp_path
    kernels._first_writable.cache_clear()


def test_a_package_that_cannot_be_written_uses_the_folder_of_the_user(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = places / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    folder = cache_folder(PIXELS)
    assert folder is not None
    assert folder.parent == home / ".cache" / "bicode_lab"


def test_a_user_without_a_home_uses_the_folder_for_temporary_files(places: Path) -> None:
    folder = cache_folder(PIXELS)
    assert folder is not None
    assert folder.parent.parent == places / "temporary"
    assert folder.parent.stat().st_mode & 0o777 == 0o700
    assert not (places / "nonexistent").exists()


def test_where_nothing_can_be_written_kernels_are_compiled_and_not_cached(places: Path) -> None:
    (places / "temporary").rmdir()
    (places / "temporary").write_text("", encoding="utf-8")
    assert cache_folder(PIXELS) is None
    assert njit(cache=True)(_double)(21) == 42


def _double(x: int) -> int:
    return 2 * x


def test_the_folder_of_the_user_comes_first_and_other_libraries_keep_theirs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = str(tmp_path / "given")
    monkeypatch.setattr(numba.config, "CACHE_DIR", given)
    folder = cache_folder(PIXELS)
    assert folder is not None
    assert folder.parent == Path(given)
    assert njit(cache=True)(_double)(21) == 42
    assert given == numba.config.CACHE_DIR
    assert list(Path(given).rglob("*.nbc"))


@pytest.mark.parametrize("package", ["bicode_lab", "bicode_studies"])
def test_every_kernel_is_made_here(package: str) -> None:
    for path in sorted((ROOT / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if path.name not in ("kernels.py", "doctor.py"):
            assert "numba import njit" not in text, path
            assert "import numba as nb" not in text, path
            assert "numba.njit" not in text, path


def test_importing_the_package_imports_neither_numba_nor_numpy() -> None:
    script = "import bicode_lab, sys; print(sorted({'numba', 'numpy', 'cv2'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_the_public_names_are_there() -> None:
    import bicode_lab

    for name in bicode_lab.__all__:
        assert getattr(bicode_lab, name).__module__.startswith("bicode_lab.")
    with pytest.raises(AttributeError, match="nonsense"):
        _ = bicode_lab.nonsense
