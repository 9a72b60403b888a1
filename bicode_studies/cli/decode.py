"""``bicode decode FILE``: a recording in, one row for each track and period out, or one for each packet."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from bicode_lab.events import Events
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import ReceiverSettings, packet_rows, recognise, settings_for
from bicode_lab.recordings import Recording, open_recording
from bicode_lab.soft_receiver import SoftSettings, UartLine, read_uart
from bicode_studies.cli.options import Number, Real
from bicode_studies.real_light.beacon_files import read_beacon

Row = dict[str, Any]

PERIOD_US, FRAME_2D_US = 33_000, 13_200  # the paper's (III-B), whatever the marker's bit rate

SIGHTING_WIDTHS = {
    "t_us": 12, "track": 5, "x": 5, "y": 5, "w": 4, "h": 4, "id": 5, "reason": 10,
    "n_packets": 9, "marker_2d_id": 12, "rvec": 26, "tvec": 26,
}  # fmt: skip
PACKET_WIDTHS = {"t_us": 12, "track": 5, "id": 5, "checksum_ok": 11}
LETTER_WIDTHS = {"t_us": 12, "letter": 6, "parity_ok": 9}


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "jsonl", "csv"]),
    default="table",
    show_default=True,
    help="Of rows.",
)
@click.option("--packets", is_flag=True, help="One row a packet, those across a period's border too.")
@click.option(
    "--receiver",
    type=click.Choice(["paper", "soft"]),
    default="paper",
    show_default=True,
    help="The paper's rule, or evidence weighed and combined over a second of a track (no poses).",
)
@click.option("--line-code", type=click.Choice(["bicode", "uart"]), default="bicode", show_default=True)
@click.option("--rate-hz", type=Real(), help="Baud of a UART light.")
@click.option("--manchester", type=click.Choice(["ieee", "thomas", "auto"]), default="ieee", show_default=True)
@click.option("--checksum", type=click.Choice(["sum", "crc3"]), default="sum", show_default=True)
@click.option("--payload-bits", type=Number(), default=8, show_default=True)
@click.option("--f-id-hz", type=Real(), default=1000.0, show_default=True, help="Bit rate of the marker.")
@click.option("--delta-t-id-us", type=Number(), help="Bin of the LED's state; by default half a chip, 250 at 1 kHz.")
@click.option("--width", type=Number(), help="Sensor [px], where the file does not say.")
@click.option("--height", type=Number(), help="Sensor [px], where the file does not say.")
@click.option("--lenient", is_flag=True, help="Read the good events of a damaged file, and say what was dropped.")
@click.option("--size-m", type=Real(), default=0.05, show_default=True, help="Side of the ArUco pattern, for the pose.")
@click.option("--focal-px", type=Real(), default=1646.09, show_default=True, help="Focal length, for the pose.")
def decode(
    file: Path, form: str, packets: bool, width: int | None, height: int | None, lenient: bool, **options: Any
) -> None:
    r"""Read every marker in FILE: event camera RAW (EVT2, EVT3), DAT, AEDAT4, ES, CSV, HDF5, or our own .npz.

    One row for each track and period of 33 ms, counted from the first event; a period in
    which nothing blinks has no row. t_us is the recording's own clock, x y w h a box from
    its top left [px], id the blinked ID; without one, reason says why:

    \b
    no_events   nothing in the box      no_start    never off for long enough
    manchester  a bit did not switch    checksum    bits read, checksum wrong
    cut         no whole packet fits    conflict    two valid IDs disagree

    rvec [rad] and tvec [m] are the pose of the 2D marker in camera axes: x right, y down,
    z forward.

    With --line-code uart, FILE is one light that sends letters (start 0, 7 bits, even parity,
    two stop bits; on is 1), such as a public beacon's .mat, and a row is a letter. Letters are
    read by the soft receiver, whatever --receiver says.
    """
    if options.pop("line_code") == "uart":
        if packets:
            raise ValueError("--packets is for Bicode's packets; with --line-code uart a row is a letter, leave it out")
        _write(_letters(file, options["rate_hz"], width, height, form), LETTER_WIDTHS, form)
        return
    if options["rate_hz"] is not None:
        raise ValueError("--rate-hz is a UART light's; give --line-code uart with it, or a marker's as --f-id-hz")
    if file.suffix == ".mat":
        raise ValueError(
            f"{file} says nothing of x and y, so no marker can be found in it; read it with --line-code uart"
        )
    recording = open_recording(file, width=width, height=height, lenient=lenient)
    if recording.size_from == "assumed":
        size = f"{recording.width}x{recording.height}"
        click.echo(f"{file}: does not say its sensor's size; {size} px assumed (--width, --height)", err=True)
    settings = _settings(options, recording)
    if options["receiver"] == "paper":
        _refuse_long_packets(settings.packet_format, periods=2 if packets else 1)
    if options["receiver"] == "soft":
        sightings = recognise(_watched(recording), SoftSettings(receiver=settings))
    else:
        sightings = recognise(_watched(recording), settings)
    if packets:
        rows: Iterable[Row] = (dataclasses.asdict(row) for row in packet_rows(sightings))
        widths = PACKET_WIDTHS
    else:
        rows, widths = (sighting.row() for sighting in sightings), SIGHTING_WIDTHS
    _write(rows, widths, form)
    if recording.dropped:
        counts = ", ".join(f"{count:,} {cause}" for cause, count in recording.dropped.items())
        click.echo(f"{file}: dropped {counts}", err=True)


def _letters(file: Path, rate_hz: float | None, width: int | None, height: int | None, form: str) -> list[Row]:
    """A light's file and its baud in, one row a letter out; in a table and in CSV line feeds are escapes."""
    if rate_hz is None:
        raise ValueError("--line-code uart needs --rate-hz, the light's baud: for example --rate-hz 3125")
    line = UartLine(rate_hz=rate_hz)
    if file.suffix == ".mat":
        events = read_beacon(file)
    else:
        events = open_recording(file, width=width, height=height).read()
    rows = [dataclasses.asdict(letter) for letter in read_uart(events, line)]
    if form != "jsonl":
        for row in rows:
            row["letter"] = row["letter"].encode("unicode_escape").decode()
    return rows


