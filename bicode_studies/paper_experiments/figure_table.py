"""The trials of a figure, from the store; what is missing is run now.   figure -> rows of trials

Notebooks 08 to 14 and ``bicode sweep`` share one store, ``build/sweeps.sqlite`` of the repository, so
that a trial is run once for both. ``BICODE_JOBS`` says how many run at a time, else it is the number
of cores; ``BICODE_CLUSTER`` names a Dask scheduler to run them on.
"""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import pandas as pd

from bicode_studies.paper_experiments import grids as experiments
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.repository import repository_root
from bicode_studies.sweep.sweep import Sweep, sweep

FIGURES = ("08", "09", "10", "11", "12", "14")
STORE = "build/sweeps.sqlite"
DATA_FILES = ("bicode_lab/constants.csv",)
"""What trials depend on beside code."""


def figure_table(
    figure: str,
    quick: bool,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    store: str | Path | None = None,
) -> pd.DataFrame:
    """A figure and a scale in, the rows of all its trials out, in a fixed order.

    Parameters
    ----------
    figure : str
        "08" .. "14", one of those that have a grid of conditions.
    quick : bool
        The short grid instead of the paper's scale.
    jobs : int, optional
        Worker processes on this machine.
    cluster : str, optional
        Address of a Dask scheduler; trials run there instead.
    store : path, optional
        The file finished trials are kept in.

    Raises
    ------
    ValueError
        A figure without a grid.
    RuntimeError
        Trials that failed; the others are kept.
    """
    result = figure_sweep(figure, quick, jobs=jobs, cluster=cluster, store=store)
    if result.failures:
        raise RuntimeError(result.failure_line())
    return result.table


def figure_sweep(
    figure: str,
    quick: bool,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    store: str | Path | None = None,
) -> Sweep:
    """As `figure_table`, with the failures beside the table."""
    if figure not in FIGURES:
        raise ValueError(f"figure {figure!r} has no grid of conditions; choose one of {', '.join(FIGURES)}")
    trials = [
        (condition, seed)
        for condition in experiments.conditions(figure, quick)
        for seed in experiments.seeds(condition, quick)
    ]
    return sweep(
        experiments.run_trial,
        trials,
        store or repository_root() / STORE,
        jobs=jobs or default_jobs(),
        cluster=cluster or os.environ.get("BICODE_CLUSTER") or None,
        data_files=DATA_FILES,
    )


def condition_fields() -> list[str]:
    """Nothing in, the names of a condition's fields out; each is a column of the table."""
    return [field.name for field in dataclasses.fields(Condition)]


def default_jobs() -> int:
    """Nothing in; how many trials to run at a time, from ``BICODE_JOBS`` or the number of cores, out."""
    named = os.environ.get("BICODE_JOBS", "")
    if not named:
        return os.cpu_count() or 1
    if not named.isdecimal() or int(named) < 1:
        raise ValueError(f"BICODE_JOBS={named!r} is no number of processes; set it to 1 or more")
    return int(named)
