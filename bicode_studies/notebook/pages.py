"""Write executed notebooks as HTML pages that any browser shows, without a network and without running anything.

A page made by nbconvert alone loads four scripts from the network: one that typesets formulas, one for
diagrams, one for widgets and a loader for them. Here matplotlib draws the formulas into the page, there are
no diagrams, and a sentence replaces each widget.
"""

from __future__ import annotations

import base64
import html
import io
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nbformat import NotebookNode

TEMPLATE = """{%- extends 'lab/index.html.j2' -%}
{%- block html_head_js -%}{%- endblock -%}
{%- block html_head_js_mathjax -%}{%- endblock -%}
{%- block html_head_js_mermaidjs -%}{%- endblock -%}
{%- block jupyter_widgets -%}{%- endblock -%}
{%- block html_head_css -%}<style>.jp-InputArea-editor .highlight pre { white-space: pre-wrap }</style>{%- endblock -%}
"""
WIDGET = "application/vnd.jupyter.widget-view+json"
NO_WIDGET = "(There is a slider here when the notebook is open in JupyterLab: make lab)"
CODE_OR_FORMULA = re.compile(r"(?s)(```.*?```|`[^`\n]*`)|\$\$(.+?)\$\$|\$([^$\n]+?)\$")
LOCAL_NOTEBOOK = re.compile(r'href="((?![a-z]+:)[^"#]+)\.ipynb(#[^"]*)?"')
FORMULA_PT = 11.5
INDEX_STYLE = """
body { font: 17px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 3rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse }
td { padding: .6rem 1rem .6rem 0; vertical-align: top; border-top: 1px solid #ddd }
td:first-child, small { color: #777 }
td:nth-child(2) { min-width: 13rem }
a { color: #0060a0 }
"""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One line of the index page.

    Parameters
    ----------
    notebook : Path
        The notebook.
    page : Path or None
        Its page; None if the notebook failed.
    solution : Path or None
        The page of its worked answers, if there is one.
    """

    notebook: Path
    page: Path | None
    solution: Path | None = None


def write_page(executed: Path, page: Path) -> None:
    """Write an executed notebook as a page; links to other notebooks become links to their pages.

    Parameters
    ----------
    executed : Path
        The notebook with its outputs.
    page : Path
        The HTML file to write.
    """
    import nbformat
    from jinja2 import DictLoader
    from nbconvert import HTMLExporter

    notebook = nbformat.read(executed, as_version=4)
    _replace_formulas_and_widgets(notebook)
    logging.getLogger("traitlets").setLevel(logging.ERROR)  # it warns of every picture without a description
    exporter = HTMLExporter(extra_loaders=[DictLoader({"page.html.j2": TEMPLATE})], template_file="page.html.j2")
    body, _ = exporter.from_notebook_node(notebook, {"metadata": {"name": title_and_promise(executed)[0]}})
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(LOCAL_NOTEBOOK.sub(r'href="\1.html\2"', body), encoding="utf-8")


def write_index(entries: Sequence[Entry], folder: Path) -> Path:
    """Write ``index.html``: one line with title and promise for every notebook.

    Parameters
    ----------
    entries : sequence of Entry
        The lines, in their order.
    folder : Path
        The folder of the pages.

    Returns
    -------
    Path
        The index page.
    """
    rows = []
    for entry in entries:
        title, promise = title_and_promise(entry.notebook)
        name = html.escape(title)
        if entry.page is not None:
            name = f'<a href="{entry.page.relative_to(folder).as_posix()}">{name}</a>'
        else:
            name += " (did not run)"
        if entry.solution is not None:
            answers = entry.solution.relative_to(folder).as_posix()
            name += f'<br><small><a href="{answers}">worked answers</a></small>'
        rows.append(
            f"<tr><td>{entry.notebook.name[:2]}<td>{name}<td>{CODE_OR_FORMULA.sub(_draw, html.escape(promise))}</tr>"
        )
    index = folder / "index.html"
    folder.mkdir(parents=True, exist_ok=True)
    index.write_text(
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>bicode_lab</title><style>{INDEX_STYLE}</style></head><body>\n<h1>bicode_lab</h1>\n"
        "<p>These pages show every notebook after a run. To change and run them yourself, "
        "clone the repository and type <code>make lab</code>.</p>\n<table>\n"
        + "\n".join(rows)
        + "\n</table></body></html>\n",
        encoding="utf-8",
    )
    return index


def title_and_promise(notebook: Path) -> tuple[str, str]:
    """Return the title of a notebook, and the first paragraph below it as plain text.

    Parameters
    ----------
    notebook : Path
        The notebook.

    Returns
    -------
    tuple of (str, str)
        Title and promise. Formulas stay in TeX.
    """
    import nbformat

    first = nbformat.read(notebook, as_version=4).cells[0].source
    title, _, below = first.lstrip("# ").partition("\n")
    promise = " ".join(below.strip().split("\n\n")[0].split()).removeprefix("One promise: ")
    promise = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", promise).replace("`", "").replace("*", "")
    return title.strip(), promise[:1].upper() + promise[1:]


def formula_picture(formula: str) -> str:
    """Draw a formula as an image for HTML.

    Parameters
    ----------
    formula : str
        TeX, without the dollar signs.

    Returns
    -------
    str
        An ``<img>`` element that holds the picture and has the TeX as its description; if matplotlib cannot draw the
        formula, the TeX itself as ``<code>``.
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import math_to_image

    drawn = io.BytesIO()
    try:
        depth_pt = math_to_image(f"${formula}$", drawn, dpi=72, format="svg", prop=FontProperties(size=FORMULA_PT))
    except ValueError:  # more TeX than matplotlib knows
        return f"<code>{html.escape(formula)}</code>"
    source = base64.b64encode(drawn.getvalue()).decode()
    style = f"display:inline; vertical-align:-{depth_pt:g}pt; margin:0"
    return f'<img alt="{html.escape(formula)}" style="{style}" src="data:image/svg+xml;base64,{source}">'


def _replace_formulas_and_widgets(notebook: NotebookNode) -> None:
    """Replace the formulas of a notebook by pictures and its widgets by a sentence, in place."""
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = CODE_OR_FORMULA.sub(_draw, cell.source)
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if data.pop(WIDGET, None) is not None:
                data["text/plain"] = NO_WIDGET
            if "text/markdown" in data:
                data["text/markdown"] = CODE_OR_FORMULA.sub(_draw, data["text/markdown"])
    notebook.metadata.pop("widgets", None)


def _draw(found: re.Match[str]) -> str:
    """Return code unchanged and a formula as a picture."""
    code, displayed, inline = found.groups()
    if code is not None:
        return str(code)
    if displayed is not None:
        return f'<p style="text-align:center">{formula_picture(displayed.strip())}</p>'
    return formula_picture(inline)
