"""The files in which numba keeps compiled kernels: which of them are damaged, and whether there are any yet."""

from __future__ import annotations

import importlib
import pickletools
import sys
from collections.abc import Iterator
from pathlib import Path
from traceback import walk_tb
from typing import NamedTuple

import click

FIRST_RUN_S = 10  # what compiling takes on a slow machine
NO_CACHE = (
    f"compiled kernels cannot be kept anywhere, so every start compiles for some {FIRST_RUN_S} s; set NUMBA_CACHE_DIR "
    "to a folder that can be written to"
)


class Damage(NamedTuple):
    """A file of the cache that cannot be read."""

    file: Path
    why: str


def kernel_modules() -> Iterator[str]:
    """Yield the names of all modules that hold kernels.

    Yields
    ------
    str
        Dotted name.
    """
    for name in ("bicode_lab", "bicode_studies"):
        root = Path(importlib.import_module(name).__path__[0])
        for path in sorted(root.rglob("*.py")):
            if "import njit" in path.read_text(encoding="utf-8"):
                yield ".".join([name, *path.relative_to(root).with_suffix("").parts])


def damaged_kernels() -> list[Damage]:
    """Return the files in the cache of the present sources that are cut short or are no pickles.

    Nothing of them is run: only their form is looked at.

    Returns
    -------
    list of Damage
    """
    return [damage for folder in _folders() for damage in _damaged_in(folder)]


def count_kernels() -> int:
    """Return how many kernels of the present sources are kept."""
    return sum(1 for folder in _folders() for _ in folder.rglob("*.nbc"))


def _folders() -> list[Path]:
    """Return the folders in which the kernels of the present sources are kept."""
    from bicode_lab.kernels import cache_folder

    return sorted({folder for folder in map(cache_folder, kernel_modules()) if folder})


def _damaged_in(folder: Path) -> Iterator[Damage]:
    """Yield the damaged files of one folder: an index is two pickles, the code of a kernel is one."""
    for ending, pickles in ((".nbi", 2), (".nbc", 1)):
        for path in sorted(folder.rglob(f"*{ending}")):
            try:
                with path.open("rb") as file:
                    for _ in range(pickles):
                        for _ in pickletools.genops(file):
                            pass
            except FileNotFoundError:
                continue  # another process has just replaced it
            except Exception as error:
                yield Damage(path, f"{type(error).__name__}: {error}")


def explain_damage(error: BaseException) -> str | None:
    """Return one line on a damaged cache of kernels if an error came from reading it.

    Parameters
    ----------
    error : BaseException

    Returns
    -------
    str or None
        None if the error has another cause.
    """
    files = [frame.f_code.co_filename.replace("\\", "/") for frame, _ in walk_tb(error.__traceback__)]
    if not any(name.endswith("numba/core/caching.py") for name in files):
        return None
    found = damaged_kernels()
    if found:
        folders = sorted({str(damage.file.parent) for damage in found})
        what = f"the compiled kernel {found[0].file.name} is damaged or cut short"
    else:
        folders = sorted({str(folder) for folder in _folders()})
        what = f"compiled kernels cannot be read ({type(error).__name__}: {error})"
    return f"{what}; delete {' and '.join(folders)} and start again, then it is compiled anew"


def say_if_compiling() -> None:
    """Say on standard error that kernels are compiled first: on a terminal, or where they cannot be kept."""
    from bicode_lab.kernels import cache_folder

    folder = cache_folder("bicode_lab.recognition.event_codes")
    if folder is None:
        click.echo(f"bicode: {NO_CACHE}", err=True)
    elif sys.stderr.isatty() and next(folder.rglob("*.nbi"), None) is None:
        click.echo(f"compiling kernels, once; it takes some {FIRST_RUN_S} s", err=True)
