"""Notebooks that are made for one test."""

from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest

MakeNotebook = Callable[..., Path]


@pytest.fixture
def make_notebook(tmp_path: Path) -> MakeNotebook:
    """Return a function that writes a notebook of the given code cells; the first holds its parameters."""

    def make(*cells: str, name: str = "02_try_things.ipynb", tag: str = "parameters") -> Path:
        node = nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell("# Try things")])
        node.cells += [nbformat.v4.new_code_cell(source) for source in cells]
        node.cells[1].metadata["tags"] = [tag]
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        nbformat.write(node, path)
        return path

    return make
