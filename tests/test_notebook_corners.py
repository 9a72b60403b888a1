"""A value at the edge of what a reader may type ends in a result or in words, and constants come from their file."""

import ast
import json
import re
from pathlib import Path

import pytest

from bicode_lab.constants import all_constants
from bicode_studies.notebook.runner import run_notebook

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"

CORNERS = [
    ("01", {"near_m": 10.0, "far_m": 10.0}, r"10"),
    ("02", {"delta_t_2d_us": 100}, r"no 2D marker is recognised\nin a frame of 0\.1 ms"),
    ("02", {"delta_t_blinker_us": 100, "delta_t_2d_us": 100}, r"no 2D marker is recognised"),
    ("05", {"delta_t_whole_us": 10_000}, r"\*\*0 in 100%\*\*"),
    ("05", {"f_id_hz": 3000.0}, r"\*\*6 in \d+%\*\*, \*\*7 in \d+%\*\*"),
    ("06", {"distance_m": 40.0}, r"at 40 m, no clock error has 95 % of its packets read"),
]
"""Notebook, parameters, and what the pages have to say then."""

OF_CONSTANTS = {"infrared_share", "led_to_ambient", "infrared_led_to_ambient", "edge_glow"}
"""Settings of the camera whose values stand in the file of constants."""

ALLOWED = {0.0, all_constants()["infrared_share_office"].low}
"""Values that may be typed: an effect switched off; the lower end of the office, lamps alone (notebook 11)."""


def said_by(cells):
    """Return all that the cells print and display as text."""
    said = []
    for output in (output for cell in cells for output in cell.get("outputs", [])):
        shown = output.get("data", {})
        said += [output.get("text", []), shown.get("text/plain", []), shown.get("text/markdown", [])]
    return "\n".join("".join(text) for text in said)


@pytest.mark.notebook
@pytest.mark.parametrize(
    ("number", "values", "words"), CORNERS, ids=[f"{number}-{'-'.join(values)}" for number, values, _ in CORNERS]
)
def test_a_corner_ends_in_a_result_or_in_words(number, values, words, tmp_path):
    (path,) = FOLDER.glob(f"{number}_*.ipynb")
    done = run_notebook(path, values, output=tmp_path / path.name, figures=tmp_path / "figures")
    said = said_by(json.loads(done.output.read_text(encoding="utf-8"))["cells"])
    assert re.search(words, said)
    assert not re.search(r"\bnan (%|times)|\*\*-\d+ in", said), "neither a missing number nor a negative count"


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("[0-9][0-9]_*.ipynb")), ids=lambda path: path.stem)
def test_constants_come_from_their_file(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    for cell in (cell for cell in cells if cell["cell_type"] == "code"):
        for node in ast.walk(ast.parse("".join(cell["source"]))):
            names = [target.id for target in getattr(node, "targets", []) if isinstance(target, ast.Name)]
            if isinstance(node, ast.keyword) and node.arg is not None:
                names = [node.arg]
            value = getattr(node, "value", None)
            for name in names if isinstance(value, ast.Constant) else []:
                if any(name.endswith(constant) for constant in OF_CONSTANTS):
                    assert value.value in ALLOWED, (
                        f"{name}={value.value} is typed here; use bicode_lab.constants.constant"
                    )
