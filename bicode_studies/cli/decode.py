"""``bicode decode FILE``: read a recording, and write one row per track and period, or per packet or letter."""

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
from bicode_lab.soft_receiver import SoftSettings, UartLine, read_text
from bicode_studies.cli.options import Number, Real
from bicode_studies.real_light.beacon_files import read_beacon

Row = dict[str, Any]

PERIOD_US, FRAME_2D_US = 33_000, 13_200  # the paper's values (III-B), for any bit rate of the marker

SIGHTING_WIDTHS = {
    "t_us": 12, "track": 5, "x": 5, "y": 5, "w": 4, "h": 4, "id": 5, "reason": 10,
    "n_packets": 9, "marker_2d_id": 12, "rvec": 26, "tvec": 26,
}  # fmt: skip
PACKET_WIDTHS = {"t_us": 12, "track": 5, "id": 5, "checksum_ok": 11}
LETTER_WIDTHS = {"t_us": 12, "letter": 6, "parity_ok": 9, "sure": 6}
TRIGGER_WIDTHS = {"t_us": 12, "input": 5, "level": 5}

MAX_UART_BITS = 5_000_000  # read at once; a minute at 3125 baud has 187,500


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--format",
    "row_format",
    type=click.Choice(["table", "jsonl", "csv"]),
    default="table",
    show_default=True,
    help="Format of the rows.",
)
@click.option(
    "--packets", is_flag=True, help="Write one row per packet, also for packets that cross the border of a period."
)
@click.option("--triggers", is_flag=True, help="Write one row per external trigger instead, and look for no marker.")
@click.option(
    "--receiver",
    type=click.Choice(["paper", "soft"]),
    default="paper",
    show_default=True,
    help="The paper's receiver, or the soft receiver, which combines the evidence of one second of a track (no poses).",
)
@click.option(
    "--line-code",
    type=click.Choice(["bicode", "uart"]),
    default="bicode",
    show_default=True,
    help="Line code of the light.",
)
@click.option("--rate-hz", type=Real(), help="Baud rate of a UART light [Hz].")
@click.option(
    "--manchester",
    type=click.Choice(["ieee", "thomas", "auto"]),
    default="ieee",
    show_default=True,
    help="Convention of the Manchester code; auto tries both.",
)
@click.option(
    "--checksum", type=click.Choice(["sum", "crc3"]), default="sum", show_default=True, help="Kind of the checksum."
)
@click.option("--payload-bits", type=Number(), default=8, show_default=True, help="Bits of the payload.")
@click.option("--f-id-hz", type=Real(), default=1000.0, show_default=True, help="Bit rate of the marker [Hz].")
@click.option(
    "--delta-t-id-us",
    type=Number(),
    help="Length of a bin of the LED state [us]; by default half a chip, 250 us at 1 kHz.",
)
@click.option("--width", type=Number(), help="Sensor width [px], if the file does not state it.")
@click.option("--height", type=Number(), help="Sensor height [px], if the file does not state it.")
@click.option("--lenient", is_flag=True, help="Read the good events of a damaged file, and report what was dropped.")
@click.option(
    "--size-m", type=Real(), default=0.05, show_default=True, help="Side of the ArUco pattern [m], for the pose."
)
@click.option("--focal-px", type=Real(), default=1646.09, show_default=True, help="Focal length [px], for the pose.")
def decode(
    file: Path,
    row_format: str,
    packets: bool,
    width: int | None,
    height: int | None,
    lenient: bool,
    triggers: bool,
    **options: Any,
) -> None:
    """Read every marker in FILE, a recording of an event camera; "-" reads standard input.

    FILE is RAW (EVT2, EVT2.1, EVT3, EVT4), DAT, AEDAT (2, 3.1, 4), ES, CSV, text, HDF5, npz, npy, MATLAB, Parquet or a
    ROS bag; its content tells which, and docs/formats.md what is read of each.

    There is one row per track and period of 33 ms, counted from the first event. A period in which nothing blinks has
    no row. t_us is the time by the recording's own clock; x, y, w and h are a box, counted from the top left [px]; id
    is the ID that was read. If there is none, reason says why:

    \b
    no_events   there are no events in the box
    no_start    the LED is never off long enough for a start
    cut         no whole packet lies in the period
    manchester  a bit did not switch the LED
    checksum    the bits were read, but the checksum is wrong
    conflict    two valid packets have different IDs

    rvec [rad] and tvec [m] are the pose of the 2D marker in camera axes: x right, y down, z forward.

    With --line-code uart, FILE is one light that sends letters (start bit 0, 7 bits, even parity, two stop bits; on
    is 1), such as the .mat file of a public beacon. Then there is one row per letter. Letters are read by the soft
    receiver, whatever --receiver says.
    """  # noqa: D301 (click needs the control character)
    if options.pop("line_code") == "uart":
        if packets:
            raise ValueError("--packets is for Bicode's packets; with --line-code uart a row is a letter, leave it out")
        _write(_read_letters(file, options["rate_hz"], width, height, row_format), LETTER_WIDTHS, row_format)
        return
    if options["rate_hz"] is not None:
        raise ValueError(
            "--rate-hz is for a UART light; give it with --line-code uart, or give a marker's bit rate with --f-id-hz"
        )
    recording = open_recording(file, width=width, height=height, lenient=lenient)
    if recording.size_from == "assumed":
        size = f"{recording.width}x{recording.height}"
        click.echo(f"{file}: does not state its sensor size; {size} px assumed (--width, --height)", err=True)
    if triggers:
        for _ in _with_progress_bar(recording):
            pass
        _write((_trigger_row(mark) for mark in recording.triggers.tolist()), TRIGGER_WIDTHS, row_format)
        return
    sightings = recognise(_with_progress_bar(recording), _receiver(options, recording, packets))
    if packets:
        rows: Iterable[Row] = (dataclasses.asdict(row) for row in packet_rows(sightings))
        widths = PACKET_WIDTHS
    else:
        rows, widths = (sighting.row() for sighting in sightings), SIGHTING_WIDTHS
    _write(rows, widths, row_format)
    if recording.dropped:
        counts = ", ".join(f"{count:,} {cause}" for cause, count in recording.dropped.items())
        click.echo(f"{file}: dropped {counts}", err=True)


