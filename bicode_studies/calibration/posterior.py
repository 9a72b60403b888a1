"""The calibration: a sequence of populations of the fitted constants, with the distance of `distance`.

`RULE` and `SEED` are those of the second run, written down before it; docs/calibration.md has the reasons, and says
which runs there have been. Every candidate that was tried is kept in the store, so a run that is stopped goes on where
it was.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from bicode_studies.calibration.candidates import NAMES, candidate_in_use, other_constants
from bicode_studies.calibration.cells import SEEDS, cell_name
from bicode_studies.calibration.distance import FITTED, TERMS, Proposal, try_proposal
from bicode_studies.calibration.evidence import MEASURED, latency_misfit
from bicode_studies.calibration.population import Population, Rule, medoid, populations
from bicode_studies.calibration.prior import Floats, Points, candidates_at, prior_of_constants
from bicode_studies.sweep.sweep import sweep

SEED = 20261129
RULE = Rule(
    first_draws=800, first_tolerance=150.0, size=100, rounds=6, last_rounds=12, share=0.5, last_tolerance=8.0,
    most_tried=6000,
)  # fmt: skip
FIRST_IN_USE = 1_000_000  # number of the first trial of the constants in use; the run does not come so far
COLUMNS = ["generation", "tolerance", "weight", "is_medoid", "number", "distance", *NAMES, "latency_z", *TERMS]


class Trials:
    """The candidates that were tried, in their order.

    Parameters
    ----------
    store : path
        The file that tried candidates are kept in.
    jobs : int, optional
        Number of candidates that are tried at a time.
    cluster : str, optional
        Address of a Dask scheduler.
    """

    def __init__(self, store: str | Path, jobs: int | None = None, cluster: str | None = None) -> None:
        self.store, self.jobs, self.cluster = store, jobs, cluster
        self.rows: list[pd.DataFrame] = []

    def distances(self, points: Points, tolerance: float, first: int) -> Floats:
        """Try the candidates at some points, for `population.populations`.

        Parameters
        ----------
        points : Points
        tolerance : float
            Distance beyond which a candidate is given up.
        first : int
            Number of the first one.

        Returns
        -------
        ndarray, shape (n,)
            Infinite where a candidate was given up.
        """
        others = other_constants(FITTED)
        trials = [
            (Proposal(candidate=candidate, tolerance=tolerance, others=others), first + place)
            for place, candidate in enumerate(candidates_at(points))
        ]
        result = sweep(
            try_proposal, trials, self.store, jobs=self.jobs, cluster=self.cluster, data_files=(MEASURED,)
        )  # fmt: skip
        if result.failures:
            raise RuntimeError(result.failure_line())
        self.rows.append(result.table)
        return np.asarray(result.table["distance"].where(result.table["is_whole"] == 1, np.inf), float)

    def table(self) -> pd.DataFrame:
        """Return a row for each candidate that was tried, with the columns of `distance.try_proposal`."""
        cells = [cell_name(cell) for cell in SEEDS]
        columns = ["number", "distance", "is_whole", *NAMES, *TERMS, *cells]
        return pd.concat(self.rows, ignore_index=True).reindex(columns=columns)


def calibrate(trials: Trials, rule: Rule = RULE) -> Iterator[Population]:
    """Run the calibration.

    Parameters
    ----------
    trials : Trials
        Where candidates are tried; it holds all of them afterwards.
    rule : Rule

    Yields
    ------
    Population
        Each complete generation; the last one is the posterior.
    """
    yield from populations(prior_of_constants(), trials.distances, rule, SEED)


def posterior_table(found: Population, trials: Trials) -> pd.DataFrame:
    """Return the sets of a population.

    Parameters
    ----------
    found : Population
    trials : Trials
        Where its candidates were tried.

    Returns
    -------
    DataFrame
        One row for each set, the heaviest first: `COLUMNS`, then the accuracies in the cells that were tried.
        ``is_medoid`` is 1 for one set; ``latency_z`` says by how many standard deviations the time constant is longer
        than measured latencies imply (negative: shorter).
    """
    tried = trials.table().set_index("number", drop=False)
    table = tried.loc[found.numbers].reset_index(drop=True)
    table = table.assign(
        generation=found.generation, tolerance=found.tolerance, weight=found.weights,
        is_medoid=(np.arange(len(table)) == medoid(found)).astype(int),
        latency_z=[latency_misfit(candidate) for candidate in candidates_at(found.points)],
    )  # fmt: skip
    cells = [name for cell in SEEDS if table[name := cell_name(cell)].notna().any()]
    return table[[*COLUMNS, *cells]].sort_values("weight", ascending=False, kind="stable", ignore_index=True)


def read_posterior(path: str | Path) -> pd.DataFrame:
    """Read a table that `posterior_table` made and a command wrote.

    Parameters
    ----------
    path : path

    Returns
    -------
    DataFrame

    Raises
    ------
    ValueError
        If the weights or a constant are missing.
    """
    table = pd.read_csv(path)
    missing = [name for name in ("weight", *NAMES) if name not in table]
    if missing:
        raise ValueError(
            f"{Path(path).name} has no column {missing[0]}, so it is no table of sets; bicode calibrate writes one"
        )
    return table


def quantiles(table: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Return where the weighted sets of a posterior lie.

    Parameters
    ----------
    table : DataFrame
        As `posterior_table` returns it.
    names : iterable of str
        Columns.

    Returns
    -------
    DataFrame
        One row for each name: ``5 %``, ``median`` and ``95 %``.
    """
    rows = {}
    for name in names:
        ranked = table.sort_values(name)
        below = ranked["weight"].cumsum().to_numpy()
        rows[name] = [float(ranked[name].iloc[int(np.searchsorted(below, share))]) for share in (0.05, 0.5, 0.95)]
    return pd.DataFrame(rows, index=["5 %", "median", "95 %"]).T


