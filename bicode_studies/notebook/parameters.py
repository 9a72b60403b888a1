"""The parameters of a notebook: read from its first code cell, and checked before a run.

The cell is tagged ``parameters`` and holds literals only, one a line, each with its meaning:

    distance_m = 2.5  # from the camera to the marker [m], as in Fig. 2

papermill only warns when it is given a name the notebook does not have; here it is an error.
"""

from __future__ import annotations

import ast
import difflib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text", list: "a list", tuple: "a tuple"}


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One line of a notebook's parameters cell."""

    name: str
    default: Any
    meaning: str


def parameters_of(path: str | Path) -> dict[str, Parameter]:
    """A notebook's path in, its parameters out, by name and in the order of the cell.

    Raises
    ------
    ValueError
        No such notebook, no cell tagged ``parameters``, or a line that is not ``name = literal``.
    """
    path = Path(path)
    source = _parameters_source(path)
    lines = source.splitlines()
    parameters = {}
    try:
        statements = ast.parse(source).body
    except SyntaxError as error:
        where = f"line {error.lineno}: {error.msg}"
        raise ValueError(f"the parameters cell of {path.name} is not Python: {where}") from None
    for statement in statements:
        line = lines[statement.lineno - 1]
        try:
            if not isinstance(statement, ast.Assign) or not isinstance(statement.targets[0], ast.Name):
                raise ValueError
            default = ast.literal_eval(statement.value)
        except ValueError:
            raise ValueError(
                f"the parameters cell of {path.name} holds {line.strip()!r}; write: name_unit = literal  # meaning"
            ) from None
        name = statement.targets[0].id
        comment = line.encode()[statement.end_col_offset or 0 :].decode().strip().lstrip("#").strip()
        parameters[name] = Parameter(name=name, default=default, meaning=comment)
    return parameters


def check_parameters(path: str | Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """A notebook and values for some of its parameters in, the values in the types of their defaults out.

    Text is read as a value of the default's type, so that what is typed after ``-p`` may be passed as it is.

    Raises
    ------
    ValueError
        A name the notebook does not have (the nearest is named), or a value of another type.
    """
    path = Path(path)
    known = parameters_of(path)
    values = {}
    for name, value in given.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            guess = f" did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"unknown parameter {name!r} of {path.name};{guess} It has: {', '.join(known) or 'none'}")
        default = known[name].default
        try:
            values[name] = _as_kind_of(default, value)
        except (ValueError, SyntaxError):
            kind = KINDS.get(type(default), "a literal")
            raise ValueError(
                f"parameter {name!r} of {path.name} is {kind} (its default is {default!r}), not {value!r}"
            ) from None
    return values


def _as_kind_of(default: Any, value: Any) -> Any:
    """The value in the type of the default; `ValueError` where it has another."""
    kind = type(default)
    if isinstance(value, str) and kind is not str:
        return _read_text(default, value)
    if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        value = float(value)
        if not math.isfinite(value):
            raise ValueError
        return value
    if default is not None and type(value) is not kind:
        raise ValueError
    return value


def _read_text(default: Any, text: str) -> Any:
    """Typed text as a value of the default's type."""
    if isinstance(default, bool):
        words = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
        if text.strip().lower() not in words:
            raise ValueError
        return words[text.strip().lower()]
    if isinstance(default, int):
        return int(text, 0)
    if isinstance(default, float):
        return _as_kind_of(default, float(text))
    if default is None:
        try:
            return ast.literal_eval(text)
        except (ValueError, SyntaxError):
            return text
    return _as_kind_of(default, ast.literal_eval(text))


def _parameters_source(path: Path) -> str:
    """The text of the cell tagged ``parameters``."""
    if not path.is_file():
        raise ValueError(f"{path}: no such notebook")
    try:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path} is not a notebook (.ipynb, format 4)") from None
    for cell in cells:
        if "parameters" in cell.get("metadata", {}).get("tags", []):
            return "".join(cell["source"])
    raise ValueError(f"{path.name} has no cell tagged 'parameters'; tag its first code cell")
