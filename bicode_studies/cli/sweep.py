"""``bicode sweep``: figures in; their trials, run where they are missing, and the accuracies out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import pandas as pd

from bicode_studies.paper_experiments.figure_table import FIGURES, STORE, condition_fields, figure_sweep
from bicode_studies.statistics import over_seeds


@click.command(name="sweep")
@click.argument("figures", nargs=-1, required=True, metavar="FIGURE...")
@click.option("--quick/--full", default=True, show_default=True, help="The short grid, or the paper's scale.")
@click.option("--jobs", type=click.IntRange(min=1), help="Trials at a time  [default: BICODE_JOBS, or the cores]")
@click.option("--cluster", metavar="ADDRESS", help="Run on the Dask scheduler there (tcp://HOST:8786).")
@click.option(
    "--store",
    type=click.Path(dir_okay=False, path_type=Path),
    help=f"Where finished trials are kept  [default: {STORE} of the repository]",
)
def sweep_command(
    figures: tuple[str, ...], quick: bool, jobs: int | None, cluster: str | None, store: Path | None
) -> int:
    """Run the trials of FIGURE... (08 09 10 11 12 14, or all) and print their accuracies.

    Each finished trial is kept at once; stopped at any moment, the same command goes on where it was. Trials are run
    again where the code they depend on has changed.
    """
    failed = False
    for figure in _chosen(figures):
        result = figure_sweep(figure, quick, jobs=jobs, cluster=cluster, store=store)
        if not result.table.empty:
            click.echo(f"Figure {int(figure)}\n{accuracies(result.table, condition_fields()).to_string(index=False)}\n")
        if result.failures:
            click.echo(f"bicode: {result.failure_line()}", err=True)
            failed = True
    return 1 if failed else 0


def _chosen(figures: tuple[str, ...]) -> list[str]:
    """Words in, figures out, each once."""
    named = [figure.zfill(2) if figure.isdecimal() else figure for figure in figures]
    wrong = [figure for figure in named if figure not in (*FIGURES, "all")]
    if wrong:
        raise click.UsageError(f"no trials for figure {wrong[0]!r}; choose of {', '.join(FIGURES)}, or all")
    return list(dict.fromkeys(FIGURES if "all" in named else named))


def accuracies(table: pd.DataFrame, fields: Sequence[str]) -> pd.DataFrame:
    """Rows of trials and the names of a condition's fields in; seeds, periods and both accuracies of each, out."""
    held = [name for name in (*fields, "receiver", "frame_rule_2d") if name in table]
    by = [name for name in held if name == "distance_m" or table[name].nunique() > 1]
    ids, plates = over_seeds(table, by), over_seeds(table, by, "marker_2d_right")
    return ids[[*by, "seeds", "periods"]].assign(ID=_told(ids), **{"2D": _told(plates)})


def _told(rows: pd.DataFrame) -> list[str]:
    """Rows of `over_seeds` in, accuracy and interval in words out."""
    return [f"{a:.3f} ({low:.3f} .. {high:.3f})" for a, low, high in rows[["accuracy", "low", "high"]].to_numpy()]