def tension(table: pd.DataFrame) -> dict[str, float]:
    """Return how the posterior and the measured latencies disagree about the time constant.

    Parameters
    ----------
    table : DataFrame
        As `posterior_table` returns it.

    Returns
    -------
    dict of str to float
        ``z`` and ``z_low``, ``z_high``: weighted median, 5 % and 95 % quantile of ``latency_z``; ``probability``: that
        which is left, of 1/2, for the reading that the irradiance of the source is that at the sensor.
    """
    low, middle, high = quantiles(table, ["latency_z"]).to_numpy(float)[0]
    like = np.exp(-0.5 * table["latency_z"] ** 2)
    probability = float((table["weight"] * like / (1 + like)).sum())
    return {"z": float(middle), "z_low": float(low), "z_high": float(high), "probability": probability}


def tried_table(trials: Trials) -> pd.DataFrame:
    """Return all candidates that were tried, without their terms and accuracies.

    Parameters
    ----------
    trials : Trials

    Returns
    -------
    DataFrame
        One row for each: ``number``, ``distance`` (so far), ``is_whole`` (0 if it was given up), and the constants.
    """
    return trials.table()[["number", "distance", "is_whole", *NAMES]]


def terms_in_use(trials: Trials, times: int) -> pd.DataFrame:
    """Find the distance of the constants in use, several times with seeds of their own.

    Parameters
    ----------
    trials : Trials
        The store and the workers.
    times : int

    Returns
    -------
    DataFrame
        One row for each time, with the columns of `distance.try_proposal`.
    """
    proposal = Proposal(candidate=candidate_in_use(), tolerance=1e9, others=other_constants(FITTED))
    asked = [(proposal, FIRST_IN_USE + time) for time in range(times)]
    result = sweep(
        try_proposal, asked, trials.store, jobs=trials.jobs, cluster=trials.cluster, data_files=(MEASURED,)
    )  # fmt: skip
    if result.failures:
        raise RuntimeError(result.failure_line())
    return result.table
