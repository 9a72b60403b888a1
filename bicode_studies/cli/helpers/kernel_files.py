"""The files in which numba keeps compiled kernels: which of them are damaged, and whether there are any yet."""

from __future__ import annotations

import importlib
import pickle
import sys
from collections.abc import Iterator
from importlib import metadata
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
    """Read the whole cache of the present sources as numba would, and return the files that cannot be read.

    Returns
    -------
    list of Damage
    """
    from bicode_lab.kernels import cache_folder

    importlib.import_module("numba.core.types")  # what is kept names its types
    folders = {folder for folder in map(cache_folder, kernel_modules()) if folder}
    return [damage for folder in sorted(folders) for damage in _damaged_in(folder)]


def _damaged_in(folder: Path) -> Iterator[Damage]:
    """Yield the damaged files of one folder."""
    for index in sorted(folder.rglob("*.nbi")):
        try:
            with index.open("rb") as file:
                version = pickle.load(file)
                rest = file.read()
            if version != metadata.version("numba"):
                continue  # numba compiles anew
            _, kept = pickle.loads(rest)
        except Exception as error:
            yield Damage(index, f"{type(error).__name__}: {error}")
            continue
        for name in kept.values():
            try:
                pickle.loads((index.parent / name).read_bytes())
            except FileNotFoundError:
                continue  # numba compiles anew
            except Exception as error:
                yield Damage(index.parent / name, f"{type(error).__name__}: {error}")


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
    if not found:
        return None
    folders = sorted({str(damage.file.parent) for damage in found})
    return (
        f"the compiled kernel {found[0].file.name} is damaged or cut short; delete {' and '.join(folders)} and start "
        "again, then it is compiled anew"
    )


def say_if_compiling() -> None:
    """Say on standard error that kernels are compiled first: on a terminal, or where they cannot be kept."""
    from bicode_lab.kernels import cache_folder

    folder = cache_folder("bicode_lab.recognition.event_codes")
    if folder is None:
        click.echo(f"bicode: {NO_CACHE}", err=True)
    elif sys.stderr.isatty() and next(folder.rglob("*.nbi"), None) is None:
        click.echo(f"compiling kernels, once; it takes some {FIRST_RUN_S} s", err=True)
