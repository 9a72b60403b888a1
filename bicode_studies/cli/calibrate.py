"""``bicode calibrate``: try candidates for the free constants and print how well each fits Fig. 8."""

from __future__ import annotations

from pathlib import Path

import click

from bicode_lab.constants import constant
from bicode_studies.calibration.candidates import candidate_in_use
from bicode_studies.calibration.other_claims import WANTED, fit_constant
from bicode_studies.calibration.search import DRAWS, calibrate, candidate_row
from bicode_studies.repository import repository_root
from bicode_studies.sweep.workers import default_jobs

TABLE = "results/calibration.csv"
STORE = "build/calibration.sqlite"


@click.command(name="calibrate")
@click.option(
    "--draws", type=click.IntRange(min=1), default=DRAWS, show_default=True, help="Candidates of the first round."
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    help="Number of candidates that are tried at a time.  [default: BICODE_JOBS, or the cores]",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help=f"File of the table of all candidates.  [default: {TABLE}]",
)
@click.option("--only-current", is_flag=True, help="Judge only the constants that are in use.")
@click.option("--beyond", is_flag=True, help="Fit the constants that Fig. 8 does not determine.")
def calibrate_command(draws: int, jobs: int | None, out: Path | None, only_current: bool, beyond: bool) -> int:
    """Fit the free constants to Fig. 8: try candidates on the cells that its claims are about.

    Only the table of candidates is written; the constants in use are those of bicode_lab/constants.csv. A run takes a
    quarter of an hour on two cores. If it is stopped, the same command continues where it was. After the constants are
    in the file, --beyond fits those that Fig. 8 does not determine, each to one other claim.
    """
    if beyond:
        for name in (*WANTED, "processing_mev_per_s"):
            click.echo(f"{name}: {fit_constant(name):g} (in the file: {constant(name):g})")
        return 0
    store = repository_root() / STORE
    jobs = jobs or default_jobs()
    found = candidate_row(candidate_in_use(), store, jobs) if only_current else calibrate(store, jobs, draws)
    click.echo(found.round(3).head(10).T.to_string(header=False))
    if out or not only_current:
        path = out or repository_root() / TABLE
        found.to_csv(path, index=False, float_format="%.4g", lineterminator="\n")
        click.echo(f"all {len(found)} candidates: {path.name}")
    return 0
