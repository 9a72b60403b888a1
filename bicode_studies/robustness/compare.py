"""The tables that compare receivers: their trials, their files, and how they are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from bicode_studies.robustness.earlier_receivers import read_distance_by_earlier, read_link_by_earlier
from bicode_studies.robustness.link_conditions import balanced_conditions, clutter_conditions
from bicode_studies.robustness.sequential_trials import (
    count_piece_by_sequential,
    pieces,
    read_distance_by_sequential,
    read_link_by_sequential,
)
from bicode_studies.robustness.stressors import DISTANCE, StressCondition
from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.sweep import CONSTANTS, sweep
from bicode_studies.sweep.workers import Trial, TrialFunction


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One table.

    Attributes
    ----------
    file : str
        Name of its file.
    functions : tuple of callable
        Trial functions, all called with the same trials; their rows follow each other.
    trials : callable
        Takes `amount` and returns the trials.
    amount : float
        Seeds of each condition, or hours of clutter, of the committed table.
    """

    file: str
    functions: tuple[TrialFunction, ...]
    trials: Callable[[float], list[Trial]]
    amount: float


def _over_seeds(conditions: Callable[[], Sequence[object]]) -> Callable[[float], list[Trial]]:
    """Return the function that repeats conditions with the seeds 0 .. n - 1, one seed after the other."""
    return lambda seeds: [(condition, seed) for seed in range(round(seeds)) for condition in conditions()]


def distances() -> list[StressCondition]:
    """Return the distances of `stressors.DISTANCE`."""
    return [StressCondition(stressor=DISTANCE.name, level=float(level)) for level in DISTANCE.levels]


LINKS = (read_link_by_earlier, read_link_by_sequential)
COMPARISONS: dict[str, Comparison] = {
    "never-worse": Comparison(
        file="receivers_never_worse.csv", functions=LINKS, trials=_over_seeds(lambda: balanced_conditions()), amount=6
    ),
    "clutter": Comparison(
        file="receivers_clutter.csv", functions=LINKS, trials=_over_seeds(clutter_conditions), amount=8
    ),
    "range": Comparison(
        file="receivers_range.csv",
        functions=(read_distance_by_earlier, read_distance_by_sequential),
        trials=_over_seeds(distances),
        amount=10,
    ),
    "false-ids": Comparison(
        file="receivers_false_ids.csv", functions=(count_piece_by_sequential,), trials=pieces, amount=1.0
    ),
}


def compare(
    name: str,
    path: Path,
    *,
    amount: float | None = None,
    store: Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
) -> pd.DataFrame:
    """Run the trials of a comparison that the store does not hold yet, and write its table.

    Parameters
    ----------
    name : str
        A key of `COMPARISONS`.
    path : Path
        File of the table; it is written when all trials are done.
    amount : float, optional
        Seeds of each condition, or hours; None takes those of the committed table.
    store, jobs, cluster
        See `sweep.sweep`.

    Returns
    -------
    DataFrame
        The rows of all trials; the last column is the digest of the code of each.

    Raises
    ------
    RuntimeError
        If trials fail; then nothing is written, and the others are kept in the store.
    """
    comparison = COMPARISONS[name]
    trials = comparison.trials(comparison.amount if amount is None else amount)
    parts, failures = [], []
    for function in comparison.functions:
        result = sweep(function, trials, store, jobs=jobs, cluster=cluster, data_files=CONSTANTS)
        parts.append(result.table.assign(digest=digest_of(function, CONSTANTS)))
        failures += [result.failure_line()] if result.failures else []
    if failures:
        raise RuntimeError("; ".join(failures))
    table = pd.concat(parts, ignore_index=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, lineterminator="\n")
    return table
