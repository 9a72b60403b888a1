"""``bicode calibrate``: find the sets of constants that agree with Fig. 8 and with measurements."""

from __future__ import annotations

import time
from pathlib import Path

import click
import pandas as pd

from bicode_lab.constants import constant
from bicode_studies.calibration.candidates import NAMES, NOT_IN_FIG_8
from bicode_studies.calibration.distance import TERMS
from bicode_studies.calibration.other_claims import fit_constant
from bicode_studies.calibration.posterior import (
    RULE,
    Trials,
    calibrate,
    posterior_table,
    read_posterior,
    tension,
    terms_in_use,
    tried_table,
)
from bicode_studies.claims.table import read_claims
from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.options import needs_repository
from bicode_studies.predictions.predict import predict as predict_claims
from bicode_studies.predictions.predict import sets_of_posterior, sets_of_prior, shares
from bicode_studies.repository import repository_root
from bicode_studies.sweep.workers import default_jobs

TABLE = "results/posterior.csv"
STORE = "build/calibration.sqlite"
PREDICTIONS, PREDICTION_STORE = "results/predictions.csv", "build/predictions.sqlite"
TIMES = 4  # that the constants in use are tried


@click.command(name="calibrate")
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    help="Number of candidates that are tried at a time.  [default: BICODE_JOBS, or the cores]",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help=f"File of the posterior; the table of all candidates goes beside it.  [default: {TABLE}]",
)
@click.option("--only-current", is_flag=True, help="Judge only the constants that are in use.")
@click.option("--beyond", is_flag=True, help="Fit the constants that Fig. 8 does not determine.")
@click.option("--predict", type=click.IntRange(min=1), help="Judge claims with so many sets of posterior and prior.")
@force_option
@needs_repository()
def calibrate_command(
    jobs: int | None, out: Path | None, only_current: bool, beyond: bool, predict: int | None, force: bool
) -> int:
    """Find the sets of constants that agree with Fig. 8 and with what was measured on such cameras.

    It tries some 5,000 candidates, which takes an hour or more on two cores, and writes the posterior: some 100 sets
    with their weights. If it is stopped, the same command continues where it was. The constants in use are those of
    bicode_lab/constants.csv, which it does not change; docs/calibration.md says which set goes there. After that,
    --beyond fits the constants that Fig. 8 does not determine, each to one other claim. With --predict 100, the figures
    are simulated at a reduced size with 100 sets of the posterior and 100 of the prior, in about 100 minutes on two
    cores, and results/predictions.csv says which claims come out inside the paper's bounds.
    """
    jobs = jobs or default_jobs()
    if out is not None:
        refuse_existing([out] if predict else [out, _beside(out)], force)
    if beyond:
        for name in NOT_IN_FIG_8:
            click.echo(f"{name}: {fit_constant(name):g} (in the file: {constant(name):g})")
        return 0
    if predict:
        _predict(predict, jobs, out or repository_root() / PREDICTIONS)
        return 0
    trials = Trials(repository_root() / STORE, jobs)
    if only_current:
        found = terms_in_use(trials, TIMES)[["distance", *TERMS]]
        click.echo(found.round(2).T.to_string(header=False))
        return 0
    _run(trials, out or repository_root() / TABLE)
    return 0


def _run(trials: Trials, path: Path) -> None:
    """Run the calibration, say how it goes, and write its two tables."""
    begun = time.monotonic()
    for found in calibrate(trials):
        click.echo(
            f"generation {found.generation}: tolerance {found.tolerance:.1f}, {len(found.points)} different sets "
            f"(worth {found.effective_size:.0f} of equal weight), {found.tried} of at most {RULE.most_tried} tried, "
            f"{(time.monotonic() - begun) / 60:.0f} min"
        )
    table = posterior_table(found, trials)
    beside = _beside(path)
    for each, where in ((table, path), (tried_table(trials), beside)):
        each.to_csv(where, index=False, float_format="%.4g", lineterminator="\n")
    _tell(table)
    click.echo(f"{len(table)} sets: {path.name}; all candidates: {beside.name}")


def _beside(path: Path) -> Path:
    """Return the file of the table of all candidates beside that of the posterior."""
    return path.with_name(f"{path.stem}_tried{path.suffix}")


def _predict(n: int, jobs: int, path: Path) -> None:
    """Judge the claims with sets of the posterior and of the prior, write the table and print the shares."""
    posterior = read_posterior(repository_root() / TABLE)
    worth = 1 / (posterior["weight"] ** 2).sum()
    click.echo(f"{TABLE}: {len(posterior)} sets, worth {worth:.0f} of equal weight")
    sets = {"posterior": sets_of_posterior(posterior, n), "prior": sets_of_prior(n)}
    table = predict_claims(read_claims(), sets, repository_root() / PREDICTION_STORE, jobs=jobs)
    table.to_csv(path, index=False, float_format="%.4g", lineterminator="\n")
    click.echo(shares(table).round(2).to_string(index=False))


def _tell(table: pd.DataFrame) -> None:
    """Print the medoid, and what the measured latencies have against the posterior."""
    (chosen,) = table[table["is_medoid"] == 1][[*NAMES]].to_dict("records")
    click.echo("medoid: " + ", ".join(f"{name} {value:g}" for name, value in chosen.items()))
    z = tension(table)
    click.echo(
        f"time constant against measured latencies: {z['z']:+.1f} standard deviations ({z['z_low']:+.1f} .. "
        f"{z['z_high']:+.1f}); probability of the reading that they apply: {z['probability']:.2g} of 0.5 before"
    )
