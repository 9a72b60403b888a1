"""A store of finished trials: the rows of each, by function, condition, seed and digest of the code.

It is one SQLite file with one transaction per trial. Whatever stops a sweep, a trial is in it whole or not at all, and
only once.
"""

from __future__ import annotations

import dataclasses
import json
import sqlite3
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

WAIT_S = 60.0  # for another sweep that writes to the same file
TABLE = """CREATE TABLE IF NOT EXISTS trials (
    function TEXT NOT NULL, condition TEXT NOT NULL, seed INTEGER NOT NULL, digest TEXT NOT NULL, rows TEXT NOT NULL,
    PRIMARY KEY (function, condition, seed, digest)
) WITHOUT ROWID"""

Rows = list[dict[str, Any]]


class Key(NamedTuple):
    """What a trial is kept under: its condition as JSON, and its seed."""

    condition: str
    seed: int


def key_of(condition: Any, seed: int) -> Key:
    """Return the key of a trial.

    Parameters
    ----------
    condition : dataclass of plain values
    seed : int

    Raises
    ------
    ValueError
        If the condition cannot be written as text.
    """
    if not dataclasses.is_dataclass(condition) or isinstance(condition, type):
        raise ValueError(f"condition {condition!r} is not a dataclass of plain values")
    try:
        text = json.dumps(dataclasses.asdict(condition), sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ValueError(f"condition {condition!r} holds more than text and finite numbers: {error}") from None
    return Key(text, int(seed))


class TrialStore:
    """The trials of one function and one digest in a file; use it in a ``with`` statement.

    Parameters
    ----------
    path : path
        The file; made where it is missing, with its folder.
    function : str
        Name of the function that runs trials, without its module, which may move.
    digest : str
        Digest of its code.

    Raises
    ------
    ValueError
        If the file is not a store of trials.
    """

    def __init__(self, path: str | Path, function: str, digest: str) -> None:
        self.path, self.function, self.digest = Path(path), function, digest
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._file = sqlite3.connect(self.path, timeout=WAIT_S, isolation_level=None)
            self._file.execute(TABLE)
            self._file.execute("SELECT function, condition, seed, digest, rows FROM trials LIMIT 1")
        except sqlite3.Error as error:
            raise ValueError(f"{self.path} is not a store of trials ({error}); name another file") from None

    def __enter__(self) -> TrialStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def add(self, key: Key, rows: str) -> None:
        """Store the rows of a trial, given as JSON, once; they are on disk when this returns."""
        self._file.execute(
            "INSERT OR IGNORE INTO trials VALUES (?, ?, ?, ?, ?)",
            (self.function, key.condition, key.seed, self.digest, rows),
        )

    def keys(self) -> set[Key]:
        """Return the keys of all trials that are kept."""
        found = self._file.execute(
            "SELECT condition, seed FROM trials WHERE function = ? AND digest = ?", (self.function, self.digest)
        )
        return {Key(condition, seed) for condition, seed in found}

    def rows(self, keys: Iterable[Key]) -> Rows:
        """Return the rows of the trials that are kept, in the order of the keys."""
        rows: Rows = []
        for key in keys:
            found = self._file.execute(
                "SELECT rows FROM trials WHERE function = ? AND condition = ? AND seed = ? AND digest = ?",
                (self.function, key.condition, key.seed, self.digest),
            ).fetchone()
            if found:
                rows += json.loads(found[0])
        return rows
