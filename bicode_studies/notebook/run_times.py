"""Keep how long each notebook takes, and write it into the README's table of notebooks."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from bicode_studies.notebook.runner import NotebookRun

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("quick_s", "full_s")
UNKNOWN = "?"
MINUTES = re.compile(r"(?m)^(\| \[[^|]*\]\(notebooks/(\w+)\.ipynb\) \|.*\| )[\d.?]+ / [\d.?]+(?= \|)")


def read_run_times(path: Path) -> pd.DataFrame:
    """Read the table of run times; a missing file is an empty table.

    Parameters
    ----------
    path : Path
        A CSV file with the columns ``notebook``, ``quick_s`` and ``full_s``.

    Returns
    -------
    DataFrame
        ``quick_s`` and ``full_s`` [s] by the name of the notebook; NaN stands for a run that was never timed.
    """
    import pandas as pd

    if path.is_file():
        return pd.read_csv(path, index_col="notebook")
    return pd.DataFrame(columns=list(COLUMNS), index=pd.Index([], name="notebook"), dtype=float)


def write_run_times(path: Path, runs: Iterable[NotebookRun], quick: bool) -> None:
    """Enter the durations of some runs into the table; other entries stay as they are.

    Parameters
    ----------
    path : Path
        The CSV file, see `read_run_times`.
    runs : iterable of NotebookRun
        What ran. Failed runs are left out.
    quick : bool
        Whether they ran with short settings.
    """
    table = read_run_times(path)
    for run in runs:
        if run.succeeded:
            table.loc[run.notebook.stem, COLUMNS[0] if quick else COLUMNS[1]] = round(run.seconds, 1)
    table.sort_index().to_csv(path, lineterminator="\n")


def with_minutes(readme: str, table: pd.DataFrame) -> str:
    """Write the minutes of each notebook into the table of notebooks.

    Parameters
    ----------
    readme : str
        Text with rows that link a notebook and hold a cell "minutes quick / minutes full".
    table : DataFrame
        Run times, see `read_run_times`.

    Returns
    -------
    str
        The text with these cells replaced. A time that is not in the table becomes "?".

    Examples
    --------
    >>> import pandas as pd
    >>> table = pd.DataFrame({"quick_s": [7.0], "full_s": [600.0]}, index=["05_encode_an_id"])
    >>> with_minutes("| [05 Encode](notebooks/05_encode_an_id.ipynb) | Fig. 5 | ? / ? |", table)
    '| [05 Encode](notebooks/05_encode_an_id.ipynb) | Fig. 5 | 0.1 / 10.0 |'
    """

    def minutes(name: str, column: str) -> str:
        seconds = table[column].get(name, float("nan"))
        return f"{max(seconds / 60, 0.1):.1f}" if seconds == seconds else UNKNOWN

    return MINUTES.sub(lambda row: row[1] + " / ".join(minutes(row[2], column) for column in COLUMNS), readme)
