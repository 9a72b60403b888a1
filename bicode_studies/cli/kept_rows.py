"""Rows that a long run leaves in a CSV for the next   a path, the function that makes them -> those it would make again

Each row carries the digest of the code that made it. Rows of other code (another constant of the
camera, another rule of a receiver) are dropped, so that no table is a mixture.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pandas as pd

from bicode_studies.sweep.digest import digest_of

_PACKAGE = Path(__file__).resolve().parents[2] / "bicode_lab"
CONSTANTS = tuple(f"{_PACKAGE.name}/{path.name}" for path in sorted(_PACKAGE.glob("*.csv")))
"""Numbers that the code reads from tables."""


class KeptRows:
    """A CSV of rows made by `function`, as it is now.

    Parameters
    ----------
    path : Path
        Made, with its folder, when the first row comes; rows of other code that are in it are dropped then.
    function : callable
        What makes rows.
    """

    def __init__(self, path: Path, function: Callable[..., Any]) -> None:
        self.path = path
        self.digest = digest_of(function, CONSTANTS)
        self.table = pd.DataFrame()
        self._begun = False
        if path.exists():
            try:
                table = pd.read_csv(path)
            except (ValueError, UnicodeDecodeError):
                raise ValueError(f"{path} is not a table of an earlier run; give another file with --out") from None
            same = table["digest"] == self.digest if "digest" in table else pd.Series(False, index=table.index)
            self.table = table[same]
            if not same.all():
                click.echo(f"{path.name}: {(~same).sum()} rows were made by other code and are made again", err=True)

    def add(self, rows: pd.DataFrame) -> None:
        """New rows in; they are in the file at once."""
        if not self._begun:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.write(self.table)
            self._begun = True
        rows = rows.assign(digest=self.digest)
        rows.to_csv(self.path, mode="a", index=False, header=self.table.empty, lineterminator="\n")
        self.table = pd.concat([self.table, rows], ignore_index=True)

    def write(self, table: pd.DataFrame) -> None:
        """The whole table, in the order it is to have, in; the file holds just that."""
        if table.empty:
            self.path.unlink(missing_ok=True)
        else:
            table.to_csv(self.path, index=False, lineterminator="\n")
        self.table = table
