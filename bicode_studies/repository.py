"""Where the files of the repository are: its root, the tables in ``results/`` and the pictures in ``figures/``."""

from __future__ import annotations

import os
from pathlib import Path


def repository_root() -> Path:
    """Return the folder that holds ``notebooks/`` and ``bicode_lab/``.

    It is the first such folder from the working directory upwards, else the one the packages were installed from.

    Raises
    ------
    ValueError
        If neither is a clone of the repository.
    """
    here = Path.cwd()
    for folder in (here, *here.parents, Path(__file__).resolve().parents[1]):
        if (folder / "notebooks").is_dir() and (folder / "bicode_lab").is_dir():
            return folder
    raise ValueError(f"no notebooks/ in {here} or above it; change into the folder the repository was cloned to")


def figures_folder() -> Path:
    """Return the folder that figures are written to, and make it where it is missing.

    The environment variable ``BICODE_FIGURES`` names it; without it, it is ``figures/quick`` of the repository.
    """
    named = os.environ.get("BICODE_FIGURES")
    folder = Path(named) if named else repository_root() / "figures" / "quick"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def results_folder(quick: bool = False) -> Path:
    """Return the folder that tables of trials are written to, and make it where it is missing.

    Parameters
    ----------
    quick : bool
        Short trials go to ``results/quick``, which git ignores; those of the paper's scale to ``results``.
    """
    folder = repository_root() / "results"
    folder = folder / "quick" if quick else folder
    folder.mkdir(parents=True, exist_ok=True)
    return folder
