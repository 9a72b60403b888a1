"""Many trials, in parallel, each kept as soon as it is done.   conditions x seeds -> one table

Trials run in worker processes of this machine, or on a Dask cluster. Only this process
writes: it commits a finished trial at once, so a sweep that is stopped at any moment,
even with kill -9, goes on where it was when it is called again. The table comes from
the file, in the order of the trials asked for; it does not depend on how many workers
there were or which trial was done first.

A worker that dies (out of memory, killed) costs its trials a second try, each by itself;
one that takes its worker with it `TRIES` times is reported like one that raises. Such
trials are not kept, the others go on.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.store import Key, TrialStore, key_of
from bicode_studies.sweep.task import Outcome, Task, Trial, TrialFunction, Workers

TRIES = 3
TOLD = 3  # failures told one by one


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """What a sweep gave.

    Parameters
    ----------
    table : DataFrame
        The rows of all trials that are done, in the order they were asked for.
    failures : tuple of str
        A line for each trial that raised or lost its worker: its condition, its seed, the reason.
    """

    table: pd.DataFrame
    failures: tuple[str, ...] = ()

    def failure_line(self) -> str:
        """All failures in one line; empty where there are none."""
        if not self.failures:
            return ""
        more = len(self.failures) - TOLD
        told = "; ".join(self.failures[:TOLD]) + (f"; and {more} more" if more > 0 else "")
        count = "1 trial failed and is" if len(self.failures) == 1 else f"{len(self.failures)} trials failed and are"
        return f"{count} not kept: {told}"


def sweep(
    function: TrialFunction,
    trials: Iterable[Trial],
    store: str | Path,
    *,
    jobs: int = 1,
    cluster: str | None = None,
    data_files: tuple[str, ...] = (),
) -> Sweep:
    """A function and its trials in, the rows of all of them out; those that the store has are not run again.

    Parameters
    ----------
    function : callable
        A condition and a seed in, rows (a list of mappings of plain values) out; defined at the top of a module.
    trials : iterable of (condition, seed)
        Conditions are dataclasses of plain values.
    store : path
        The SQLite file, made where it is missing.
    jobs : int
        Worker processes on this machine.
    cluster : str, optional
        Address of a Dask scheduler, such as ``"tcp://host:8786"``; trials run there instead.
    data_files : tuple of str
        Files that results depend on, see `digest.digest_of`.

    Raises
    ------
    ValueError
        A function that other processes cannot find, a condition that cannot be written down, a file that is no store.
    ConnectionError
        The cluster cannot be reached, or went away; what it had done is kept.
    """
    if jobs < 1:
        raise ValueError(f"jobs={jobs} is no number of processes; choose 1 or more")
    asked = {key_of(condition, seed): (condition, seed) for condition, seed in trials}
    digest = digest_of(function, data_files)
    with TrialStore(store, function.__name__, digest) as kept:
        done = kept.keys()
        missing = {key: trial for key, trial in asked.items() if key not in done}
        failures: dict[Key, str] = {}
        if missing:
            task = Task(function, digest, data_files)
            bar = tqdm(total=len(asked), initial=len(asked) - len(missing), unit=" trials", smoothing=0, disable=None)
            workers = _workers(task, min(jobs, len(missing)), cluster)
            try:
                for key, outcome in _run(workers, missing):
                    if outcome.rows:
                        kept.add(key, outcome.rows)
                    else:
                        failures[key] = f"{key.condition} seed {key.seed}: {outcome.error}"
                    bar.update()
            finally:
                workers.close()
                bar.close()
        table = pd.DataFrame(kept.rows(asked))
    return Sweep(table=table, failures=tuple(failures[key] for key in asked if key in failures))


def _workers(task: Task, jobs: int, cluster: str | None) -> Workers:
    """What runs the trials; the cluster's part is loaded only when it is asked for."""
    if cluster is None:
        from bicode_studies.sweep.local_workers import LocalWorkers

        return LocalWorkers(task, jobs)
    from bicode_studies.sweep.cluster import ClusterWorkers

    return ClusterWorkers(task, cluster)


def _run(workers: Workers, trials: dict[Key, Trial]) -> Iterator[tuple[Key, Outcome]]:
    """Workers and trials in; each trial with what became of it, in the order they are done, out.

    They are begun in a random order, so that the time left can be told from those that are done.
    Those whose worker died are tried again at the end, one at a time: then it is known whose fault it was.
    """
    waiting = list(trials)
    random.Random(0).shuffle(waiting)
    tries = dict.fromkeys(trials, 0)
    again: list[Key] = []
    running = 0
    while waiting or again or running:
        while waiting and running < workers.at_once:
            key = waiting.pop()
            workers.start(key, trials[key])
            running += 1
        if again and not waiting and not running:
            key = again.pop()
            workers.start(key, trials[key])
            running += 1
        for key, outcome in workers.finished():
            running -= 1
            if outcome.rows or outcome.error:
                yield key, outcome
                continue
            tries[key] += 1
            if tries[key] < TRIES:
                again.insert(0, key)
            else:
                yield key, Outcome(error=f"its worker died {TRIES} times (out of memory?)")
