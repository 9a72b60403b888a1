"""Files that a command writes: nothing that is there is replaced without a word, and a full disk is named."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

OS_ERROR = re.compile(r"\(os error (\d+)\)")  # how faery words an error of the operating system


def force_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option ``--force``, which lets a command replace files."""
    return click.option("--force", is_flag=True, help="Replace files that are there.")(command)


def refuse_existing(files: Iterable[Path], force: bool = False) -> None:
    """Raise ValueError if a file is there and may not be replaced.

    Parameters
    ----------
    files : iterable of Path
        Files that are about to be written.
    force : bool
        Whether they may be replaced.

    Raises
    ------
    ValueError
        The line names the files and the way out.
    """
    there = [file for file in files if os.path.lexists(file)]
    if there and not force:
        verb = "is there already and is" if len(there) == 1 else "are there already and are"
        named = ", ".join(map(str, there))
        raise ValueError(f"{named} {verb} not replaced; choose another name, or give --force to replace it")


@contextmanager
def written(file: Path) -> Iterator[None]:
    """Turn an error of the operating system while a file is written into one line that names the file.

    Parameters
    ----------
    file : Path
        The file that the block writes.

    Raises
    ------
    ValueError
        If the disk is full, the folder cannot be written to, and the like.
    """
    try:
        yield
    except OSError as error:
        raise ValueError(f"{file} cannot be written ({error.strerror or error})") from None
    except RuntimeError as error:  # faery's
        found = OS_ERROR.search(str(error))
        if found:
            words = os.strerror(int(found.group(1)))
        elif "No space left on device" in str(error):
            words = "No space left on device"
        else:
            raise
        raise ValueError(f"{file} cannot be written ({words})") from None


def write_whole(file: Path, text: str) -> None:
    """Write a text so that the file appears complete or not at all.

    Parameters
    ----------
    file : Path
    text : str

    Raises
    ------
    ValueError
        If it cannot be written.
    """
    unfinished = file.with_name(f".{file.name}.{os.getpid()}.part")
    with written(file):
        try:
            unfinished.write_text(text, encoding="utf-8")
            unfinished.replace(file)
        finally:
            unfinished.unlink(missing_ok=True)
