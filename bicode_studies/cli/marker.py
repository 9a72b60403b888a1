"""``bicode marker --id 37 --out DIR``: write the sheets, the list of parts and the transmitter program of a marker."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from bicode_lab.fabrication import (
    MARKER_FILE,
    Driver,
    draw_paper,
    draw_plate,
    leds,
    marker_text,
    parts_list,
    to_pdf,
    to_svg,
    transmitter_text,
)
from bicode_lab.fabrication.transmitter import FILE, PIN_D0
from bicode_lab.marker import Board, Marker
from bicode_studies.cli.helpers.marker_options import board_options, marker_of, packet_options
from bicode_studies.cli.helpers.output_files import force_option, refuse_existing
from bicode_studies.cli.options import Number, Real


@click.command()
@click.option("--id", "payload", type=Number(), required=True, help="ID that the marker blinks, such as 37 or 0x25.")
@click.option("--out", type=click.Path(file_okay=True, path_type=Path), required=True, help="Folder for the files.")
@board_options()
@click.option("--size-m", type=Real(), help="Side of the plate [m].  [default: 0.05]")
@click.option(
    "--led", type=click.Choice(["red", "ir"]), default="red", show_default=True, help="Kind of the LED (III-A)."
)
@click.option(
    "--current-ma",
    type=Real(),
    help="Current of the LED while on [mA].  [default: as bright as the paper's 5 cm plate]",
)
@click.option("--supply-v", type=Real(), default=5.0, show_default=True, help="Supply voltage of the LED [V].")
@click.option(
    "--led-forward-v",
    type=Real(),
    help="Forward voltage of the LED [V], from its data sheet.  [default: 2.1 red, 1.2 ir]",
)
@click.option(
    "--max-current-ma",
    type=Real(),
    help="Highest current of the LED [mA], from its data sheet.  [default: 40.9 red, 20.4 ir]",
)
@click.option(
    "--pin",
    type=Number(),
    default=PIN_D0,
    show_default=True,
    help="Number of the GPIO pin; 26 is D0 of the XIAO RP2040.",
)
@packet_options()
@force_option
def marker(payload: int, out: Path, pin: int, force: bool, **options: Any) -> None:
    """Write what it takes to build a marker to a folder.

    These are the sheets for plate and paper (SVG and PDF), the list of parts, the program of the transmitter, and
    marker.toml, all settings in one file, for --marker of simulate and decode.
    """
    given = marker_of({**options, "payload": payload, "current_ma": None})
    board, packet_format = given.board, given.packet_format
    transmitter = transmitter_text(payload, packet_format, pin)
    title = f"Bicode marker: ID {payload}, ArUco {board.aruco_id} of {board.dictionary}"
    plate, paper = draw_plate(board, title), draw_paper(board, title)
    driver = _driver(board, options)
    whole = Marker(
        payload=payload,
        board=board,
        packet_format=packet_format,
        current_ma=driver.real_current_ma,
        band="visible" if options["led"] == "red" else "infrared",
    )
    pin_name = "D0 of the XIAO (GPIO 26)" if pin == PIN_D0 else f"GPIO {pin}"
    files = {
        "plate.svg": to_svg(plate).encode(),
        "plate.pdf": to_pdf(plate),
        "paper.svg": to_svg(paper).encode(),
        "paper.pdf": to_pdf(paper),
        MARKER_FILE: marker_text(whole).encode(),
        "parts.md": parts_list(whole, driver, pin_name).encode(),
        FILE: transmitter.encode(),
    }
    _write(out, files, force)
    click.echo(f"{out}: {', '.join(files)}")
    click.echo(
        f"LED resistor {driver.resistor_ohm:g} ohm: {driver.real_current_ma:.2f} mA "
        f"(check the LED's voltage and limit, see parts.md)"
    )


def _driver(board: Board, options: dict[str, Any]) -> Driver:
    """Return the circuit of the LED that the options describe."""
    led = leds()[options["led"]]
    if options["led_forward_v"] is not None:
        led = replace(led, forward_v=options["led_forward_v"], forward_from="as given")
    if options["max_current_ma"] is not None:
        led = replace(led, max_ma=options["max_current_ma"], max_from="as given")
    current_ma = options["current_ma"]
    if current_ma is None:  # as much current for the plate's area as in the paper (IV-C), as far as the LED allows
        current_ma = min(led.office_ma * (board.size_m / 0.05) ** 2, led.max_ma)
    return Driver(led=led, current_ma=current_ma, supply_v=options["supply_v"])


def _write(out: Path, files: dict[str, bytes], force: bool) -> None:
    """Write files by name to a folder, which is made where it is missing; one that is there stays if it is the same."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        files = {name: data for name, data in files.items() if not _holds(out / name, data)}
        refuse_existing([out / name for name in files if not (out / name).is_dir()], force)
        for name, data in files.items():
            (out / name).write_bytes(data)
    except OSError as error:
        raise ValueError(
            f"{out} cannot be written to ({error.strerror}); choose a folder of yours with --out"
        ) from error


def _holds(file: Path, data: bytes) -> bool:
    """Return whether a file is there and holds these bytes."""
    return file.is_file() and file.read_bytes() == data
