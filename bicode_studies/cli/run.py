"""``bicode run`` and ``bicode figures``: notebooks, headless."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

quick_or_full = click.option(
    "--quick/--full", default=True, show_default=True, help="Short settings (seconds), or those of the paper (minutes)."
)


@click.command()
@click.argument("notebook")
@click.option("-p", "parameters", nargs=2, multiple=True, metavar="NAME VALUE", help="Change a parameter (repeatable).")
@quick_or_full
@click.option("--output", type=click.Path(path_type=Path), help="The executed copy  [default: build/notebooks/]")
@click.option(
    "--figures",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the figures  [default: figures/quick/; figures/ for --full without -p]",
)
def run(
    notebook: str, parameters: tuple[tuple[str, str], ...], quick: bool, output: Path | None, figures: Path | None
) -> int:
    """Run one NOTEBOOK (a path, or the start of a name: 02) with other parameters."""
    from bicode_studies.notebook.runner import NotebookError, find_notebooks, run_notebook

    path = Path(notebook)
    if path.suffix != ".ipynb":
        found = find_notebooks(notebook)
        if len(found) > 1:
            raise ValueError(f"{notebook!r} is the start of {', '.join(p.stem for p in found)}; give one of them")
        path = found[0]
    try:
        done = run_notebook(path, dict(parameters), output=output, quick=quick, figures=figures)
    except NotebookError as error:
        click.echo(f"bicode: {error}", err=True)
        return 1
    click.echo(f"{done.notebook.name}: {done.seconds:.1f} s, executed copy {_short(done.output)}")
    return 0


@click.command()
@quick_or_full
@click.option("--jobs", type=click.IntRange(min=1), help="Notebooks at a time  [default: the number of cores]")
@click.option("--only", default="", metavar="START", help="Only notebooks whose name starts so (02).")
def figures(quick: bool, jobs: int | None, only: str) -> int:
    """Run every notebook and write every figure: to figures/quick/, or with --full to figures/."""
    from bicode_studies.notebook.runner import default_figures, run_all

    folder = default_figures(quick)
    kept = _pictures(folder)
    runs = run_all(quick=quick, jobs=jobs or os.cpu_count() or 1, only=only)
    for done in runs:
        if done.error is None:
            click.echo(f"ok    {done.notebook.name}  {done.seconds:.1f} s")
        else:
            click.echo(f"FAIL  {done.error}", err=True)
    failed = sum(not done.succeeded for done in runs)
    written = sum(kept.get(name) != time for name, time in _pictures(folder).items())
    click.echo(f"{len(runs) - failed} of {len(runs)} notebooks ran; {written} figures written to {_short(folder)}")
    sys.stdout.flush()
    return 1 if failed else 0


def _pictures(folder: Path) -> dict[str, int]:
    """The figures in a folder, and when each was written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("fig_*.png")}


def _short(path: Path) -> Path:
    """A path as seen from here, where that is shorter."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
