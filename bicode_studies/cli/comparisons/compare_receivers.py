"""``bicode compare-receivers``: let the sequential receiver and the two before it read the same recordings."""

from __future__ import annotations

from pathlib import Path

import click
import pandas as pd

from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.options import Real, needs_repository, parallel_options
from bicode_studies.repository import results_folder
from bicode_studies.robustness.compare import COMPARISONS, compare
from bicode_studies.robustness.false_ids import rates
from bicode_studies.robustness.never_worse import totals, verdicts
from bicode_studies.robustness.receiver_ranges import receiver_ranges

VERDICTS = "receivers_verdicts.csv"


@click.command(name="compare-receivers")
@click.argument("tables", nargs=-1, type=click.Choice([*COMPARISONS]))
@click.option("--seeds", type=click.IntRange(2), help="Recordings of each condition, the same for all TABLES.")
@click.option("--hours", type=Real(), help="Hours of clutter of the table false-ids.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the tables.  [default: results, with other seeds or hours results/quick]",
)
@force_option
@parallel_options
@needs_repository("out", "store")
def compare_receivers(
    tables: tuple[str, ...],
    seeds: int | None,
    hours: float | None,
    out: Path | None,
    jobs: int | None,
    cluster: str | None,
    store: Path | None,
    force: bool,
) -> None:
    """Compare the sequential receiver with the paper's and the soft one.

    TABLES are never-worse (links of many kinds, and a verdict on each), clutter, range (accuracy over distance) and
    false-ids (clutter without a marker); without a name, all are made. Each finished trial is kept at once. If a run is
    stopped, the same command continues where it was; trials of changed code are run again.
    """
    names = tables or tuple(COMPARISONS)
    if out is not None:
        files = [COMPARISONS[name].file for name in names] + [VERDICTS] * ("never-worse" in names)
        refuse_existing([out / file for file in files], force)
    for name in names:
        amount = hours if name == "false-ids" else seeds
        folder = out or results_folder(quick=amount is not None and amount != COMPARISONS[name].amount)
        try:
            table = compare(
                name, folder / COMPARISONS[name].file, amount=amount, store=store, jobs=jobs, cluster=cluster
            )
        except RuntimeError as error:
            raise click.ClickException(str(error)) from None
        click.echo(f"{name}:\n{_summary(name, table, folder)}\n")


def _summary(name: str, table: pd.DataFrame, folder: Path) -> str:
    """Return the text that sums up a table; write the table of verdicts."""
    if name == "never-worse":
        judged = verdicts(table)
        judged.to_csv(folder / VERDICTS, index=False, lineterminator="\n", float_format="%.4g")
        worse = judged[judged["is_worse"]]
        line = f"worse than the better of the two in {len(worse)} of {len(judged)} conditions"
        return "\n".join([_text(totals(table)), line, _text(worse)] if len(worse) else [_text(totals(table)), line])
    if name == "clutter":
        return _text(totals(table, ("clutter", "amount", "distance_m", "receiver")))
    if name == "range":
        return _text(receiver_ranges(table))
    return "\n".join(_text(rates(table, by)) for by in (("receiver", "checksum"), ("clutter", "receiver", "checksum")))


def _text(table: pd.DataFrame) -> str:
    """Return a table as text."""
    return table.to_string(index=False, float_format="%.3g")
