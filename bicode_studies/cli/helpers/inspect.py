"""``bicode inspect FILE``: say whether a recording is sound, and what to change on the camera."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from bicode_lab.events import Events
from bicode_lab.recordings import open_recording
from bicode_studies.cli.helpers.kernel_files import say_if_compiling
from bicode_studies.cli.helpers.progress import chunks_with_progress
from bicode_studies.cli.options import Number
from bicode_studies.inspect.health import examine


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--width", type=Number(), help="Sensor width [px], if the file does not state it.")
@click.option("--height", type=Number(), help="Sensor height [px], if the file does not state it.")
def inspect(file: Path, width: int | None, height: int | None) -> None:
    """Examine the recording FILE, and say what to change on the camera.

    Each line begins with ok, look (worth a look) or bad (keeps markers from being read). What is looked at: unit and
    gaps of the times, events that cannot be read, the rate over time, the balance of ON and OFF, hot pixels, rows and
    gaps that the readout makes, the flicker of lamps, and whether the pixels are fast enough for a light that blinks at
    1 kHz. A damaged file is read as far as possible.
    """
    recording = open_recording(file, width=width, height=height, lenient=True)
    click.echo(f"{file}: {recording.format}, {recording.width}x{recording.height} px ({recording.size_from})")
    say_if_compiling()
    dropped: dict[str, int] = {}

    def chunks() -> Iterator[Events]:
        yield from chunks_with_progress(recording)
        dropped.update(recording.dropped)

    for finding in examine(chunks(), recording.width, recording.height, dropped):
        click.echo(finding.line())
