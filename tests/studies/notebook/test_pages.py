"""Pages of executed notebooks fetch nothing from a network, and link to each other."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import nbformat
import pytest
from matplotlib.mathtext import MathTextParser

from bicode_studies.cli.main import main
from bicode_studies.notebook.pages import (
    NO_WIDGET,
    WIDGET,
    Entry,
    formula_picture,
    title_and_promise,
    write_index,
    write_page,
)

FOLDER = Path(__file__).resolve().parents[3] / "notebooks"
HEAD = "# Try things\n\nOne promise: you *try* `things` in $\\Delta t$, see [it](00_map.ipynb).\n\n**You will** do."
TEXT = "Where $m = e^{-\\lambda}$, twice:\n\n$$P = (1 - m)^{2n}$$\n\nIn code, `cost = $5` and `price = $6` stay."
LINKS = "[next](03_more.ipynb), [answers](solutions/02_try.ipynb#top), [code](https://example.org/a.ipynb)"
PARAMETERS = "quick = True  # short settings\nseed = 0  # chance"


class Loaded(HTMLParser):
    """Collect what a browser would fetch to show a page, and where its links lead."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.alts: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {name: value or "" for name, value in attrs}
        if tag == "a":
            self.links.append(named.get("href", ""))
        else:
            self.fetched += [named[name] for name in ("src", "href", "data", "poster", "srcset") if name in named]
        if tag == "img":
            self.alts.append(named.get("alt", ""))

    def handle_data(self, data: str) -> None:
        self.text += data


def loaded(page: Path) -> Loaded:
    parser = Loaded()
    source = page.read_text(encoding="utf-8")
    parser.feed(source)
    parser.fetched += re.findall(r"@import\s+[\"']?([^\"';]+)", source)
    parser.fetched += re.findall(r"url\([\"']?((?!data:|#)[^)\"']+)", source)
    parser.fetched += re.findall(r"\bimport\([\"']([^\"']+)|\bfrom\s+[\"'](https?:[^\"']+)", source)
    return parser


@pytest.fixture
def executed(tmp_path: Path) -> Path:
    """Write a notebook as a run leaves it, with formulas, links and a slider."""
    cell = nbformat.v4.new_code_cell("interact(show)")
    slider = {WIDGET: {"model_id": "1"}, "text/plain": "interactive(...)"}
    cell.outputs = [nbformat.v4.new_output("display_data", data=slider)]
    node = nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(text) for text in (HEAD, TEXT, LINKS)])
    node.cells.append(cell)
    node.metadata["widgets"] = {"application/vnd.jupyter.widget-state+json": {"state": {}, "version_major": 2}}
    path = tmp_path / "02_try.ipynb"
    nbformat.write(node, path)
    return path


def test_a_page_fetches_nothing(executed: Path, tmp_path: Path) -> None:
    write_page(executed, tmp_path / "html" / "02_try.html")
    found = loaded(tmp_path / "html" / "02_try.html")
    assert [each for each in found.fetched if not each.startswith("data:")] == []
    assert "Try things" in found.text


def test_formulas_are_pictures_with_their_tex_and_code_is_left_alone(executed: Path, tmp_path: Path) -> None:
    write_page(executed, tmp_path / "a.html")
    found = loaded(tmp_path / "a.html")
    assert [alt for alt in found.alts if alt] == [r"\Delta t", r"m = e^{-\lambda}", "P = (1 - m)^{2n}"]
    assert "cost = $5" in found.text
    assert "price = $6" in found.text


def test_links_lead_to_pages_and_those_elsewhere_are_left_alone(executed: Path, tmp_path: Path) -> None:
    write_page(executed, tmp_path / "a.html")
    links = loaded(tmp_path / "a.html").links
    assert {"03_more.html", "solutions/02_try.html#top", "https://example.org/a.ipynb"} <= set(links)


def test_a_slider_becomes_a_sentence(executed: Path, tmp_path: Path) -> None:
    write_page(executed, tmp_path / "a.html")
    text = loaded(tmp_path / "a.html").text
    assert NO_WIDGET in text
    assert "interactive(" not in text


def test_a_formula_that_cannot_be_drawn_stays_tex() -> None:
    assert formula_picture(r"\begin{matrix}a\end{matrix}") == r"<code>\begin{matrix}a\end{matrix}</code>"


def test_every_formula_of_the_notebooks_can_be_drawn() -> None:
    parser = MathTextParser("path")
    for path in FOLDER.rglob("[0-9]*.ipynb"):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            prose = re.sub(r"(?s)```.*?```|`[^`\n]*`", "", "".join(cell["source"]))
            if cell["cell_type"] == "markdown":
                for formula in re.findall(r"\$\$?([^$]+)\$\$?", prose):
                    parser.parse(f"${formula.strip()}$")


def test_title_and_promise_are_plain_text(executed: Path) -> None:
    assert title_and_promise(executed) == ("Try things", r"You try things in $\Delta t$, see it.")


def test_the_index_names_every_notebook_and_says_which_did_not_run(executed: Path, tmp_path: Path) -> None:
    page = tmp_path / "html" / "02_try.html"
    write_page(executed, page)
    index = write_index([Entry(notebook=executed, page=page), Entry(notebook=executed, page=None)], tmp_path / "html")
    found = loaded(index)
    assert found.links == ["02_try.html"]
    assert "did not run" in found.text
    assert found.alts == [r"\Delta t"] * 2
    assert all(each.startswith("data:") for each in found.fetched)


@pytest.mark.notebook
def test_the_command_runs_notebooks_and_answers_and_goes_on_after_a_failure(
    make_notebook, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bicode_lab").mkdir()
    make_notebook(PARAMETERS, "print('one and', quick)", name="notebooks/02_try_things.ipynb")
    make_notebook(PARAMETERS, "print('an answer')", name="notebooks/solutions/02_try_things.ipynb")
    make_notebook(PARAMETERS, "raise SystemError('broken')", name="notebooks/03_fail.ipynb")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["html", "--jobs", "1"])
    assert ended.value.code == 1
    said = capsys.readouterr()
    assert "2 pages; open build/html/index.html" in said.out
    assert "03_fail.ipynb" in said.err
    pages = tmp_path / "build" / "html"
    assert "one and True" in loaded(pages / "02_try_things.html").text
    assert "an answer" in loaded(pages / "solutions" / "02_try_things.html").text
    index = loaded(pages / "index.html")
    assert index.links == ["02_try_things.html", "solutions/02_try_things.html"]
    assert "did not run" in index.text
