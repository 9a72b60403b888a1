"""``bicode run`` and ``bicode figures``: run notebooks without a browser."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.helpers.progress import waiting
from bicode_studies.cli.options import needs_repository

if TYPE_CHECKING:
    from bicode_studies.notebook.runner import NotebookRun

quick_or_full = click.option(
    "--quick/--full",
    default=True,
    show_default=True,
    help="Use short settings (seconds) or those of the paper (minutes).",
)


@click.command()
@click.argument("notebook")
@click.option(
    "-p",
    "parameters",
    nargs=2,
    multiple=True,
    metavar="NAME VALUE",
    help="Change a parameter. May be given several times.",
)
@quick_or_full
@click.option(
    "--output", type=click.Path(path_type=Path), help="Path of the executed copy.  [default: in build/notebooks/]"
)
@click.option(
    "--figures",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the figures.  [default: figures/quick/; figures/ with --full and without -p]",
)
@force_option
def run(
    notebook: str,
    parameters: tuple[tuple[str, str], ...],
    quick: bool,
    output: Path | None,
    figures: Path | None,
    force: bool,
) -> int:
    """Run one NOTEBOOK with other parameters.

    NOTEBOOK is a path or the start of a name, such as 02.
    """
    from bicode_studies.notebook.runner import NotebookError, find_notebooks, run_notebook

    if output is not None:
        refuse_existing([output], force)
    path = Path(notebook)
    if path.suffix != ".ipynb":
        found = find_notebooks(notebook)
        if len(found) > 1:
            raise ValueError(f"{notebook!r} is the start of {', '.join(p.stem for p in found)}; give one of them")
        path = found[0]
    try:
        with waiting(f"running {path.name}"):
            done = run_notebook(path, dict(parameters), output=output, quick=quick, figures=figures)
    except NotebookError as error:
        click.echo(f"bicode: {error}", err=True)
        return 1
    click.echo(f"{done.notebook.name}: {done.seconds:.1f} s, executed copy {_short(done.output)}")
    return 0


@click.command()
@quick_or_full
@click.option(
    "--jobs", type=click.IntRange(min=1), help="How many notebooks run at a time.  [default: the number of cores]"
)
@click.option(
    "--only", default="", metavar="START", help="Run only the notebooks whose name starts with START, for example 02."
)
@click.option("--times", is_flag=True, help="Write run times to results/run_times.csv and into README.md.")
@needs_repository()
def figures(quick: bool, jobs: int | None, only: str, times: bool) -> int:
    """Run all notebooks and write all figures.

    Figures go to figures/quick/, or with --full to figures/.
    """
    from bicode_studies.notebook.runner import default_figures, run_all

    folder = default_figures(quick)
    kept = _pictures(folder)
    runs = run_all(quick=quick, jobs=jobs or os.cpu_count() or 1, only=only)
    for done in runs:
        if done.error is None:
            click.echo(f"ok    {done.notebook.name}  {done.seconds:.1f} s")
        else:
            click.echo(f"FAIL  {done.error}", err=True)
    if times:
        _keep_times(runs, quick)
    failed = sum(not done.succeeded for done in runs)
    written = sum(kept.get(name) != time for name, time in _pictures(folder).items())
    click.echo(f"{len(runs) - failed} of {len(runs)} notebooks ran; {written} figures written to {_short(folder)}")
    sys.stdout.flush()
    return 1 if failed else 0


def _keep_times(runs: list[NotebookRun], quick: bool) -> None:
    """Enter the run times into their table and into the README."""
    from bicode_studies.notebook.run_times import read_run_times, with_minutes, write_run_times
    from bicode_studies.repository import repository_root, results_folder

    table = results_folder() / "run_times.csv"
    write_run_times(table, runs, quick)
    readme = repository_root() / "README.md"
    if readme.is_file():
        readme.write_text(with_minutes(readme.read_text(encoding="utf-8"), read_run_times(table)), encoding="utf-8")


def _pictures(folder: Path) -> dict[str, int]:
    """Return the figures in a folder, and when each was written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("fig_*.png")}


def _short(path: Path) -> Path:
    """Return a path relative to the working directory if it lies below it."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
