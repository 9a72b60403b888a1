"""The workers of a Dask cluster (extra ``[cluster]``).   trials -> outcomes

The scheduler gives trials of a worker that died to another (as often as its setting
``allowed-failures`` says, 3 unless changed) and reports one that took so many with it;
the sweep then tries that one again by itself.
"""

from __future__ import annotations

import queue
from collections.abc import Iterator
from typing import Any

from bicode_studies.sweep.store import Key
from bicode_studies.sweep.task import Outcome, Task, Trial

TIMEOUT_S = 10
A_LOT = 1_000_000  # trials; the scheduler holds them all and shares them out


class ClusterWorkers:
    """A connection to a scheduler.

    Parameters
    ----------
    task : Task
    address : str
        Such as ``"tcp://host:8786"``.

    Raises
    ------
    ValueError
        The package distributed is missing, the address is none.
    ConnectionError
        Nobody answers there, or no worker is connected.
    """

    at_once = A_LOT

    def __init__(self, task: Task, address: str) -> None:
        try:
            import distributed
        except ImportError:
            raise ValueError(
                f"cluster={address!r} needs the package distributed; pip install 'bicode-lab[cluster]'"
            ) from None
        self._address, self._task = address, task
        self._running: dict[Any, Key] = {}
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        try:
            self._client = distributed.Client(address, timeout=TIMEOUT_S, set_as_default=False)
        except ValueError as error:
            raise ValueError(f"cluster={address!r} is no address ({error}); write tcp://HOST:PORT") from None
        except OSError:
            raise ConnectionError(
                f"no cluster answers at {address}; start one with: dask scheduler, and dask worker {address}"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=TIMEOUT_S)
        except TimeoutError:
            self._client.close()
            raise ConnectionError(
                f"the cluster at {address} has no workers; start one with: dask worker {address}"
            ) from None

    def start(self, key: Key, trial: Trial) -> None:
        """Have a trial run."""
        future = self._client.submit(self._task, *trial, pure=False)
        self._running[future] = key
        future.add_done_callback(self._done.put)

    def finished(self) -> Iterator[tuple[Key, Outcome]]:
        """Wait until a trial is done, and give it back."""
        future = self._next()
        yield self._running.pop(future), self._outcome_of(future)

    def _outcome_of(self, future: Any) -> Outcome:
        """A future that was done in; what became of its trial out.

        Its result may have died with a worker before it was fetched; it is then waited for again.
        """
        from distributed import KilledWorker

        try:
            outcome: Outcome = future.result()
        except KilledWorker:
            return Outcome()
        except Exception as error:
            if future.cancelled() or self._client.status != "running":
                raise self._gone() from None
            return Outcome(error=" ".join(f"{type(error).__name__}: {error}".split()))
        return outcome

    def _next(self) -> Any:
        """A future that is done; the connection is looked at while there is none."""
        while True:
            try:
                return self._done.get(timeout=1.0)
            except queue.Empty:
                if self._client.status != "running":
                    raise self._gone() from None

    def _gone(self) -> ConnectionError:
        """What to say when the scheduler is gone."""
        return ConnectionError(
            f"the cluster at {self._address} went away; what was done is kept, and the same call goes on with the rest"
        )

    def close(self) -> None:
        """Give up what was not done, and leave."""
        self._client.cancel(list(self._running), force=True)
        self._client.close(timeout=TIMEOUT_S)
