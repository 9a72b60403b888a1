"""All settings of a marker in one text file, ``marker.toml``, for the receiver and the simulation.

The file has the marker's own values at its top, and a table each for the plate (``[board]``) and the packet
(``[packet]``). The names are those of `Marker`, `Board` and `PacketFormat`; what is left out has its default.
"""

from __future__ import annotations

import difflib
import os
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

from bicode_lab.marker import Board, Marker, PacketFormat

MARKER_FILE = "marker.toml"
OWN = ("payload", "current_ma", "band", "clock_error_ppm", "rise_time_us")
HEAD = "# One Bicode marker. bicode decode RECORDING --marker marker.toml reads it, bicode simulate simulates it.\n"


def marker_text(marker: Marker) -> str:
    """Return the text of a marker's file.

    Parameters
    ----------
    marker : Marker
        Its phase is left out, since it is another one each time that the marker is switched on.

    Returns
    -------
    str
        TOML.

    Examples
    --------
    >>> print(marker_text(Marker(payload=37)).splitlines()[1])
    payload = 37
    """
    tables: dict[str, Any] = {"board": marker.board, "packet": marker.packet_format}
    lines = [f"{name} = {_value(getattr(marker, name))}" for name in OWN]
    for title, part in tables.items():
        lines += ["", f"[{title}]"]
        lines += [f"{each.name} = {_value(getattr(part, each.name))}" for each in fields(part)]
    return HEAD + "\n".join(lines) + "\n"


def read_marker(path: str | os.PathLike[str]) -> Marker:
    """Read a marker from its file.

    Parameters
    ----------
    path : path-like
        A file as `marker_text` makes it.

    Returns
    -------
    Marker

    Raises
    ------
    ValueError
        If the file cannot be read, is no TOML, or has a name or a value that no marker has.
    """
    file = Path(path)
    try:
        read = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror}; bicode marker --id 37 --out DIR writes such a file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file} is not a marker's settings in TOML ({error}); write name = value lines") from None
    board, packet = read.pop("board", {}), read.pop("packet", {})
    try:
        return Marker(
            board=Board(**_checked(board, Board(), "[board]")),
            packet_format=PacketFormat(**_checked(packet, PacketFormat(), "[packet]")),
            **_checked(read, Marker(), "the top"),
        )
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None


def _checked(given: Any, example: Any, where: str) -> dict[str, Any]:
    """Return the values of a table, after checking that each has a known name and the type of the example's."""
    if not isinstance(given, dict):
        raise ValueError(f"{where} is {given!r} and not a table; write {where} on a line of its own")
    known = [each.name for each in fields(example)] if not isinstance(example, Marker) else list(OWN)
    checked: dict[str, Any] = {}
    for name, value in given.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            raise ValueError(f"{name} is no setting of {where}; {f'write {near[0]}' if near else f'there are {known}'}")
        kind = type(getattr(example, name))
        fits = isinstance(value, (int, float)) if kind is float else isinstance(value, kind)
        if not fits or isinstance(value, bool):
            word = {int: "a whole number", float: "a number", str: "a text in quotes"}[kind]
            raise ValueError(f"{name}={value!r} is not {word}")
        checked[name] = float(value) if kind is float else value
    return checked


def _value(value: float | str) -> str:
    """Return a value as TOML writes it."""
    return f'"{value}"' if isinstance(value, str) else repr(value)
