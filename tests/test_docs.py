"""The documentation builds, holds every public name, needs no network to be read and has no dead links."""

from __future__ import annotations

import importlib
import pkgutil
import re
import shlex
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import click
import pytest

from bicode_studies.cli.main import cli
from bicode_studies.notebook.parameters import parameters_of

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / "build" / "docs"  # where `make docs` writes the pages; links to the repository start from there
WRITTEN = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")), ROOT / "data" / "README.md"]


class Links(HTMLParser):
    """Collect what a page links to, what it fetches and which anchors it has."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {name: value or "" for name, value in attrs}
        self.anchors |= {named[name] for name in ("id", "name") if name in named}
        if tag == "a" and "href" in named:
            self.links.append(named["href"])
        elif tag != "a":
            self.fetched += [named[name] for name in ("src", "href") if name in named]


Pages = dict[Path, Links]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Pages:
    """Build the documentation; any warning is an error. Pages are named as in `SITE`."""
    folder = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(folder)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    return {SITE / page.relative_to(folder): Links(page) for page in folder.rglob("*.html") if page.name != "404.html"}


def packages() -> list[str]:
    """Return the names of both packages and of all packages inside them."""
    names = ["bicode_lab", "bicode_studies"]
    for name in tuple(names):
        path = importlib.import_module(name).__path__
        names += [found.name for found in pkgutil.iter_modules(path, f"{name}.") if found.ispkg]
    return names


@pytest.mark.slow
def test_every_public_name_is_in_the_reference(pages: Pages) -> None:
    for package in packages():
        page = pages[SITE / "reference" / f"{package}.html"]
        for name in getattr(importlib.import_module(package), "__all__", ()):
            passed_on = [link for link in page.links if re.search(rf"#[\w.]*\.{name}$", link)]
            assert f"{package}.{name}" in page.anchors or passed_on, f"{package}.{name}"


@pytest.mark.slow
def test_the_first_page_leads_to_every_package(pages: Pages) -> None:
    assert {f"reference/{package}.html" for package in packages()} <= set(pages[SITE / "index.html"].links)


@pytest.mark.slow
def test_every_module_of_a_study_is_in_the_reference(pages: Pages) -> None:
    anchors = set().union(*(page.anchors for page in pages.values()))
    for path in sorted((ROOT / "bicode_studies").glob("[a-z]*/[a-z]*.py")):
        package = f"bicode_studies.{path.parent.name}"
        assert f"{package}.{path.stem}" in anchors or hasattr(importlib.import_module(package), "__all__"), path


@pytest.mark.slow
def test_no_link_of_a_page_is_dead(pages: Pages) -> None:
    for path, page in pages.items():
        for link in page.links:
            target, _, anchor = unquote(link).partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            leads_to = Path(*(path.parent / target).parts).resolve() if target else path
            if leads_to.is_relative_to(SITE):
                assert leads_to in pages, f"{path.name}: {link}"
                assert not anchor or anchor in pages[leads_to].anchors, f"{path.name}: {link}"
            else:
                assert leads_to.exists(), f"{path.name}: {link}"


@pytest.mark.slow
def test_pages_fetch_nothing_from_a_network(pages: Pages) -> None:
    for path, page in pages.items():
        assert not [each for each in page.fetched if re.match(r"(https?:)?//", each)], path.name


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_link_of_a_document_is_dead(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    prose = re.sub(r"(?s)```.*?```|`[^`\n]*`", "", text)
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", prose):
        if re.match(r"[a-z]+:", target):
            continue
        leads_to = (path.parent / target).resolve() if target else path
        if leads_to.parent == ROOT / "docs" / "reference":
            continue  # made by `make docs`; the links of built pages are followed above
        assert leads_to.exists(), target
        if anchor and leads_to.suffix == ".md":
            headings = re.findall(r"(?m)^#+ (.*)$", leads_to.read_text(encoding="utf-8"))
            assert anchor in {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}, anchor


def test_every_command_is_described_and_its_examples_have_options_that_exist() -> None:
    text = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"(?ms)^## bicode ([\w-]+)$(.*?)(?=^## |\Z)", text))
    context = click.Context(cli)
    assert set(sections) == set(cli.list_commands(context))
    for name, section in sections.items():
        assert f"<!-- help: {name} -->" in section
        command = cli.get_command(context, name)
        assert command is not None
        known = {option for each in command.params for option in (*each.opts, *each.secondary_opts)}
        for example in re.findall(r"(?m)^bicode .*$", section):
            words = shlex.split(example)
            assert words[1] == name
            assert {word for word in words if re.match(r"-[-a-z]", word)} <= known, example


def test_parameters_in_examples_are_those_of_the_notebook() -> None:
    """Each ``-p NAME`` behind ``bicode run NOTEBOOK`` in README, docs and notebook 00 is a parameter of it."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "notebooks" / "00_start_here.ipynb"]
    found = 0
    for page in pages:
        for notebook, words in re.findall(
            r"bicode run ((?:notebooks/)?\d\d\w*(?:\.ipynb)?)([^\n`#|]*)", page.read_text(encoding="utf-8")
        ):
            (path,) = (ROOT / "notebooks").glob(f"{Path(notebook).stem}*.ipynb")
            known = parameters_of(path)
            for name in re.findall(r"-p (\w+)", words):
                found += 1
                assert name in known, f"{page.name}: {path.name} has no parameter {name}"
    assert found >= 5