def _read_letters(
    file: Path, rate_hz: float | None, width: int | None, height: int | None, row_format: str
) -> list[Row]:
    """Read the letters of a light; return one row per letter, with line feeds escaped in tables and CSV."""
    if rate_hz is None:
        raise ValueError("--line-code uart needs --rate-hz, the baud rate of the light: for example --rate-hz 3125")
    line = UartLine(rate_hz=rate_hz)
    if file.suffix == ".mat":
        events = read_beacon(file)
    else:
        events = open_recording(file, width=width, height=height).read()
    _refuse_long_span(file, events, rate_hz)
    reading = read_text(events, line)
    if reading.warning:
        click.echo(f"{file}: {reading.warning}", err=True)
    rows = [dataclasses.asdict(letter) for letter in reading.characters]
    if row_format != "jsonl":
        for row in rows:
            row["letter"] = row["letter"].encode("unicode_escape").decode()
    return rows


def _refuse_long_span(file: Path, events: Events, rate_hz: float) -> None:
    """Raise ValueError where the times span more bits of a UART light than can be held in memory."""
    span_s = (int(events["t"][-1]) - int(events["t"][0])) / 1e6 if events.size else 0.0
    if span_s * rate_hz > MAX_UART_BITS:
        raise ValueError(
            f"{file}: {events.size:,} events in {span_s:,.0f} s, or {span_s * rate_hz:.2g} bits at {rate_hz:g} Hz; "
            f"at most {MAX_UART_BITS:,} are read: check the unit of the times, or cut out where the light sends"
        )


def _receiver(options: dict[str, Any], recording: Recording, packets: bool) -> ReceiverSettings | SoftSettings:
    """Return the settings of the receiver that was asked for, after checking that it can read such packets."""
    settings = _settings(options, recording)
    if options["receiver"] == "soft":
        return SoftSettings(receiver=settings)
    _refuse_long_packets(settings.packet_format, periods=2 if packets else 1)
    return settings


def _settings(options: dict[str, Any], recording: Recording) -> ReceiverSettings:
    """Return the receiver settings that the options of the command line describe."""
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
    """Raise ValueError if a packet is too long to lie in `periods` periods; the paper's receiver cannot read it."""
    longest_us = periods * PERIOD_US
    if packet_format.packet_us > longest_us:
        least_hz = math.ceil(packet_format.f_id_hz * packet_format.packet_us / longest_us)
        raise ValueError(
            f"a packet of {packet_format.packet_us / 1000:g} ms (f_id_hz={packet_format.f_id_hz:g}) is never whole in "
            f"{longest_us / 1000:g} ms and cannot be read; choose --f-id-hz {least_hz} or more, or --receiver soft"
        )


def _with_progress_bar(recording: Recording) -> Iterator[Events]:
    """Yield the recording's chunks, with a progress bar on a terminal if they take longer than two seconds."""
    said: set[str] = set()
    with tqdm(unit=" events", unit_scale=True, disable=None, delay=2) as bar:
        for chunk in recording.chunks():
            _say_remarks(recording, said)
            yield chunk
            bar.update(chunk.size)
    _say_remarks(recording, said)


def _say_remarks(recording: Recording, said: set[str]) -> None:
    """Say what the recording remarks, each line once and as soon as it is known."""
    for line in recording.remarks:
        if line not in said:
            said.add(line)
            click.echo(f"{recording.path}: {line}", err=True)


def _trigger_row(mark: tuple[int, int, int]) -> Row:
    """Return the row of an external trigger."""
    level, t_us, number = mark
    return {"t_us": t_us, "input": number, "level": level}


def _write(rows: Iterable[Row], widths: dict[str, int], row_format: str) -> None:
    """Write rows to standard output, each as soon as it is known."""
    if row_format == "jsonl":
        for row in rows:
            click.echo(json.dumps(row))
    elif row_format == "csv":
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
    """Return the text of a cell for a value."""
    show: Callable[[float], str] = "{:.4f}".format
    if value is None:
        return missing
    if isinstance(value, tuple):
        return between.join(show(v) for v in value)
    return str(value)
