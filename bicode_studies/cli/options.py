"""Types of options that several commands share."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from bicode_studies.repository import repository_root


class Number(click.ParamType[int]):
    """An integer in decimal, hexadecimal (0x..) or binary (0b..) notation."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number that a text stands for."""
        try:
            return int(str(value), 0)
        except ValueError:
            self.fail(f"{value!r} is not a whole number; write for example 37 or 0x25", param, ctx)


class Real(click.ParamType[float]):
    """A finite number; its range is checked where it is used."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number that a text stands for."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a number; write for example 2.5", param, ctx)
        return number


def needs_repository(*unless: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that lets a command begin only where it finds the repository.

    Parameters
    ----------
    *unless : str
        Options which, given together, name all that the repository is needed for.

    Returns
    -------
    callable
        The decorator, to be put right above the function of the command.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def checked(**options: Any) -> Any:
            if not unless or not all(options[name] for name in unless):
                try:
                    repository_root()
                except ValueError as error:
                    name = click.get_current_context().info_name
                    more = f", or give {' and '.join('--' + each for each in unless)}" if unless else ""
                    raise ValueError(f"bicode {name} works on a clone of the repository: {error}{more}") from None
            return command(**options)

        return checked

    return decorate


def parallel_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of commands that run trials in parallel: ``--jobs``, ``--cluster`` and ``--store``."""
    store = click.Path(dir_okay=False, path_type=Path)
    for option in (
        click.option(
            "--store", type=store, help="File in which finished trials are kept.  [default: build/sweeps.sqlite]"
        ),
        click.option("--cluster", metavar="ADDRESS", help="Run on the Dask scheduler there (tcp://HOST:8786)."),
        click.option(
            "--jobs",
            type=click.IntRange(min=1),
            help="Number of trials that run at a time.  [default: BICODE_JOBS, or the cores]",
        ),
    ):
        command = option(command)
    return command
