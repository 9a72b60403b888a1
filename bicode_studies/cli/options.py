"""Types of options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


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
