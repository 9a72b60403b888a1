"""Write the tables of the errors of poses: ``python -m bicode_studies.pose_accuracy [SEEDS]``."""

from __future__ import annotations

import sys
from pathlib import Path

from bicode_studies.pose_accuracy.cases import CASES
from bicode_studies.pose_accuracy.table import accuracy_rows, summary
from bicode_studies.repository import results_folder

SEEDS = 40


def write_tables(seeds: int, folder: Path) -> None:
    """Write ``pose_accuracy.csv``, one row for each look, and ``pose_accuracy_summary.csv``, one for each case.

    Parameters
    ----------
    seeds : int
        Number of looks of each case.
    folder : Path
    """
    rows = accuracy_rows(CASES, range(seeds))
    rows.to_csv(folder / "pose_accuracy.csv", index=False)
    summary(rows).to_csv(folder / "pose_accuracy_summary.csv", index=False)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    write_tables(count, results_folder(quick=count < SEEDS))
