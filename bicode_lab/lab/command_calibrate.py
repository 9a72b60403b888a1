"""``bicode calibrate``: candidates for the free constants in; how each fits Fig. 8, the best first, out."""

from __future__ import annotations

from pathlib import Path

import click

from bicode_lab.evaluation.calibration import calibrate, candidates, in_the_file
from bicode_lab.lab.figure_table import default_jobs
from bicode_lab.lab.notebook import repository_root

LED_TO_AMBIENT = (0.74, 0.78, 0.82, 0.86)
BLUR_PX = (0.75, 0.9)
TIME_CONSTANT_US = (150.0,)
ARUCO_ID = (17, 34)
TABLE = "figures/calibration.csv"


@click.command(name="calibrate")
@click.option("--seeds", type=click.IntRange(min=1), default=12, show_default=True, help="Seeds a cell of Fig. 8.")
@click.option("--jobs", type=click.IntRange(min=1), help="Candidates at a time  [default: BICODE_JOBS, or the cores]")
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), help=f"Table of all candidates  [default: {TABLE}]"
)
@click.option("--only-current", is_flag=True, help="Try only what bicode_lab/constants.csv has now.")
def calibrate_command(seeds: int, jobs: int | None, out: Path | None, only_current: bool) -> int:
    """Fit the free constants to Fig. 8: try each candidate on the cells that its claims are about.

    Nothing is written but the table; the constants in use are those of bicode_lab/constants.csv. Trying all takes
    some minutes.
    """
    tried = [in_the_file()] if only_current else list(candidates(LED_TO_AMBIENT, BLUR_PX, TIME_CONSTANT_US, ARUCO_ID))
    found = calibrate(tried, jobs or default_jobs(), seeds)
    click.echo(found.round(2).head(10).T.to_string(header=False))
    if out or not only_current:
        path = out or repository_root() / TABLE
        found.to_csv(path, index=False, float_format="%.4g", lineterminator="\n")
        click.echo(f"all {len(found)} candidates: {path.name}")
    return 0
