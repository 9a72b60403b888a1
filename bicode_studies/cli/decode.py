"""``bicode decode FILE``: read a recording, and write one row per track and period, or per packet or letter."""

from __future__ import annotations

import csv
import dataclasses
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click

from bicode_lab.events import Events
from bicode_lab.lights.name import name_region
from bicode_lab.recognition import ReceiverSettings, Sighting, packet_rows, recognise
from bicode_lab.recognition.sighting import COLUMNS as SIGHTING_COLUMNS
from bicode_lab.recordings import Recording, open_recording
from bicode_lab.sequential import SequentialSettings
from bicode_lab.sequential.receiver import EVIDENCE_COLUMNS
from bicode_lab.soft_receiver import UartLine, read_text
from bicode_studies.cli.helpers.kernel_files import say_if_compiling
from bicode_studies.cli.helpers.light_rows import WIDTHS as LIGHT_WIDTHS
from bicode_studies.cli.helpers.light_rows import answer_of_rows, light_rows, reader_of
from bicode_studies.cli.helpers.marker_options import board_options, marker_option, packet_options
from bicode_studies.cli.helpers.pose_columns import COLUMNS as POSE_COLUMNS
from bicode_studies.cli.helpers.pose_columns import PoseColumns
from bicode_studies.cli.helpers.progress import chunks_with_progress, waiting
from bicode_studies.cli.helpers.reading import CAMERA_HELP, RECEIVERS, Request, request_of, time_options
from bicode_studies.cli.options import Number, Real
from bicode_studies.inspect.answer import Answer
from bicode_studies.inspect.lights import light_in_words
from bicode_studies.inspect.other_settings import find_settings
from bicode_studies.real_light.beacon_files import read_beacon

Row = dict[str, Any]

