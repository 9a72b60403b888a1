"""The trials of the figures of section IV as tables: they are run once and kept as ``results/NN.csv``.

Beside each table, ``results/NN.json`` says by which code (`sweep.digest`), for which grid of conditions and with which
versions of the computing libraries it was made. Notebooks, ``bicode sweep`` and ``bicode claims`` read the same file.
Short trials are kept in ``results/quick``, which git ignores.

Finished trials are in a store, ``build/sweeps.sqlite`` of the repository, so that an interrupted run goes on where it
was. ``BICODE_JOBS`` says how many trials run at a time, else it is the number of cores; ``BICODE_CLUSTER`` names a Dask
scheduler to run them on.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from importlib import metadata
from pathlib import Path
from typing import Any

import pandas as pd

from bicode_lab.recordings.formats import whole_file
from bicode_studies.paper_experiments import grids
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.trial_rows import run_trial
from bicode_studies.repository import results_folder
from bicode_studies.sweep.digest import COMPUTING, digest_of
from bicode_studies.sweep.store import key_of
from bicode_studies.sweep.sweep import CONSTANTS, Sweep, sweep
from bicode_studies.sweep.workers import Trial

FIGURES = grids.FIGURES


def figure_table(figure: str, quick: bool, *, store: str | Path | None = None) -> pd.DataFrame:
    """Return the rows of all trials of a figure, in a fixed order.

    The table is read from ``results`` where the present code made it for the present grid. Otherwise the missing trials
    are run and the table is written first.

    Parameters
    ----------
    figure : str
        One of `FIGURES`.
    quick : bool
        True for the short grid, False for the paper's scale.
    store : path, optional
        File that finished trials are kept in.

    Returns
    -------
    DataFrame
        Rows of `trial_rows.run_trial`.

    Raises
    ------
    ValueError
        If the figure has no grid.
    RuntimeError
        If trials fail; the others are kept in the store.
    """
    if not is_current(figure, quick):
        result = run_figure(figure, quick, store=store)
        if result.failures:
            raise RuntimeError(result.failure_line())
        write_results(figure, quick, result.table)
    table = read_results(figure, quick)
    if table is None:
        raise RuntimeError(f"{_path(figure, quick)} was removed while it was made; run the same again")
    return table


def run_figure(
    figure: str, quick: bool, *, jobs: int | None = None, cluster: str | None = None, store: str | Path | None = None
) -> Sweep:
    """Run the trials of a figure that the store lacks; nothing is written to ``results``.

    Parameters
    ----------
    figure : str
        One of `FIGURES`.
    quick : bool
        True for the short grid, False for the paper's scale.
    jobs : int, optional
        Trials at a time on this machine.
    cluster : str, optional
        Address of a Dask scheduler; trials run there instead.
    store : path, optional
        File that finished trials are kept in.

    Returns
    -------
    Sweep
    """
    return sweep(run_trial, _trials(figure, quick), store, jobs=jobs, cluster=cluster, data_files=CONSTANTS)


def read_results(figure: str, quick: bool) -> pd.DataFrame | None:
    """Return the table of a figure in ``results``, whatever code made it; None where there is no such file.

    Numbers are those that were written, to the last bit; ``figure`` is text.
    """
    path = _path(figure, quick)
    return pd.read_csv(path, dtype={"figure": str}) if path.is_file() else None


def write_results(figure: str, quick: bool, table: pd.DataFrame) -> None:
    """Write the table of a figure to ``results``, and beside it how it was made.

    Parameters
    ----------
    figure : str
    quick : bool
    table : DataFrame
        Rows of all trials, in their order. Floats are written with as many digits as tell them apart.
    """
    path = _path(figure, quick)
    made_by = path.with_suffix(".json")
    made_by.unlink(missing_ok=True)
    with whole_file(path) as unfinished:  # two notebooks may want the same table at the same time
        table.to_csv(unfinished, index=False, lineterminator="\n")
    with whole_file(made_by) as unfinished:
        unfinished.write_text(json.dumps(_origin(figure, quick), indent=1) + "\n", encoding="utf-8")


def is_current(figure: str, quick: bool) -> bool:
    """Return True where the present code and libraries made the table of a figure for the present grid."""
    origin = _origin(figure, quick)
    path = _path(figure, quick)
    try:
        return path.is_file() and json.loads(path.with_suffix(".json").read_text(encoding="utf-8")) == origin
    except (OSError, ValueError):
        return False


def condition_fields() -> list[str]:
    """Return the names of a condition's fields; each is a column of the tables."""
    return [field.name for field in dataclasses.fields(Condition)]


def _path(figure: str, quick: bool) -> Path:
    """Return the file of a figure's table."""
    return results_folder(quick) / f"{figure}.csv"


def _trials(figure: str, quick: bool) -> list[Trial]:
    """Return the conditions of a figure, each with all its seeds."""
    if figure not in FIGURES:
        raise ValueError(f"figure {figure!r} has no grid of conditions; choose one of {', '.join(FIGURES)}")
    return [
        (condition, seed)
        for condition in grids.conditions(figure, quick)
        for seed in grids.seeds(condition, quick)
    ]  # fmt: skip


def _origin(figure: str, quick: bool) -> dict[str, Any]:
    """Return what `write_results` says about a table: code, grid and versions."""
    keys = [key_of(condition, seed) for condition, seed in _trials(figure, quick)]
    return {
        "figure": figure,
        "trials": len(keys),
        "grid": hashlib.sha256(json.dumps(keys).encode()).hexdigest()[:16],
        "digest": digest_of(run_trial, CONSTANTS),
        "versions": {library: metadata.version(library) for library in COMPUTING},
    }
