"""Docstrings are plain sentences, and public functions describe their parameters; ruff checks the first lines."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE = ROOT / "bicode_lab" / "fabrication" / "bicode_tx.py"  # numpydoc would fill the microcontroller's memory
FILES = sorted(p for name in ("bicode_lab", "bicode_studies") for p in (ROOT / name).rglob("*.py") if p != FIRMWARE)
FORMULA = re.compile(r"\bin[,;:]\s.*\bout\b|^Nothing\b", re.DOTALL)  # "events in, frames out"
FROM_PARAMETERS = 3  # a function with so many parameters has to describe them

each_file = pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))


def documented(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield the name and the docstring of the module and of everything in it that has one."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "name", "the module"), text


def is_kernel(function: ast.FunctionDef) -> bool:
    """Return True for a loop that numba compiles: a part of the function beside it, described in one sentence."""
    return any("njit" in ast.unparse(each) for each in function.decorator_list)


def public_functions(body: list[ast.stmt]) -> Iterator[ast.FunctionDef]:
    """Yield the public functions of a module and the public methods of its public classes."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public_functions(node.body)
        elif isinstance(node, ast.FunctionDef) and not (node.name.startswith("_") or is_kernel(node)):
            yield node


@each_file
def test_no_docstring_is_a_formula(path: Path) -> None:
    for name, text in documented(ast.parse(path.read_text(encoding="utf-8"))):
        assert not FORMULA.search(text.split("\n\n")[0]), f"{name}: say in a sentence what it does: {text[:80]!r}"


@each_file
def test_public_functions_describe_their_parameters(path: Path) -> None:
    if path.is_relative_to(ROOT / "bicode_studies" / "cli"):
        return  # the command line describes its options in their own help
    for function in public_functions(ast.parse(path.read_text(encoding="utf-8")).body):
        given = [
            each.arg for each in (*function.args.args, *function.args.kwonlyargs) if each.arg not in ("self", "cls")
        ]
        text = ast.get_docstring(function) or ""
        if len(given) >= FROM_PARAMETERS:
            assert re.search(r"^Parameters\n-+$|^Parameters are those of", text, re.MULTILINE), (
                f"{function.name} {given}"
            )


@pytest.mark.parametrize(
    "text", ["Events in, frames out.", "A scene and a seed in; its events out.", "Nothing in, 3 out."]
)
def test_the_check_knows_the_formula(text: str) -> None:
    assert FORMULA.search(text)
