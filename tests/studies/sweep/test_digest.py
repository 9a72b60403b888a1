"""The digest: another one for other code, the same one for other words."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path

import pytest

from bicode_studies.sweep import digest as module
from bicode_studies.sweep.digest import code_of, digest_of, normalise

ROOT = Path(__file__).resolve().parents[3]
FILES = {
    "__init__.py": '"""A package."""\n',
    "trial.py": '"""Trials."""\nfrom typing import TYPE_CHECKING\n\nfrom . import near\n'
    "from toy_trials.far.away import two\n\n"
    "if TYPE_CHECKING:\n    from toy_trials import words\n\n\n"
    'def trial(condition, seed):\n    """A trial."""\n    # adds\n    return near.one() + two()\n',
    "near.py": "def one():\n    return 1\n",
    "far/__init__.py": "SCALE = 2\n",
    "far/away.py": "def two():\n    from toy_trials.deep import three\n    return three() - 1",
    "deep.py": "def three():\n    return 3\n",
    "words.py": "WORDS = 1\n",
    "unused.py": "UNUSED = 1\n",
}


@pytest.fixture
def digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., str]]:
    """A function: a file of a package of trials, what to replace in it and by what in; the digest out."""
    folder = tmp_path / "toy_trials"
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    trial = importlib.import_module("toy_trials.trial").trial

    def make(file: str = "trial.py", old: str = "", new: str = "", data_files: tuple[str, ...] = ()) -> str:
        text = FILES[file]
        assert old in text
        (folder / file).write_text(text.replace(old, new) if old else text)
        digest_of.cache_clear()
        return digest_of(trial, data_files)

    yield make
    digest_of.cache_clear()
    for name in [name for name in sys.modules if name.startswith("toy_trials")]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("trial.py", "Trials.", "Trials, many of them."),
        ("trial.py", '    """A trial."""\n', ""),
        ("trial.py", "    # adds\n", ""),
        ("trial.py", "near.one() + two()", "(near.one()\n            + two())"),
        ("near.py", "    return 1", "    'says one'\n\n    return 1  # one"),
        ("unused.py", "UNUSED = 1", "UNUSED = 2"),
        ("words.py", "WORDS = 1", "WORDS = 2"),  # known to type checkers only
        ("__init__.py", "A package.", "The package."),
    ],
)
def test_other_words_are_the_same_code(digest: Callable[..., str], file: str, old: str, new: str) -> None:
    before = digest()
    assert digest(file, old, new) == before


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("trial.py", "+", "-"),
        ("near.py", "return 1", "return 1.0"),
        ("far/away.py", "- 1", "- 2"),
        ("far/__init__.py", "SCALE = 2", "SCALE = 3"),  # runs before its parts do
        ("deep.py", "return 3", "return 3 + 0"),  # imported inside a function, two steps away
        ("deep.py", "return 3", "'three'"),
    ],
)
def test_other_code_is_another_digest(digest: Callable[..., str], file: str, old: str, new: str) -> None:
    before = digest()
    assert digest(file, old, new) != before


def test_other_data_and_other_libraries_are_another_digest(
    digest: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tmp_path / "constants.json"
    data.write_text("1")
    first = digest(data_files=(str(data),))
    assert first != digest()
    data.write_text("2")
    assert digest(data_files=(str(data),)) != first
    before = digest()
    real = metadata.version
    monkeypatch.setattr(module.metadata, "version", lambda name: "0.0" if name == "numba" else real(name))
    assert digest() != before


def test_a_digest_is_of_the_time_the_code_was_loaded(digest: Callable[..., str], tmp_path: Path) -> None:
    """Not of a file that was edited since: a worker that has old code in its memory must not pass as new."""
    before = digest()
    (tmp_path / "toy_trials" / "near.py").write_text("def one():\n    return 100\n")
    assert digest_of(sys.modules["toy_trials.trial"].trial, ()) == before


def test_all_that_a_trial_loads_of_the_package_counts() -> None:
    """Against what Python itself has loaded after the import."""
    script = "import sys, bicode_studies.robustness.stressors\nprint(*[n for n in sys.modules if n.startswith('bicode_lab.')])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    import bicode_studies.robustness.stressors

    found = set(code_of(bicode_studies.robustness.stressors.__name__))
    loaded = set(done.stdout.split()) - {"bicode_lab._numba"}  # only throws compiled code away
    assert loaded <= found
    assert not {name for name in found if name.startswith(("bicode_studies.plots", "bicode_studies.cli"))}


def test_one_form_is_one_form() -> None:
    """Over every file of the package: the form of the form is the form, and no docstring is left in it."""
    for path in sorted((ROOT / "bicode_lab").rglob("*.py")):
        form = normalise(ast.parse(path.read_text(encoding="utf-8")))
        assert normalise(ast.parse(form)) == form
        assert '"""' not in form, path
