"""``bicode false-ids``: count the IDs that are read in clutter, or in recordings that hold no marker."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import pandas as pd

from bicode_lab.recordings import open_recording
from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.helpers.progress import waiting
from bicode_studies.cli.options import Real, needs_repository, parallel_options
from bicode_studies.repository import results_folder
from bicode_studies.robustness.false_ids import RECEIVERS, add_up, clutter_trials, count_ids, count_piece, rates
from bicode_studies.sweep.sweep import sweep_to_csv

HOURS = 3.0


@click.command(name="false-ids")
@click.argument("files", nargs=-1, type=click.Path(path_type=Path))
@click.option("--hours", type=Real(), default=HOURS, show_default=True, help="Hours of clutter.")
@click.option(
    "--receiver",
    type=click.Choice([*RECEIVERS, "both"]),
    default="both",
    show_default=True,
    help="Receiver that reads.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File of the table.  [default: results/false_ids.csv, for FILES results/false_ids_real.csv; with fewer hours "
    "or one receiver results/quick/false_ids.csv]",
)
@force_option
@parallel_options
@needs_repository("out", "store")
def false_ids(
    files: tuple[Path, ...],
    hours: float,
    receiver: str,
    out: Path | None,
    jobs: int | None,
    cluster: str | None,
    store: Path | None,
    force: bool,
) -> None:
    """Count IDs in simulated clutter, or in FILES, recordings that hold no marker.

    Clutter comes in pieces of half a minute, each with a seed of its own. Each finished piece is kept at once. If a run
    is stopped, the same command continues where it was; pieces of changed code are counted again. The table is written
    at the end.
    """
    if out is not None:
        refuse_existing([out], force)
    receivers = RECEIVERS if receiver == "both" else (receiver,)
    if files:
        table = pd.concat([_count_file(file, receivers) for file in files], ignore_index=True)
        path = out or results_folder() / "false_ids_real.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        table.to_csv(path, index=False, lineterminator="\n")
    else:
        path = out or results_folder(quick=hours < HOURS or receiver != "both") / "false_ids.csv"
        trials = clutter_trials(hours, receivers)
        try:
            table = sweep_to_csv(count_piece, trials, path, jobs=jobs, cluster=cluster, store=store)
        except RuntimeError as error:
            raise click.ClickException(str(error)) from None
    for by in (("receiver", "checksum"), ("clutter", "receiver", "checksum")):
        click.echo(rates(table, by).to_string(index=False, float_format="%.4g"))


def _count_file(file: Path, receivers: Sequence[str]) -> pd.DataFrame:
    """Count the IDs of a recording over its true length."""
    recording = open_recording(file)
    events = recording.read()
    if not events.size:
        raise ValueError(f"{file.name} holds no events, so there is nothing to count in; leave it out")
    seconds = (int(events["t"][-1]) - int(events["t"][0])) * 1e-6
    with waiting(f"counting in {file.name}"):
        table = add_up(count_ids(events, seconds, recording.width, recording.height, receivers=receivers))
    table.insert(0, "clutter", file.name)
    table["events"] = events.size
    return table
