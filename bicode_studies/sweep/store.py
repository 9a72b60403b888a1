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

OPEN_WAIT_S = 10.0  # for another process, when the file is opened
WAIT_S = 60.0  # for another sweep that writes to the same file, when a trial is kept
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
        If the file is not a store of trials, cannot be opened or written to, or is in use for long.
    """

    def __init__(self, path: str | Path, function: str, digest: str) -> None:
        self.path, self.function, self.digest = Path(path), function, digest
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._file = sqlite3.connect(self.path, timeout=OPEN_WAIT_S, isolation_level=None)
            self._file.execute(TABLE)
            self._file.execute("SELECT function, condition, seed, digest, rows FROM trials LIMIT 1")
            self._file.execute(f"PRAGMA busy_timeout = {round(WAIT_S * 1000)}")
        except sqlite3.Error as error:
            raise ValueError(self._in_words(error)) from None
        self._place = _place_of(self.path)

    def __enter__(self) -> TrialStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def add(self, key: Key, rows: str) -> None:
        """Store the rows of a trial, given as JSON, once; they are on disk when this returns.

        Parameters
        ----------
        key : Key
        rows : str

        Raises
        ------
        ValueError
            If the file was removed or replaced, the disk is full, or another process does not give the file free.
        """
        self.check()
        try:
            self._file.execute(
                "INSERT OR IGNORE INTO trials VALUES (?, ?, ?, ?, ?)",
                (self.function, key.condition, key.seed, self.digest, rows),
            )
        except sqlite3.Error as error:
            self.check()
            raise ValueError(self._in_words(error, kept=True)) from None

    def check(self) -> None:
        """Raise ValueError if the file is not the one that was opened: then nothing of what is added is kept."""
        if _place_of(self.path) != self._place:
            raise ValueError(
                f"{self.path} was removed or replaced while trials ran, so none of them is kept; leave the file where "
                "it is and give the same command again"
            )

    def _in_words(self, error: sqlite3.Error, kept: bool = False) -> str:
        """Say in one line what an error of SQLite means, and what to do."""
        name = getattr(error, "sqlite_errorname", "")
        rest = f"; {self._count()} of this code are kept, and the same command goes on with the rest" if kept else ""
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            return f"{self.path} is in use by another process; wait until that one ends, or name another file{rest}"
        if name.startswith("SQLITE_FULL"):
            return f"{self.path} cannot be written: the disk is full; make room{rest}"
        if name.startswith(("SQLITE_READONLY", "SQLITE_PERM", "SQLITE_CANTOPEN", "SQLITE_IOERR")):
            return f"{self.path} cannot be read and written ({error}); check file, folder and disk{rest}"
        return f"{self.path} is not a store of trials ({error}); name another file"

    def _count(self) -> str:
        """Return how many trials are kept, in words."""
        try:
            return f"{len(self._read_keys()):,} trials"
        except sqlite3.Error:
            return "finished trials"

    def _read_keys(self) -> set[Key]:
        found = self._file.execute(
            "SELECT condition, seed FROM trials WHERE function = ? AND digest = ?", (self.function, self.digest)
        )
        return {Key(condition, seed) for condition, seed in found}

    def keys(self) -> set[Key]:
        """Return the keys of all trials that are kept; raise ValueError if they cannot be read."""
        try:
            return self._read_keys()
        except sqlite3.Error as error:
            raise ValueError(self._in_words(error)) from None

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


def _place_of(path: Path) -> tuple[int, int] | None:
    """Return the device and the number of a file; None if there is no file."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
