"""``bicode name-lights``: name lights of known kinds, and count how often the name is right."""

from __future__ import annotations

from pathlib import Path

import click

from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.options import needs_repository, parallel_options
from bicode_studies.light_kinds.table import CONFUSION, SEEDS, TABLE, confusion, make_table
from bicode_studies.repository import results_folder


@click.command(name="name-lights")
@click.option("--seeds", type=click.IntRange(1), help=f"Lights of each kind, rate and strength.  [default: {SEEDS}]")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the tables.  [default: results, with other seeds results/quick]",
)
@force_option
@parallel_options
@needs_repository("out", "store")
def name_lights(
    seeds: int | None, out: Path | None, jobs: int | None, cluster: str | None, store: Path | None, force: bool
) -> None:
    """Name lights of known kinds from 50 ms of their events, and count how often the name is right.

    The lights are lamps on the mains, dimmers, LEDs of constant frequency, Bicode, UART and the interval code, at many
    rates; they are seen by pixels with other settings for each light, at 1 to 300 events an edge, and by the project's
    camera at several distances. Each finished trial is kept at once.
    """
    if out is not None:
        refuse_existing([out / TABLE, out / CONFUSION], force)
    folder = out or results_folder(quick=seeds is not None and seeds != SEEDS)
    try:
        table = make_table(folder / TABLE, seeds=seeds or SEEDS, store=store, jobs=jobs, cluster=cluster)
    except RuntimeError as error:
        raise click.ClickException(str(error)) from None
    counted = confusion(table)
    counted.to_csv(folder / CONFUSION, index=False, lineterminator="\n", float_format="%.4g")
    click.echo(counted.to_string(index=False, float_format="%.3g"))
