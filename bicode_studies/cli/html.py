"""``bicode html``: write every executed notebook as a page, and an index."""

from __future__ import annotations

import os
from pathlib import Path

import click

from bicode_studies.cli.options import needs_repository
from bicode_studies.cli.run import quick_or_full


@click.command()
@quick_or_full
@click.option(
    "--jobs", type=click.IntRange(min=1), help="How many notebooks run at a time.  [default: the number of cores]"
)
@click.option(
    "--only", default="", metavar="START", help="Run only the notebooks whose name starts with START, for example 02."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the pages.  [default: build/html/]",
)
@needs_repository()
def html(quick: bool, jobs: int | None, only: str, out: Path | None) -> int:
    """Run all notebooks and write them as HTML pages.

    The pages need neither Jupyter nor a network. The worked answers become pages, too. Begin with OUT/index.html.
    """
    from bicode_studies.notebook.pages import Entry, write_index, write_page
    from bicode_studies.notebook.runner import find_notebooks, run_paths
    from bicode_studies.repository import repository_root

    folder = (out or repository_root() / "build" / "html").resolve()
    executed = repository_root() / "build" / "notebooks"
    copies = {path: executed / path.name for path in find_notebooks(only)}
    answers = {path: path.parent / "solutions" / path.name for path in copies}
    copies |= {path: executed / "solutions" / path.name for path in answers.values() if path.is_file()}
    pages: dict[Path, Path] = {}
    failed = 0
    for done in run_paths(copies, quick=quick, jobs=jobs or os.cpu_count() or 1):
        if done.error is not None:
            failed += 1
            click.echo(f"FAIL  {done.error}", err=True)
            continue
        page = folder / done.output.relative_to(executed.resolve()).with_suffix(".html")
        write_page(done.output, page)
        pages[done.notebook.resolve()] = page
    entries = [
        Entry(notebook=path, page=pages.get(path.resolve()), solution=pages.get(answer.resolve()))
        for path, answer in answers.items()
    ]
    index = write_index(entries, folder)
    shown = index.relative_to(Path.cwd()) if index.is_relative_to(Path.cwd()) else index
    click.echo(f"{len(pages)} pages; open {shown}")
    return 1 if failed else 0
