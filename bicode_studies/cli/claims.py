"""``bicode claims``: a verdict for each claim of the paper."""

from __future__ import annotations

import click

from bicode_studies.claims.beside_null import judge_beside_null, summary_line
from bicode_studies.claims.table import as_json, as_markdown, as_page, as_text, missing_line, read_claims, read_trials
from bicode_studies.cli.options import needs_repository
from bicode_studies.repository import repository_root

PAGE = "docs/claims.md"
README, README_LINE = "README.md", 2  # the third line of the file is the summary


@click.command()
@click.option(
    "--format", "form", type=click.Choice(["table", "json", "markdown"]), default="table", show_default=True,
    help="Format of the table.",
)  # fmt: skip
@click.option(
    "--quick",
    is_flag=True,
    help="Use the short trials in results/quick/: too few for a verdict, enough to test the command.",
)
@click.option("--write", is_flag=True, help=f"Also write the table to {PAGE} and the summary to {README}.")
@needs_repository()
def claims(form: str, quick: bool, write: bool) -> int:
    """Judge every claim of the paper by the trials of its figure, and by a null model beside them.

    Reads data/paper_claims.csv and the tables of trials in results/. If a table is missing, it names the command that
    makes it and ends with exit code 1.
    """
    if quick and write:
        raise click.UsageError(f"{PAGE} needs the trials at the paper's scale; leave out --quick")
    tables = read_trials(quick)
    judged = judge_beside_null(read_claims(), tables)
    click.echo({"table": as_text, "json": as_json, "markdown": as_markdown}[form](judged))
    if write:
        page = repository_root() / PAGE
        page.parent.mkdir(exist_ok=True)
        page.write_text(as_page(judged), encoding="utf-8")
        readme = repository_root() / README
        lines = readme.read_text(encoding="utf-8").split("\n")
        lines[README_LINE] = summary_line(judged)
        readme.write_text("\n".join(lines), encoding="utf-8")
        click.echo(f"written: {page} and the third line of {readme}", err=True)
    missing = missing_line(set(tables), quick)
    if missing:
        click.echo(f"bicode: {missing}", err=True)
    return 1 if missing else 0
