"""One word, one meaning, and each word is bound to names that the code defines."""

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bicode_lab", "bicode_studies")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
ROWS = [
    [cell.strip() for cell in line.strip().strip("|").split(" | ")]
    for line in (ROOT / "GLOSSARY.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| **")
]
OF_THE_HOUSE = {
    "event", "polarity", "frame", "packet", "bit", "chip", "start", "payload", "checksum", "ID", "period", "region",
    "track", "recording", "trial", "accuracy",
}  # fmt: skip
NAME = re.compile(r"[A-Za-z_][\w.]*")


def defined_in(path: Path) -> tuple[set[str], set[str], set[str]]:
    """Return the names a file defines, its class members as ``Class.member``, and the words among its texts."""
    names, members, texts = set(), set(), set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg | ast.keyword):
            names.add(node.arg)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.id if isinstance(node, ast.Name) else node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        if isinstance(node, ast.ClassDef):
            inside = (each.target if isinstance(each, ast.AnnAssign) else each for each in node.body)
            members |= {f"{node.name}.{getattr(each, 'name', getattr(each, 'id', None))}" for each in inside}
    return names, members, texts


NAMES, MEMBERS, TEXTS = (set().union(*found) for found in zip(*map(defined_in, FILES), strict=True))
HOME = {path.stem: ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in FILES} | {
    path.parent.name: ".".join(path.parent.relative_to(ROOT).parts) for path in FILES if path.name == "__init__.py"
}


def words_of(row: list[str]) -> list[str]:
    return [word.strip() for word in re.sub(r"\*\*", "", row[0]).split(",")]


def is_qualified(text: str) -> bool:
    """Return whether a dotted name leads to something: a member of a class, or a name in a module of ours."""
    if text in MEMBERS:
        return True
    *path, name = text.split(".")
    candidates = [".".join((package, *path)) for package in PACKAGES]
    if len(path) == 1:
        candidates.append(HOME.get(path[0], ""))
    for module in filter(None, candidates):
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError:
            continue
        if hasattr(found, name) or HOME.get(name) == f"{module}.{name}":
            return True
    return False


def is_common(text: str) -> bool:
    """Return whether a name is only a word: one that could stand anywhere, such as ``start`` or ``track``."""
    return re.fullmatch(r"[a-z]+", text) is not None


def test_each_word_has_one_meaning() -> None:
    words = [word for row in ROWS for word in words_of(row)]
    assert len(words) > 80
    assert len(words) == len(set(words)), sorted({word for word in words if words.count(word) > 1})
    assert set(words) >= OF_THE_HOUSE


@pytest.mark.parametrize("row", ROWS, ids=lambda row: words_of(row)[0])
def test_each_word_has_a_meaning_and_is_bound_to_names_that_exist(row: list[str]) -> None:
    assert len(row) >= 3, "word | meaning | in the code | in the paper"
    assert row[1]
    named = [name for text in re.findall(r"`([^`]+)`", row[2]) if "/" not in text for name in NAME.findall(text)]
    assert named, "bind it to a name"
    for name in named:
        if "." in name:
            assert is_qualified(name), f"{name} leads to nothing"
        else:
            assert not is_common(name), f"{name} is a common word; say whose it is, such as Marker.{name}"
            assert name in NAMES | TEXTS, f"nothing in our packages is called {name}"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: words_of(row)[0])
def test_values_in_quotation_marks_are_values_in_the_code(row: list[str]) -> None:
    for value in re.findall(r'"([^"]+)"', f"{row[1]} {row[2]}"):
        assert value in TEXTS or " " in value, value
