"""Every notebook runs to its end with short settings, without a browser, and writes the figures of its number."""

import json
import re
from pathlib import Path

import pytest

from bicode_studies.notebook.runner import run_notebook

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
CHAPTERS = sorted(FOLDER.glob("[0-9][0-9]_*.ipynb"))
SOLUTIONS = sorted((FOLDER / "solutions").glob("*.ipynb"))
OF_THE_PAPER = range(1, 15)  # notebooks whose number is that of a figure they regenerate

pytestmark = pytest.mark.notebook


def said_by(cells):
    """Return all that the cells printed."""
    return "".join("".join(output.get("text", [])) for cell in cells for output in cell.get("outputs", []))


@pytest.mark.parametrize("path", CHAPTERS, ids=lambda path: path.stem)
def test_it_runs_and_writes_its_figures(path, tmp_path):
    figures = tmp_path / "figures"
    done = run_notebook(path, quick=True, output=tmp_path / path.name, figures=figures)
    cells = json.loads(done.output.read_text(encoding="utf-8"))["cells"]
    checks = sum("".join(cell["source"]).count("check_answer(") for cell in cells if cell["cell_type"] == "code")
    assert said_by(cells).count("not attempted yet") == checks, "an exercise that nobody tried says so"
    number = path.name[:2]
    pictures = sorted(figures.glob("fig_*.png"))
    if int(number) in OF_THE_PAPER:
        assert [p for p in pictures if p.name.startswith(f"fig_{number}_")], f"no fig_{number}_*.png was saved"
    for picture in pictures:
        assert picture.with_suffix(".csv").stat().st_size > 1
        record = json.loads(picture.with_suffix(".json").read_text(encoding="utf-8"))
        assert {"parameters", "seed", "versions"} <= set(record)


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_a_solution_is_correct(path, tmp_path):
    done = run_notebook(path, quick=True, output=tmp_path / path.name, figures=tmp_path / "figures")
    said = said_by(json.loads(done.output.read_text(encoding="utf-8"))["cells"])
    assert not re.search(r"(?m)^not (yet|attempted)", said), said
