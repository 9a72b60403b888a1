"""Worker processes of this machine (joblib's loky).   trials -> outcomes"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool

from joblib.externals.loky import ProcessPoolExecutor

from bicode_studies.sweep.store import Key
from bicode_studies.sweep.task import Outcome, Task, Trial

# Every worker keeps to one core; libraries read these when they are loaded.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
LOOK_S = 1.0


class LocalWorkers:
    """New processes, so that they have the code that is on disk now; they end with this one, however it ends."""

    def __init__(self, task: Task, jobs: int) -> None:
        self.at_once = jobs
        self._task = task
        self._pool = self._new_pool()
        self._running: dict[Future[Outcome], Key] = {}

    def _new_pool(self) -> ProcessPoolExecutor:
        """As many new processes."""
        return ProcessPoolExecutor(self.at_once, initializer=_settle, initargs=(os.getpid(),), env=ONE_THREAD)

    def start(self, key: Key, trial: Trial) -> None:
        """Have a trial run."""
        try:
            future = self._pool.submit(self._task, *trial)
        except BrokenProcessPool:  # a worker died since the last look; those that ran tell so themselves
            self._pool.shutdown(wait=True, kill_workers=True)
            self._pool = self._new_pool()
            future = self._pool.submit(self._task, *trial)
        self._running[future] = key

    def finished(self) -> Iterator[tuple[Key, Outcome]]:
        """Wait until some trials are done, and give them back."""
        for future in wait(self._running, return_when=FIRST_COMPLETED).done:
            key = self._running.pop(future)
            try:
                yield key, future.result()
            except BrokenProcessPool:
                yield key, Outcome()

    def close(self) -> None:
        """End every worker, at once."""
        self._pool.shutdown(wait=True, kill_workers=True)


def _settle(parent: int) -> None:
    """In a new worker: leave Ctrl-C to the parent, stay on one core, and end when the parent is gone."""
    import cv2

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    """End this process when its parent is another than it was."""
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)
