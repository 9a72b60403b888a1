"""``bicode sweep``: run the trials of figures and print their accuracies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import pandas as pd

from bicode_studies.cli.options import needs_repository, parallel_options
from bicode_studies.paper_experiments.results import FIGURES, condition_fields, run_figure, write_results
from bicode_studies.repository import results_folder
from bicode_studies.statistics import over_seeds


@click.command(name="sweep")
@click.argument("figures", nargs=-1, required=True, metavar="FIGURE...")
@click.option("--quick/--full", default=True, show_default=True, help="The short grid, or the paper's scale.")
@parallel_options
@needs_repository()
def sweep_command(
    figures: tuple[str, ...], quick: bool, jobs: int | None, cluster: str | None, store: Path | None
) -> int:
    """Run the trials of FIGURE... (08 09 10 11 12 14, or all) and print their accuracies.

    The rows of all trials of a figure go to results/NN.csv; short ones (--quick) go to results/quick/NN.csv.

    Each finished trial is kept at once. If a run is stopped, the same command continues where it was. Trials are run
    again if the code they depend on has changed.
    """
    failed = False
    for figure in _chosen(figures):
        result = run_figure(figure, quick, jobs=jobs, cluster=cluster, store=store)
        if not result.table.empty:
            click.echo(f"Figure {int(figure)}\n{accuracies(result.table, condition_fields()).to_string(index=False)}\n")
        if result.failures:
            click.echo(f"bicode: {result.failure_line()}", err=True)
            failed = True
        else:
            write_results(figure, quick, result.table)
            click.echo(f"{results_folder(quick) / figure}.csv: {len(result.table)} rows written\n")
    return 1 if failed else 0


def _chosen(figures: tuple[str, ...]) -> list[str]:
    """Return the figures that were named, each once."""
    named = [figure.zfill(2) if figure.isdecimal() else figure for figure in figures]
    wrong = [figure for figure in named if figure not in (*FIGURES, "all")]
    if wrong:
        raise click.UsageError(f"no trials for figure {wrong[0]!r}; choose of {', '.join(FIGURES)}, or all")
    return list(dict.fromkeys(FIGURES if "all" in named else named))


def accuracies(table: pd.DataFrame, fields: Sequence[str]) -> pd.DataFrame:
    """Return seeds, periods and both accuracies of each condition.

    Parameters
    ----------
    table : DataFrame
        Rows of trials.
    fields : sequence of str
        Columns that tell conditions apart.
    """
    held = [name for name in (*fields, "receiver", "frame_rule_2d") if name in table]
    by = [name for name in held if name == "distance_m" or table[name].nunique() > 1]
    ids, plates = over_seeds(table, by), over_seeds(table, by, "marker_2d_right")
    return ids[[*by, "seeds", "periods"]].assign(ID=_in_words(ids), **{"2D": _in_words(plates)})


def _in_words(rows: pd.DataFrame) -> list[str]:
    """Return accuracy and interval of each row of `over_seeds` as text."""
    return [f"{a:.3f} ({low:.3f} .. {high:.3f})" for a, low, high in rows[["accuracy", "low", "high"]].to_numpy()]
