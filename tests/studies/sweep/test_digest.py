"""The digest changes with the code that results depend on, and with nothing else."""

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
from bicode_studies.sweep.digest import digest_of, module_digests, normalise

ROOT = Path(__file__).resolve().parents[3]
FILES = {
    "__init__.py": '"""A package."""\n',
    "trial.py": '"""Trials."""\nfrom typing import TYPE_CHECKING\n\nfrom . import near\n'
    "from toy_trials.far.away import two\nfrom toy_trials.shop import four\n\n"
    "if TYPE_CHECKING:\n    from toy_trials import words\n\n\n"
    'def trial(condition, seed):\n    """A trial."""\n    # adds\n    return near.one() + two() + four()\n',
    "near.py": "def one():\n    return 1\n",
    "shop/__init__.py": "from toy_trials.shop.goods import four\nfrom toy_trials.unused import UNUSED\n",
    "shop/goods.py": "def four():\n    return 4\n\n\ndef five():\n    return 5\n",
    "shop/sixes.py": "def four():\n    return 6\n",
    "far/__init__.py": "SCALE = 2\n",
    "far/away.py": "def two():\n    from toy_trials.deep import three\n    return three() - 1",
    "deep.py": "def three():\n    return 3\n",
    "words.py": "WORDS = 1\n",
    "unused.py": "UNUSED = 1\n",
}


@pytest.fixture
def digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., str]]:
    """Return a function that replaces a text in a file of a package of trials and returns the digest."""
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
        ("words.py", "WORDS = 1", "from toy_trials.trial import trial"),
        ("trial.py", "    from toy_trials import words\n", "    from toy_trials import words, unused\n"),
        ("trial.py", "if TYPE_CHECKING:\n    from toy_trials import words\n", ""),
        ("shop/__init__.py", "from toy_trials.unused import UNUSED\n", ""),
        ("shop/__init__.py", "UNUSED\n", "UNUSED\nfrom toy_trials.words import WORDS\n\n__all__ = ['four']\n"),
        ("trial.py", "toy_trials.shop import", "toy_trials.shop.goods import"),
        (
            "trial.py",
            "from . import near\nfrom toy_trials.far.away import two\n",
            "import toy_trials.near as near\nfrom .far.away import two\n",
        ),
        (
            "trial.py",
            "from toy_trials.far.away import two\nfrom toy_trials.shop import four\n",
            "from toy_trials.shop import four\nfrom toy_trials.far.away import two\n",
        ),
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
        ("shop/goods.py", "return 4", "return 5"),
        ("shop/__init__.py", "shop.goods", "shop.sixes"),
        ("trial.py", "toy_trials.shop import", "toy_trials.shop.sixes import"),
        ("trial.py", "toy_trials.shop import four", "toy_trials.shop.goods import five as four"),
        ("shop/__init__.py", "import four", "import five as four"),
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


def test_a_module_that_moves_and_gets_another_name_keeps_its_digest(digest: Callable[..., str], tmp_path: Path) -> None:
    before = digest()
    folder = tmp_path / "toy_trials"
    (folder / "near.py").rename(folder / "shop" / "beside.py")
    (folder / "deep.py").rename(folder / "shop" / "depths.py")
    away = (folder / "far" / "away.py").read_text().replace("toy_trials.deep", "toy_trials.shop.depths")
    (folder / "far" / "away.py").unlink()
    (folder / "far" / "distant.py").write_text(away)
    text = FILES["trial.py"].replace("from . import near", "from toy_trials.shop import beside as near")
    assert digest("trial.py", FILES["trial.py"], text.replace("far.away", "far.distant")) == before
    away = away.replace("- 1", "- 2")
    (folder / "far" / "distant.py").write_text(away)
    assert digest("trial.py", FILES["trial.py"], text.replace("far.away", "far.distant")) != before


