"""The parameters of a notebook, as papermill reads them, and the check of values before a run.

The first code cell of a notebook is tagged ``parameters``. It holds one literal per line, each with its meaning:

    distance_m = 2.5  # from the camera to the marker [m], as in Fig. 2

papermill only warns when it is given a name that the notebook does not have; here that is an error.
"""

from __future__ import annotations

import ast
import difflib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text", list: "a list", tuple: "a tuple"}
WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


class Parameter(NamedTuple):
    """One line of a notebook's parameters cell: its literal and its comment."""

    default: Any
    meaning: str


def parameters_of(path: str | Path) -> dict[str, Parameter]:
    """Read the parameters of a notebook.

    Parameters
    ----------
    path : str or Path
        The notebook.

    Returns
    -------
    dict of str to Parameter
        The parameters by name, in the order of the cell.

    Raises
    ------
    ValueError
        If there is no such notebook, no cell tagged ``parameters``, or a line that is not ``name = literal``.
    """
    from papermill.translators import PythonTranslator  # what papermill.inspect_notebook reads a cell with

    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such notebook")
    try:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{path} is not a notebook (.ipynb, format 4)") from None
    tagged = [cell for cell in cells if "parameters" in cell.get("metadata", {}).get("tags", [])]
    if not tagged:
        raise ValueError(f"{path.name} has no cell tagged 'parameters'; tag its first code cell")
    parameters = {}
    for line in filter(str.strip, "".join(tagged[0]["source"]).splitlines()):
        try:
            (found,) = PythonTranslator.inspect({"source": line})
            parameters[found.name] = Parameter(ast.literal_eval(found.default), found.help)
        except (ValueError, SyntaxError):
            raise ValueError(
                f"the parameters cell of {path.name} holds {line.strip()!r}; write: name_unit = literal  # meaning"
            ) from None
    return parameters


def check_parameters(path: str | Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """Convert values for some of a notebook's parameters to the types of their defaults.

    Text is read as a value of the default's type, so what is typed after ``-p`` may be passed on unchanged.

    Parameters
    ----------
    path : str or Path
        The notebook.
    given : mapping
        Values by the name of their parameter.

    Returns
    -------
    dict
        The same names with the converted values.

    Raises
    ------
    ValueError
        If the notebook has no parameter of that name (the nearest name is suggested), or if a value is of another type.
    """
    path = Path(path)
    known = parameters_of(path)
    values = {}
    for name, value in given.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            guess = f"did you mean {near[0]!r}? It" if near else "it"
            raise ValueError(f"unknown parameter {name!r} of {path.name}; {guess} has: {', '.join(known) or 'none'}")
        default = known[name].default
        try:
            values[name] = _converted(value, default)
        except (ValueError, SyntaxError):
            kind = KINDS.get(type(default), "a literal")
            raise ValueError(
                f"parameter {name!r} of {path.name} is {kind} (its default is {default!r}), not {value!r}"
            ) from None
    return values


def _converted(value: Any, default: Any) -> Any:
    """Return the value in the type of the default; raise `ValueError` if that is not possible."""
    kind = type(default)
    if isinstance(value, str) and kind is not str:
        value = _read_text(value, kind)
    if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        value = float(value)
    if (default is not None and type(value) is not kind) or (kind is float and not math.isfinite(value)):
        raise ValueError
    return value


def _read_text(text: str, kind: type) -> Any:
    """Read typed text as a value of a type."""
    if kind is bool and text.strip().lower() in WORDS:
        return WORDS[text.strip().lower()]
    if kind is int:
        return int(text, 0)
    if kind is float:
        return float(text)
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        if kind is type(None):
            return text
        raise
