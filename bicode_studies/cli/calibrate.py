"""``bicode calibrate``: candidates for the free constants, and how each fits Fig. 8, the best first."""

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
@click.option("--draws", type=click.IntRange(min=1), default=DRAWS, show_default=True, help="Candidates at first.")
@click.option("--jobs", type=click.IntRange(min=1), help="Candidates at a time  [default: BICODE_JOBS, or the cores]")
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), help=f"Table of all candidates  [default: {TABLE}]"
)
@click.option("--only-current", is_flag=True, help="Try only what bicode_lab/constants.csv has now.")
@click.option("--beyond", is_flag=True, help="Fit what Fig. 8 cannot see, each constant to its one claim.")
def calibrate_command(draws: int, jobs: int | None, out: Path | None, only_current: bool, beyond: bool) -> int:
    """Fit the free constants to Fig. 8: try candidates on the cells that its claims are about.

    Nothing is written but the table; the constants in use are those of bicode_lab/constants.csv. It takes a quarter of
    an hour on two cores; stopped, it goes on where it was. When the file has its constants, --beyond fits the others.
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