def test_names_that_a_folder_loads_late_are_followed(digest: Callable[..., str], tmp_path: Path) -> None:
    before = digest()
    shop = tmp_path / "toy_trials" / "shop"
    (shop / "__init__.py").write_text("")
    (shop / "__init__.pyi").write_text("from .goods import four as four\n")
    assert digest("shop/__init__.py", FILES["shop/__init__.py"], "") == before
    (shop / "__init__.pyi").unlink()
    listed = "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from .goods import four\n"
    assert digest("shop/__init__.py", FILES["shop/__init__.py"], listed) == before
    with pytest.raises(ValueError, match="does not say where 'four' comes from"):
        digest("shop/__init__.py", FILES["shop/__init__.py"], "")


def test_a_trial_that_moves_keeps_its_digest(digest: Callable[..., str], tmp_path: Path) -> None:
    before = digest()
    (tmp_path / "toy_trials" / "far" / "unused.py").write_text("UNUSED = 1\n")
    (tmp_path / "toy_trials" / "moved.py").write_text(FILES["trial.py"])
    digest_of.cache_clear()
    moved = importlib.import_module("toy_trials.moved")
    assert digest_of(moved.trial, ()) == before
    moved.other = moved.trial
    moved.trial.__name__ = moved.trial.__qualname__ = "other"
    digest_of.cache_clear()
    assert digest_of(moved.trial, ()) != before


def test_data_files_count_by_their_bytes_and_their_own_name(digest: Callable[..., str], tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a/one.csv", "b/one.csv", "b/two.csv")]
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        path.write_text("1")
    one, other_folder, other_name = (digest(data_files=(str(path),)) for path in paths)
    assert one == other_folder != other_name


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("deep.py", "def", "from toy_trials.far import away\n\n\ndef",
         "circle, toy_trials.far.away -> toy_trials.deep -> toy_trials.far.away"),
        ("shop/__init__.py", "import four", "import five", "does not say where 'four' comes from"),
        ("trial.py", "toy_trials.shop import", "toy_trials.shopping import", "toy_trials.shopping has no file"),
    ],
)  # fmt: skip
def test_imports_that_cannot_be_followed_are_refused(
    digest: Callable[..., str], file: str, old: str, new: str, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        digest(file, old, new)


def test_a_digest_is_of_the_time_the_code_was_loaded(digest: Callable[..., str], tmp_path: Path) -> None:
    """A file that was edited since plays no part: a worker with old code in its memory must not pass as new."""
    before = digest()
    (tmp_path / "toy_trials" / "near.py").write_text("def one():\n    return 100\n")
    assert digest_of(sys.modules["toy_trials.trial"].trial, ()) == before


LOADED = """
import inspect, sys
from bicode_studies.robustness import stressors
ours = {name: module for name, module in sys.modules.items() if name.startswith(("bicode_lab.", "bicode_studies."))}
for name, module in ours.items():
    for value in vars(module).values():
        home = value.__name__ if inspect.ismodule(value) else getattr(value, "__module__", None)
        if home in ours:
            print(name, home)
"""


def test_all_that_a_trial_loads_of_the_package_counts() -> None:
    """Compare with what Python has loaded after the import: modules, and where each object in them was defined."""
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, cwd=ROOT, check=True)
    import bicode_studies.robustness.stressors

    found = set(module_digests(bicode_studies.robustness.stressors.__name__))
    uses = [line.split() for line in done.stdout.splitlines()]
    packages = {str(path.parent.relative_to(ROOT)).replace("/", ".") for path in ROOT.glob("bicode_*/**/__init__.py")}
    assert len(found) > 30
    for user, home in uses:
        assert user not in found or home in found, f"{user} uses {home}"
    # Whatever else was loaded is used by no module that counts: an __init__ names it for others.
    users = {home: {user for user, other in uses if other == home and user != home} for _, home in uses}
    for home in set(users) - found - packages:
        assert not users[home] & found
    assert not {name for name in found if name.startswith(("bicode_studies.plots", "bicode_studies.cli"))}


def test_one_form_is_one_form() -> None:
    """In every file of the module, the form of the form is the form, and no docstring is left in it."""
    for path in sorted((ROOT / "bicode_lab").rglob("*.py")):
        form = normalise(ast.parse(path.read_text(encoding="utf-8")))
        assert normalise(ast.parse(form)) == form
        assert '"""' not in form, path
