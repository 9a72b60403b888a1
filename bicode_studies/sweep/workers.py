"""Workers that run trials and give back futures: processes of this machine (loky), or those of a Dask cluster.

The processes of this machine are new, so that they have the code that is on disk now, and they end with the process
that made them, however that ends. On a cluster (extra ``[cluster]``) the scheduler shares the trials out. It gives
trials of a worker that died to another one, as often as its setting ``allowed-failures`` says, and reports one whose
workers keep dying.
"""

from __future__ import annotations

import json
import os
import random
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from loky import ProcessPoolExecutor

from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.scheduler import no_cluster, refuse_no_scheduler
from bicode_studies.sweep.store import Key, Rows

TRIES = 3  # of a trial whose worker dies
POLL_S = 1.0  # how often a lost parent process or a lost connection is looked for
TIMEOUT_S = 10
QUEUED = 10_000  # trials that a cluster's scheduler holds, to share them out
# Every worker keeps to one core; libraries read these when they are loaded.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")

Trial = tuple[Any, int]
"""A condition and a seed."""
TrialFunction = Callable[[Any, int], Rows]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a trial.

    Attributes
    ----------
    rows : str
        Its rows as JSON; empty where there are none.
    error : str
        Why there are none.
    """

    rows: str = ""
    error: str = ""


@dataclass(frozen=True)
class Task:
    """The function that runs trials, in the form that is sent to a worker.

    Attributes
    ----------
    function : callable
    digest : str
        Digest that the code must have where it runs.
    data_files : tuple of str
        See `digest.digest_of`.
    """

    function: TrialFunction
    digest: str
    data_files: tuple[str, ...]

    def __call__(self, condition: Any, seed: int) -> Outcome:
        """Run a trial; nothing is raised, so that what happened always travels back."""
        try:
            if digest_of(self.function, self.data_files) != self.digest:
                return Outcome(error="a worker has other code than this process; start both anew with the same code")
            return Outcome(rows=json.dumps(self.function(condition, seed), default=_plain))
        except Exception as error:
            return Outcome(error=_in_one_line(error))


class Workers(Protocol):
    """Whatever runs trials."""

    at_once: int  # most trials that are submitted at a time

    def submit(self, task: Task, trial: Trial) -> Future[Outcome]:
        """Have a trial run; the future raises BrokenProcessPool where its worker died."""

    def check(self) -> None:
        """Raise ConnectionError where the workers are lost."""

    def close(self) -> None:
        """End all that runs, at once."""


class LocalWorkers:
    """Processes of this machine.

    Parameters
    ----------
    jobs : int
        Number of processes.
    """

    def __init__(self, jobs: int) -> None:
        self.at_once = jobs
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        """Start as many new processes."""
        return ProcessPoolExecutor(self.at_once, initializer=_prepare_process, initargs=(os.getpid(),), env=ONE_THREAD)

    def submit(self, task: Task, trial: Trial) -> Future[Outcome]:
        """Have a trial run; where a worker has died, in new processes."""
        try:
            future: Future[Outcome] = self._pool.submit(task, *trial)
        except BrokenProcessPool:
            self.close()
            self._pool = self._new_pool()
            future = self._pool.submit(task, *trial)
        return future

    def check(self) -> None:
        """Do nothing: a process that dies breaks its futures."""

    def close(self) -> None:
        """End every process, at once."""
        self._pool.shutdown(wait=True, kill_workers=True)


class ClusterWorkers:
    """A connection to a Dask scheduler.

    Parameters
    ----------
    address : str
        Such as ``"tcp://host:8786"``.

    Raises
    ------
    ValueError
        If the package distributed is missing, or the address is not one.
    ConnectionError
        If nobody answers there, or no worker is connected.
    """

    at_once = QUEUED

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError:
            raise ValueError(
                f"cluster={address!r} needs the package distributed; "
                "in a clone of the repository: pip install '.[cluster]'"
            ) from None
        self._address = address
        refuse_no_scheduler(address, TIMEOUT_S)
        try:
            self._client = distributed.Client(address, timeout=TIMEOUT_S, set_as_default=False)
        except ValueError as error:
            raise ValueError(f"cluster={address!r} is no address ({error}); write tcp://HOST:PORT") from None
        except OSError:
            raise ConnectionError(no_cluster(address)) from None
        try:
            self._client.wait_for_workers(1, timeout=TIMEOUT_S)
        except TimeoutError:
            self._client.close()
            raise ConnectionError(
                f"the cluster at {address} has no workers; start one with: dask worker {address}"
            ) from None
        self._running: set[Any] = set()

    def submit(self, task: Task, trial: Trial) -> Future[Outcome]:
        """Have a trial run.

        The executor of distributed is not used: its future never ends where a result is lost with its worker and the
        trial then fails.
        """
        future: Future[Outcome] = Future()
        remote = self._client.submit(task, *trial, pure=False)
        self._running.add(remote)
        remote.add_done_callback(partial(self._pass_on, future))
        return future

    def _pass_on(self, future: Future[Outcome], remote: Any) -> None:
        """Give a future the outcome of a trial on the cluster."""
        from distributed import KilledWorker

        try:
            future.set_result(remote.result())
        except KilledWorker as error:
            future.set_exception(BrokenProcessPool(str(error)))
        except BaseException as error:
            future.set_exception(self._gone() if remote.cancelled() or self._client.status != "running" else error)
        self._running.discard(remote)

    def check(self) -> None:
        """Raise ConnectionError where the scheduler is gone."""
        if self._client.status != "running":
            raise self._gone()

    def _gone(self) -> ConnectionError:
        """Return the error that says that the scheduler is gone."""
        return ConnectionError(
            f"the cluster at {self._address} went away; what was done is kept, and the same call goes on with the rest"
        )

    def close(self) -> None:
        """Give up what was not done, and leave."""
        self._client.cancel(list(self._running), force=True)
        self._client.close(timeout=TIMEOUT_S)


def run_trials(workers: Workers, task: Task, trials: dict[Key, Trial]) -> Iterator[tuple[Key, Outcome]]:
    """Run trials and yield each with its outcome, in the order they are done.

    They are begun in a random order, so that the time that is left can be told from those that are done. A trial whose
    worker died is tried again after all others, alone: then it is known whose fault it was.

    Parameters
    ----------
    workers : Workers
    task : Task
    trials : dict of Key to (condition, seed)

    Yields
    ------
    key : Key
    outcome : Outcome
    """
    waiting = list(trials)
    random.Random(0).shuffle(waiting)
    tries = dict.fromkeys(trials, 0)
    again: list[Key] = []
    running: dict[Future[Outcome], Key] = {}
    while waiting or again or running:
        while waiting and len(running) < workers.at_once:
            key = waiting.pop()
            running[workers.submit(task, trials[key])] = key
        if again and not running:
            key = again.pop(0)
            running[workers.submit(task, trials[key])] = key
        for future in wait(running, timeout=POLL_S, return_when=FIRST_COMPLETED).done:
            key = running.pop(future)
            try:
                yield key, future.result()
            except BrokenProcessPool:
                tries[key] += 1
                if tries[key] < TRIES:
                    again.append(key)
                else:
                    yield key, Outcome(error=f"its worker died {TRIES} times (out of memory?)")
            except ConnectionError:
                raise
            except Exception as error:
                yield key, Outcome(error=_in_one_line(error))
        workers.check()


def default_jobs() -> int:
    """Return how many trials to run at a time: ``BICODE_JOBS``, or the number of cores.

    Raises
    ------
    ValueError
        If ``BICODE_JOBS`` is not a number from 1.
    """
    named = os.environ.get("BICODE_JOBS", "")
    if not named:
        return os.cpu_count() or 1
    if not named.isdecimal() or int(named) < 1:
        raise ValueError(f"BICODE_JOBS={named!r} is no number of processes; set it to 1 or more")
    return int(named)


def _prepare_process(parent: int) -> None:
    """Prepare a new process: leave Ctrl-C to the parent, use one core, and end when the parent has ended."""
    import cv2

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    threading.Thread(target=_watch_parent, args=(parent,), daemon=True).start()


def _watch_parent(parent: int) -> None:
    """End this process when its parent is another than it was."""
    while os.getppid() == parent:
        time.sleep(POLL_S)
    os._exit(1)


def _plain(value: Any) -> Any:
    """Return one of numpy's numbers as Python's."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a row holds {value!r}; rows take text and numbers")


def _in_one_line(error: BaseException) -> str:
    """Return what an error says, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())
