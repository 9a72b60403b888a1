"""Kinds of option that several commands share."""

from __future__ import annotations

import math
from typing import Any

import click


class Number(click.ParamType[int]):
    """A whole number, decimal or 0x.. or 0b.. ."""

    name = "integer"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Text in, number out."""
        try:
            return int(str(value), 0)
        except ValueError:
            self.fail(f"{value!r} is not a whole number; write for example 37 or 0x25", param, ctx)


class Real(click.ParamType[float]):
    """A finite number; what is more it must be is checked where it is used."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text in, number out."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a number; write for example 2.5", param, ctx)
        return number