TABLE_WIDTHS = {
    "t_us": 12, "track": 5, "x": 5, "y": 5, "w": 4, "h": 4, "id": 5, "reason": 10, "n_packets": 9, "marker_2d_id": 12,
    "x_m": 8, "y_m": 8, "z_m": 8, "roll_deg": 9, "pitch_deg": 9, "yaw_deg": 9,
}  # fmt: skip
SIGHTING_WIDTHS = dict.fromkeys((*SIGHTING_COLUMNS, *POSE_COLUMNS), 0)
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
    type=click.Choice(list(RECEIVERS)),
    default="sequential",
    show_default=True,
    help="The sequential receiver weighs all evidence of a track and gives an ID as soon as it is sure; the paper's "
    "receiver reads each packet for itself; the soft receiver weighs one second of a track (no poses).",
)
@marker_option
@packet_options(auto=True)
@board_options(aruco_id=False)
@click.option("--size-m", type=Real(), help="Side of the ArUco pattern [m], for the pose.  [default: 0.05]")
@click.option("--camera", type=click.Path(dir_okay=False, path_type=Path), help=CAMERA_HELP)
@click.option("--focal-px", type=Real(), help="Focal length [px], for the pose.  [default: 1646.09]")
@time_options
@click.option(
    "--line-code",
    type=click.Choice(["bicode", "uart", "interval", "frequency"]),
    default="bicode",
    show_default=True,
    help="Line code of the light.",
)
@click.option("--rate-hz", type=Real(), help="Baud rate of a UART light, or base rate of an interval code [Hz].")
@click.option("--width", type=Number(), help="Sensor width [px], if the file does not state it.")
@click.option("--height", type=Number(), help="Sensor height [px], if the file does not state it.")
@click.option("--lenient", is_flag=True, help="Read the good events of a damaged file, and report what was dropped.")
@click.option("--find", is_flag=True, help="Try other settings on the first seconds, and say which would read it.")
@click.option("--quiet", is_flag=True, help="Write no answer in words to standard error.")
def decode(
    file: Path,
    row_format: str,
    packets: bool,
    width: int | None,
    height: int | None,
    lenient: bool,
    triggers: bool,
    find: bool,
    quiet: bool,
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

    The sequential receiver has rows only where a light sends packets. In jsonl and csv, margin says how sure an ID is,
    as the natural logarithm of the odds against any other, and evidence_periods how many periods were weighed for it.

    x_m, y_m and z_m are the place of the 2D marker: right, down and ahead of the camera. roll_deg turns it in its
    plane, counter-clockwise as the camera sees it, pitch_deg and yaw_deg out of it; 0 is upright and facing. jsonl and
    csv have rvec [rad] and tvec [m] in camera axes, too, and the quaternion qw qx qy qz, whose sign stays.

    The answer in words goes to standard error: which markers, from where to where, or why there is none.

    With --line-code interval (pulses 2, 3 or 4 base periods apart) and --line-code frequency (each LED has its own)
    there is one row per region that blinks and 50 ms: value or rate_hz, and how sure it is; else a reason:
    too_few_events, other_light, not_sure.

    With --line-code uart, FILE is one light that sends letters (start bit 0, 7 bits, even parity, two stop bits; on
    is 1), such as the .mat file of a public beacon. Then there is one row per letter. Letters are read by the soft
    receiver, whatever --receiver says.
    """  # noqa: D301 (click needs the control character)
    line_code = options.pop("line_code")
    if line_code != "bicode" and packets:
        raise ValueError(
            f"--packets is for Bicode's packets; with --line-code {line_code} there are none, leave it out"
        )
    if line_code == "uart":
        letters = _read_letters(file, options["rate_hz"], width, height, row_format)
        _write(letters, LETTER_WIDTHS, row_format)
        _say([_answer_of_letters(letters)], quiet)
        return
    if options["rate_hz"] is not None and line_code == "bicode":
        raise ValueError(
            "--rate-hz is for a UART light; give it with --line-code uart, or give a marker's bit rate with --f-id-hz"
        )
    recording = open_recording(file, width=width, height=height, lenient=lenient)
    if line_code != "bicode":
        read = reader_of(line_code, options["rate_hz"])
        say_if_compiling()
        rows = list(light_rows(recording.read(), read, recording.width, recording.height))
        _write(rows, LIGHT_WIDTHS, row_format)
        _say([answer_of_rows(rows)], quiet)
        return
    if recording.size_from == "assumed":
        size = f"{recording.width}x{recording.height}"
        click.echo(f"{file}: does not state its sensor size; {size} px assumed (--width, --height)", err=True)
    if triggers:
        for _ in chunks_with_progress(recording):
            pass
        _write((_trigger_row(mark) for mark in recording.triggers.tolist()), TRIGGER_WIDTHS, row_format)
        return
    request = request_of(options, recording.width, recording.height, periods=2 if packets else 1)
    say_if_compiling()
    if find:
        _say(find_settings(chunks_with_progress(recording), request.settings), quiet=False)
    else:
        _read_markers(recording, request, packets, row_format, quiet)


def _read_markers(recording: Recording, request: Request, packets: bool, row_format: str, quiet: bool) -> None:
    """Write a row for each sighting, or for each packet, and the answer in words."""
    _say(request.remarks, quiet)
    answer = Answer(request.settings)
    events = answer.events(chunks_with_progress(recording))
    sightings = answer.sightings(map(request.corrected, recognise(events, request.receiver)))
    if packets:
        _write((dataclasses.asdict(row) for row in packet_rows(sightings)), PACKET_WIDTHS, row_format)
    else:
        columns = TABLE_WIDTHS if row_format == "table" else SIGHTING_WIDTHS
        if isinstance(request.receiver, SequentialSettings) and row_format != "table":
            columns = {**columns, **dict.fromkeys(EVIDENCE_COLUMNS, 0)}
        _write(_rows(sightings), columns, row_format)
    if recording.dropped:
        counts = ", ".join(f"{count:,} {cause}" for cause, count in recording.dropped.items())
        click.echo(f"{recording.path}: dropped {counts}", err=True)
    if not answer.ids and not quiet and not isinstance(request.receiver, ReceiverSettings):
        answer.explain()
    _say(answer.lines(times_are_told=bool(recording.remarks)), quiet)
    if not answer.ids and answer.reasons and not quiet:
        _say(find_settings(answer.begin, request.settings), quiet)
        _say(["bicode inspect says whether the recording itself is sound"], quiet)


def _answer_of_letters(letters: list[Row]) -> str:
    """Return how many letters were read, in words."""
    if not letters:
        return "no letter: the light sends none at this rate; check --rate-hz"
    right = sum(bool(row["parity_ok"]) for row in letters)
    seconds = (letters[-1]["t_us"] - letters[0]["t_us"]) * 1e-6
    return f"{len(letters)} letters in {seconds:.3f} s, {right} of them with the right parity"


def _rows(sightings: Iterable[Sighting]) -> Iterator[Row]:
    """Yield a row for each sighting: its own columns and those of its pose."""
    pose = PoseColumns()
    for sighting in sightings:
        yield {**sighting.row(), **pose(sighting)}


def _say(lines: Iterable[str], quiet: bool) -> None:
    """Write lines to standard error, after what standard output has got so far."""
    if not quiet:
        sys.stdout.flush()
        for line in lines:
            click.echo(line, err=True)


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
    with waiting("reading letters"):
        reading = read_text(events, line)
    if reading.warning:
        click.echo(f"{file}: {reading.warning}", err=True)
    if not reading.characters:
        click.echo(f"{file}: {light_in_words(name_region(events))}", err=True)
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
    if isinstance(value, float):
        return show(value)
    return str(value)
