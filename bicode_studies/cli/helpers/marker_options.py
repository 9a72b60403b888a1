"""Options that describe a marker, one by one or all at once from its file; several commands share them.

An option that is not given has the value of the file of ``--marker``, and without that file the paper's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click

from bicode_lab.fabrication import read_marker
from bicode_lab.marker import Marker
from bicode_studies.cli.options import Number, Real

Command = Callable[..., Any]
PAPER = Marker()


def _option(name: str, kind: Any, words: str, default: object) -> Callable[[Command], Command]:
    """Return an option whose default is told, but is not set: so it is known whether it was given."""
    return click.option(f"--{name.replace('_', '-')}", type=kind, help=f"{words}  [default: {default}]")


def _all(options: list[Callable[[Command], Command]]) -> Callable[[Command], Command]:
    """Return a decorator that adds options, the first on top of the help."""

    def decorate(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def packet_options(*, auto: bool = False) -> Callable[[Command], Command]:
    """Return a decorator that adds all options of a packet.

    Parameters
    ----------
    auto : bool
        Whether ``--manchester auto`` may be chosen, as a receiver can.

    Returns
    -------
    callable
    """
    f = PAPER.packet_format
    conventions = ["ieee", "thomas", "auto"] if auto else ["ieee", "thomas"]
    tries = "; auto tries both" if auto else ""
    return _all(
        [
            _option("f_id_hz", Real(), "Bit rate of the marker [Hz].", f"{f.f_id_hz:g}"),
            _option("start_bits", Number(), "Bits of the start.", f.start_bits),
            _option("payload_bits", Number(), "Bits of the payload.", f.payload_bits),
            _option("checksum", click.Choice(["sum", "crc3"]), "Kind of the checksum.", f.checksum),
            _option("checksum_bits", Number(), "Bits of the checksum.", f.checksum_bits),
            _option(
                "manchester", click.Choice(conventions), f"Convention of the Manchester code{tries}.", f.manchester
            ),
            _option("bit_order", click.Choice(["msb", "lsb"]), "Which bit of a field is sent first.", f.bit_order),
        ]
    )


def board_options(*, aruco_id: bool = True) -> Callable[[Command], Command]:
    """Return a decorator that adds the options of a plate, without its size.

    Parameters
    ----------
    aruco_id : bool
        Whether the number of the pattern is one of them.

    Returns
    -------
    callable
    """
    b = PAPER.board
    cells = "Colour of the pattern's cells that are engraved and glow."
    options = [
        _option("dictionary", str, "Name of OpenCV's dictionary.", b.dictionary),
        _option("glow", click.Choice(["black", "white"]), cells, b.glow),
    ]
    number = _option("aruco_id", Number(), "Number of the pattern in the dictionary.", b.aruco_id)
    return _all([number, *options] if aruco_id else options)


def marker_option(command: Command) -> Command:
    """Add the option ``--marker``, the file that ``bicode marker`` writes."""
    file = click.Path(dir_okay=False, path_type=Path)
    words = "File of the marker's settings (marker.toml of bicode marker); other options change single ones."
    return click.option("--marker", "marker_file", type=file, help=words)(command)


def marker_of(options: dict[str, Any], *, any_payload: bool = False) -> Marker:
    """Return the marker that the options describe.

    Parameters
    ----------
    options : dict
        The options of the command, by name; those that are None were not given.
    any_payload : bool
        Whether the payload may be changed to fit the packet: a receiver does not ask for it.

    Returns
    -------
    Marker

    Raises
    ------
    ValueError
        If the file cannot be read, or a value is impossible.
    """
    file = options.get("marker_file")
    base = read_marker(file) if file else PAPER
    packet = _changed(base.packet_format, options, {"manchester"} if options.get("manchester") == "auto" else set())
    own = {name: options[name] for name in ("payload", "current_ma", "clock_error_ppm") if _is_given(options, name)}
    if any_payload:
        own["payload"] = 0
    return replace(base, board=_changed(base.board, options, set()), packet_format=packet, **own)


def _changed(part: Any, options: dict[str, Any], without: set[str]) -> Any:
    """Return a packet or a plate with the values that were given."""
    names = [each.name for each in fields(part) if each.name not in without]
    return replace(part, **{name: options[name] for name in names if _is_given(options, name)})


def _is_given(options: dict[str, Any], name: str) -> bool:
    """Return whether an option has a value."""
    return options.get(name) is not None
