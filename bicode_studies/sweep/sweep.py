"""Many trials, in parallel, each kept as soon as it is done.

Trials run in worker processes of this machine, or on a Dask cluster. Only the calling process writes: it commits each
finished trial at once, so a sweep that is stopped at any moment, even with kill -9, goes on where it was when it is
called again. The table comes from the store, in the order of the trials asked for; it does not depend on how many
workers there were or which trial was done first.

If a worker dies (out of memory, killed), each of its trials is run again alone, at most three times in total. A trial
whose workers keep dying is reported like one that raises. Such trials are not kept; the others go on.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from bicode_studies.repository import repository_root
from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.store import Key, TrialStore, key_of
from bicode_studies.sweep.workers import (
    ClusterWorkers,
    LocalWorkers,
    Task,
    Trial,
    TrialFunction,
    default_jobs,
    run_trials,
)

STORE = "build/sweeps.sqlite"
CONSTANTS = ("bicode_lab/constants.csv",)
"""The data file that trials with the constants in use depend on."""
MAX_LISTED_FAILURES = 3


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """Result of a sweep.

    Attributes
    ----------
    table : DataFrame
        The rows of all trials that are done, in the order they were asked for.
    failures : tuple of str
        A line for each trial that raised or lost its worker: its condition, its seed, the reason.
    """

    table: pd.DataFrame
    failures: tuple[str, ...] = ()

    def failure_line(self) -> str:
        """Return all failures in one line; empty where there are none."""
        if not self.failures:
            return ""
        more = len(self.failures) - MAX_LISTED_FAILURES
        listed = "; ".join(self.failures[:MAX_LISTED_FAILURES]) + (f"; and {more} more" if more > 0 else "")
        count = "1 trial failed and is" if len(self.failures) == 1 else f"{len(self.failures)} trials failed and are"
        return f"{count} not kept: {listed}"


def sweep(
    function: TrialFunction,
    trials: Iterable[Trial],
    store: str | Path | None = None,
    *,
    jobs: int | None = None,
    cluster: str | None = None,
    data_files: tuple[str, ...] = (),
) -> Sweep:
    """Run the trials that the store does not hold yet, and return the rows of all.

    Parameters
    ----------
    function : callable
        Takes a condition and a seed and returns rows, a list of mappings of plain values; defined at the top of a
        module.
    trials : iterable of (condition, seed)
        Conditions are dataclasses of plain values.
    store : path, optional
        SQLite file, made where it is missing; None takes ``build/sweeps.sqlite`` of the repository.
    jobs : int, optional
        Worker processes on this machine; None takes ``BICODE_JOBS``, or the number of cores.
    cluster : str, optional
        Address of a Dask scheduler, such as ``"tcp://host:8786"``; trials run there instead. None takes
        ``BICODE_CLUSTER``, where it is set.
    data_files : tuple of str
        Files that results depend on, see `digest.digest_of`.

    Returns
    -------
    Sweep

    Raises
    ------
    ValueError
        If other processes cannot find the function, a condition cannot be written as text, or the store cannot be used
        (see `store.TrialStore`).
    ConnectionError
        If the cluster cannot be reached, or the connection is lost; finished trials are kept.
    """
    jobs = default_jobs() if jobs is None else jobs
    cluster = cluster or os.environ.get("BICODE_CLUSTER") or None
    if jobs < 1:
        raise ValueError(f"jobs={jobs} is no number of processes; choose 1 or more")
    asked = {key_of(condition, seed): (condition, seed) for condition, seed in trials}
    digest = digest_of(function, data_files)
    with TrialStore(store or repository_root() / STORE, function.__name__, digest) as kept:
        done = kept.keys()
        missing = {key: trial for key, trial in asked.items() if key not in done}
        failures: dict[Key, str] = {}
        if missing:
            workers = LocalWorkers(min(jobs, len(missing))) if cluster is None else ClusterWorkers(cluster)
            bar = tqdm(total=len(asked), initial=len(asked) - len(missing), unit=" trials", smoothing=0, disable=None)
            try:
                for key, outcome in run_trials(workers, Task(function, digest, data_files), missing):
                    if outcome.rows:
                        kept.add(key, outcome.rows)
                    else:
                        failures[key] = f"{key.condition} seed {key.seed}: {outcome.error}"
                    bar.update()
            finally:
                workers.close()
                bar.close()
            kept.check()
        table = pd.DataFrame(kept.rows(asked))
    return Sweep(table=table, failures=tuple(failures[key] for key in asked if key in failures))


def sweep_to_csv(
    function: TrialFunction,
    trials: Iterable[Trial],
    path: str | Path,
    *,
    store: str | Path | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
) -> pd.DataFrame:
    """Run trials as `sweep` does, with the constants in use, and write the rows of all to a CSV.

    Parameters
    ----------
    function, trials, store, jobs, cluster
        See `sweep`.
    path : path
        The CSV; it is written when all trials are done.

    Returns
    -------
    DataFrame
        The rows of all trials, and the digest of their code in the last column, ``digest``.

    Raises
    ------
    RuntimeError
        If trials fail; then nothing is written, and the others are kept in the store.
    """
    result = sweep(function, trials, store, jobs=jobs, cluster=cluster, data_files=CONSTANTS)
    if result.failures:
        raise RuntimeError(result.failure_line())
    table = result.table.assign(digest=digest_of(function, CONSTANTS))
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, lineterminator="\n")
    return table
