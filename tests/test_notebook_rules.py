"""Every notebook keeps the rules that make one book of all notebooks."""

import ast
import json
import re
from pathlib import Path

import pytest

from bicode_studies.notebook.parameters import parameters_of

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
CHAPTERS = sorted(FOLDER.glob("*.ipynb"))
EVERY = sorted(path for path in FOLDER.rglob("*.ipynb") if ".ipynb_checkpoints" not in path.parts)

MOST_CELLS = 40
MOST_LINES_OF_CODE = 15
MOST_FUNCTIONS = 2
MOST_LINES_OF_FUNCTION = 10

HEAD = ("do", "learn", "need")
TAIL = ("On your own", "In practice", "Further reading")
PARAMETER_LINE = re.compile(r"[a-z][a-z0-9_]* = .+?  # \S.*")
SHARED = {"notebook", "plots", "score", "statistics", "trial"}
CHAPTERS_OF = {
    **{f"{number:02}": {"paper_experiments", "claims"} for number in range(8, 15)},
    "08": {"paper_experiments", "claims", "calibration", "link_budget"},
    "09": {"paper_experiments", "claims", "link_budget"},
    "15": {"what_if"},
    "16": {"link_budget"},
    "17": {"own_recording"},
    "18": {"real_light"},
    "19": {"calibration", "real_light"},
    "20": {"bench"},
    "21": {"robustness"},
}
NETWORK = {"requests", "urllib", "http", "httpx", "socket", "aiohttp", "urllib3"}

chapters = pytest.mark.parametrize("path", CHAPTERS, ids=lambda path: path.stem)
every = pytest.mark.parametrize("path", EVERY, ids=lambda path: str(path.relative_to(FOLDER).with_suffix("")))


