"""``bicode stress``: damage recordings step by step and count what each receiver still reads."""

from __future__ import annotations

from pathlib import Path

import click

from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.options import needs_repository, parallel_options
from bicode_studies.repository import results_folder
from bicode_studies.robustness.receiver_ranges import receiver_ranges
from bicode_studies.robustness.stressors import stress as stress_trial
from bicode_studies.robustness.stressors import stress_conditions, stress_curves
from bicode_studies.sweep.sweep import sweep_to_csv

SEEDS = 20


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=SEEDS, show_default=True, help="Recordings of each condition.")
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File of the table.  [default: results/stress.csv, with fewer seeds results/quick/stress.csv]",
)
@force_option
@parallel_options
@needs_repository("out", "store")
def stress(
    seeds: int, out: Path | None, jobs: int | None, cluster: str | None, store: Path | None, force: bool
) -> None:
    """Degrade recordings step by step, and count the periods that each receiver still reads.

    Events are dropped, added, shifted and saturated, and the distance is increased. Each finished trial is kept at
    once. If a run is stopped, the same command continues where it was; trials of changed code are run again. The table
    is written at the end. Recordings use the seeds 0, 1, 2, ...; with --seeds 5 only the first five of each condition
    are used.
    """
    if out is not None:
        refuse_existing([out], force)
    trials = [(condition, seed) for seed in range(seeds) for condition in stress_conditions()]
    path = out or results_folder(quick=seeds < SEEDS) / "stress.csv"
    try:
        table = sweep_to_csv(stress_trial, trials, path, jobs=jobs, cluster=cluster, store=store)
    except RuntimeError as error:
        raise click.ClickException(str(error)) from None
    summary = stress_curves(table)
    click.echo(summary.drop(columns="distance_m").to_string(index=False, float_format="%.3g"))
    click.echo()
    click.echo(receiver_ranges(table).to_string(index=False, float_format="%.3g"))