def _settings(options: dict[str, Any], recording: Recording) -> ReceiverSettings:
    """The command line's options in, the receiver's settings out."""
    convention = options["manchester"]
    packet_format = PacketFormat(
        payload_bits=options["payload_bits"],
        checksum=options["checksum"],
        f_id_hz=options["f_id_hz"],
        manchester="ieee" if convention == "auto" else convention,
    )
    times = {} if options["delta_t_id_us"] is None else {"delta_t_id_us": options["delta_t_id_us"]}
    return settings_for(
        packet_format,
        manchester=convention,
        width=recording.width,
        height=recording.height,
        delta_t_whole_us=PERIOD_US,
        delta_t_2d_us=FRAME_2D_US,
        pattern_size_m=options["size_m"],
        focal_px=options["focal_px"],
        **times,
    )


def _refuse_long_packets(packet_format: PacketFormat, periods: int) -> None:
    """The paper's rule reads a packet that is whole inside a period; with --packets it may cross one border."""
    longest_us = periods * PERIOD_US
    if packet_format.packet_us > longest_us:
        least_hz = math.ceil(packet_format.f_id_hz * packet_format.packet_us / longest_us)
        raise ValueError(
            f"a packet of {packet_format.packet_us / 1000:g} ms (f_id_hz={packet_format.f_id_hz:g}) is never whole in "
            f"{longest_us / 1000:g} ms and cannot be read; choose --f-id-hz {least_hz} or more, or --receiver soft"
        )


def _watched(recording: Recording) -> Iterator[Events]:
    """The recording's chunks, with a progress bar where somebody watches a long run."""
    with tqdm(unit=" events", unit_scale=True, disable=None, delay=2) as bar:
        for chunk in recording.chunks():
            yield chunk
            bar.update(chunk.size)


def _write(rows: Iterable[Row], widths: dict[str, int], form: str) -> None:
    """Rows in, lines on standard output, each as soon as it is known."""
    if form == "jsonl":
        for row in rows:
            click.echo(json.dumps(row))
    elif form == "csv":
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(widths)
        for row in rows:
            writer.writerow([_cell(row[name], " ") for name in widths])
            sys.stdout.flush()
    else:
        click.echo("  ".join(name.rjust(width) for name, width in widths.items()))
        for row in rows:
            click.echo("  ".join(_cell(row[name], " ", "-").rjust(width) for name, width in widths.items()))


def _cell(value: Any, between: str, missing: str = "") -> str:
    """A value in, the text of its cell out."""
    show: Callable[[float], str] = "{:.4f}".format
    if value is None:
        return missing
    if isinstance(value, tuple):
        return between.join(show(v) for v in value)
    return str(value)