def cells_of(path, kind):
    """Return the number (from 1) and the source of each cell of a kind."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [(i, "".join(cell["source"])) for i, cell in enumerate(cells, 1) if cell["cell_type"] == kind]


def prose_of(path):
    return "\n\n".join(source for _, source in cells_of(path, "markdown"))


def head_of(path):
    """Return the markdown above the first code cell."""
    first_code = min((i for i, _ in cells_of(path, "code")), default=10**6)
    return "\n\n".join(source for i, source in cells_of(path, "markdown") if i < first_code)


def has_heading(prose, words):
    """Return whether these words stand on a line of their own or in bold at the start of one."""
    return re.search(rf"(?im)^\s*(#+\s*\**|[-*]?\s*\*\*)\s*({words})\b", prose) is not None


@chapters
def test_the_name_is_a_number_and_a_verb_phrase(path):
    assert re.fullmatch(r"\d\d_[a-z]+(_[a-z0-9]+)+", path.stem), "NN_verb_phrase.ipynb"


def test_no_two_notebooks_share_a_number():
    numbers = [path.name[:2] for path in CHAPTERS]
    assert len(numbers) == len(set(numbers))


@every
def test_outputs_are_stripped(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    for number, cell in enumerate(document["cells"], 1):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [], f"cell {number} has outputs"
            assert cell["execution_count"] is None, f"cell {number} has an execution count"
    assert not {"papermill", "widgets"} & set(document["metadata"])


@every
def test_the_kernel_is_plain_python(path):
    metadata = json.loads(path.read_text(encoding="utf-8"))["metadata"]
    assert metadata["kernelspec"]["name"] == "python3"
    assert metadata["language_info"]["name"] == "python"


@every
def test_the_file_is_a_valid_notebook(path):
    import nbformat

    document = nbformat.read(path, as_version=4)
    nbformat.validate(document)
    ids = [cell.get("id") for cell in document.cells]
    assert None not in ids
    assert len(ids) == len(set(ids)), "two cells share an id"


@every
def test_the_first_code_cell_holds_the_parameters(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert "parameters" in code[0]["metadata"].get("tags", []), "tag the first code cell 'parameters'"
    for line in "".join(code[0]["source"]).splitlines():
        assert not line.strip() or PARAMETER_LINE.fullmatch(line), (
            f"{line!r}: write name_unit = literal  # meaning [unit]"
        )
    found = parameters_of(path)
    assert isinstance(found["quick"].default, bool)
    assert found["seed"].default == 0
    assert all(parameter.meaning for parameter in found.values())


@chapters
def test_the_head_promises(path):
    head = head_of(path)
    assert head.startswith("# "), "begin with the title"
    for word in HEAD:
        assert has_heading(head, rf"(you(['’]ll| will)?\s+)?{word}"), f"the head lacks **You will {word}**"
    assert re.search(r"\bFig\.|\bSection|\bSec\.|§|\b(I|II|III|IV|V)(-[A-E])?\b", head), (
        "name the paper's section or figure"
    )


@chapters
def test_the_tail_sends_on(path):
    prose = prose_of(path)
    for words in TAIL:
        assert has_heading(prose, words), f"the tail lacks **{words}**"


@chapters
def test_it_ends_with_an_exercise_and_a_check(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells]
    (asked,) = [i for i, source in enumerate(sources) if has_heading(source, "On your own")]
    behind = [
        source for cell, source in zip(cells[asked:], sources[asked:], strict=True) if cell["cell_type"] == "code"
    ]
    assert behind, "an answer to fill in"
    assert all("check_answer(" in source and "= ..." in source for source in behind), "only answers and their checks"


@chapters
def test_the_notebook_is_short(path):
    assert len(json.loads(path.read_text(encoding="utf-8"))["cells"]) <= MOST_CELLS
    for number, source in cells_of(path, "code"):
        lines = [line for line in source.splitlines() if line.strip()]
        assert len(lines) <= MOST_LINES_OF_CODE, f"cell {number} has {len(lines)} lines"


@chapters
def test_logic_lives_in_the_package(path):
    functions = [
        node
        for _, source in cells_of(path, "code")
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
    ]
    assert len(functions) <= MOST_FUNCTIONS
    for node in functions:
        assert node.end_lineno - node.lineno + 1 <= MOST_LINES_OF_FUNCTION, f"{node.name} is too long for a notebook"


@every
def test_code_is_plain_python_that_stays_on_this_machine(path):
    for number, source in cells_of(path, "code"):
        assert not re.search(r"(?m)^\s*[%!]", source), f"cell {number} has a magic or a shell command"
        assert "get_ipython" not in source, f"cell {number} asks for IPython"
        assert "sys.path" not in source, f"cell {number} changes sys.path"
        for node in ast.walk(ast.parse(source)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            reached = NETWORK & {name.split(".")[0] for name in names}
            assert not reached, f"cell {number} uses the network: {reached}"


@every
def test_it_imports_its_chapter_and_what_all_share(path):
    allowed = SHARED | CHAPTERS_OF.get(path.name[:2], set())
    code = "\n".join(source for _, source in cells_of(path, "code"))
    for module in re.findall(r"(?m)^from bicode_studies\.([\w.]+) import", code):
        top, _, inside = module.partition(".")
        assert top in allowed, module
        assert not inside or top not in ("notebook", "plots"), f"{module}: import from bicode_studies.{top}"


@chapters
def test_widgets_come_after_a_static_figure(path):
    code = cells_of(path, "code")
    widgets = [i for i, source in code if re.search(r"ipywidgets|\bwidgets\.|\binteract\b", source)]
    figures = [i for i, source in code if "save_figure(" in source or "plt." in source or "plots" in source]
    if widgets:
        assert figures
        assert min(widgets) > min(figures)


@chapters
def test_a_solution_answers_the_same_checks(path):
    solution = FOLDER / "solutions" / path.name
    if not solution.exists():
        pytest.skip("no solution yet")
    asked = [line for _, source in cells_of(path, "code") for line in source.splitlines() if "check_answer(" in line]
    answered = "\n".join(source for _, source in cells_of(solution, "code"))
    for line in asked:
        assert line.strip() in answered, "the solution runs another check"
