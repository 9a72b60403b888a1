"""What travels to a worker and back.   a task, a trial -> an outcome"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bicode_studies.sweep.digest import digest_of
from bicode_studies.sweep.store import Key, Rows

Trial = tuple[Any, int]
"""A condition and a seed."""
TrialFunction = Callable[[Any, int], Rows]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a trial: its rows as JSON, or why there are none; both empty where its worker died."""

    rows: str = ""
    error: str = ""


class Workers(Protocol):
    """Whatever runs trials: the processes of `LocalWorkers`, the machines of `cluster.ClusterWorkers`."""

    at_once: int  # most trials it is given at a time

    def start(self, key: Key, trial: Trial) -> None:
        """Have a trial run."""

    def finished(self) -> Iterator[tuple[Key, Outcome]]:
        """Wait until some trials are done, and give them back."""

    def close(self) -> None:
        """End every worker, at once."""


@dataclass(frozen=True)
class Task:
    """The function that runs trials, with the digest its code must have where it runs."""

    function: TrialFunction
    digest: str
    data_files: tuple[str, ...]

    def __call__(self, condition: Any, seed: int) -> Outcome:
        """A trial in, what became of it out; nothing is raised, so that it travels whatever it was."""
        try:
            if digest_of(self.function, self.data_files) != self.digest:
                return Outcome(error="a worker has other code than this process; start both anew with the same code")
            return Outcome(rows=json.dumps(self.function(condition, seed), default=_plain))
        except Exception as error:
            return Outcome(error=" ".join(f"{type(error).__name__}: {error}".split()))


def _plain(value: Any) -> Any:
    """One of numpy's numbers in, Python's out."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a row holds {value!r}; rows take text and numbers")
