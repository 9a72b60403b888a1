"""``bicode simulate OUT``: simulate a marker in front of the camera, and write its events and the ground truth."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from click.core import ParameterSource
from tqdm import tqdm

from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Recorder, Scene, Still, spin, stream_over, truth_table
from bicode_lab.events import Events
from bicode_lab.recordings import WRITABLE, open_recording, write_recording
from bicode_studies.cli.helpers.kernel_files import say_if_compiling
from bicode_studies.cli.helpers.marker_options import board_options, marker_of, marker_option, packet_options
from bicode_studies.cli.helpers.output_files import force_option, refuse_existing, write_whole, written
from bicode_studies.cli.options import Number, Real
from bicode_studies.own_recording.mystery import SECONDS, fingerprint_ids, make_mystery_scene


@click.command()
@click.argument("out", type=click.Path(dir_okay=False, path_type=Path))
@marker_option
@click.option("--payload", type=Number(), help="ID that the marker blinks.  [default: 0x25]")
@board_options()
@click.option("--distance-m", type=Real(), default=2.5, show_default=True, help="Distance from the camera [m].")
@click.option("--x-m", type=Real(), default=0.0, show_default=True, help="Offset to the right of the optical axis [m].")
@click.option("--y-m", type=Real(), default=0.0, show_default=True, help="Offset below the optical axis [m].")
@click.option("--yaw-deg", type=Real(), default=0.0, show_default=True, help="Rotation out of the plane [deg] (IV-B).")
@click.option("--rpm", type=Real(), default=0.0, show_default=True, help="Spin in the plane [turns per minute] (IV-F).")
@click.option("--size-m", type=Real(), help="Side of the plate [m].  [default: 0.05]")
@click.option("--current-ma", type=Real(), help="Current of the LED while on [mA].  [default: 10.7]")
@click.option("--lux", type=Real(), default=350.0, show_default=True, help="Ambient light [lx].")
@packet_options()
@click.option(
    "--clock-error-ppm",
    type=Real(),
    help="Error of the transmitter's clock [ppm]; above 0 it is fast.  [default: 0]",
)
@click.option("--seconds", type=Real(), default=1.0, show_default=True, help="Length [s]; not used with --background.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of all random draws.")
@click.option("--background", type=click.Path(path_type=Path), help="Recording to which the marker is added.")
@click.option(
    "--mystery",
    type=click.IntRange(0),
    metavar="SEED",
    help="Write an exercise instead: four markers with hidden IDs that are drawn from SEED.",
)
@force_option
def simulate(
    out: Path, seconds: float, seed: int, background: Path | None, mystery: int | None, force: bool, **options: Any
) -> None:
    """Write the events of a simulated marker to OUT, and the ground truth to a file beside it.

    The ending of OUT tells the format: .npz, .raw (EVT3), .aedat4, .dat, .csv or .h5. The ground truth has the whole
    name of OUT and .truth.json behind it: m.npz.truth.json beside m.npz. Files that are there are not replaced without
    --force.

    With --mystery there is no ground truth. The command prints a fingerprint, which checks an answer without
    revealing it: bicode_studies.own_recording.mystery.fingerprint_ids gives the same for the right IDs.
    """
    if out.suffix.lower() not in WRITABLE:
        raise ValueError(f"{out.name} names no format that can be written; end it in one of {' '.join(WRITABLE)}")
    if not out.parent.is_dir():
        raise ValueError(f"there is no folder {out.parent}; make it first")
    truth_file = truth_path(out)
    refuse_existing([out] if mystery is not None else [out, truth_file], force)
    say_if_compiling()
    if mystery is not None:
        _write_mystery(out, mystery)
        return
    rng = np.random.default_rng(seed)
    scene = _scene(options, phase_share=float(rng.random()))
    if background is None:
        recorder = Recorder(scene, seconds, rng)
        counted = EventCounter(_with_progress_bar(recorder))
    else:
        recording = open_recording(background)
        scene = replace(scene, optics=replace(scene.optics, width=recording.width, height=recording.height))
        chunks = stream_over(recording.chunks(), scene, rng)
        counted = EventCounter(tqdm(chunks, unit=" chunks", disable=None, delay=2))
    with written(out):
        shift_us = write_recording(out, counted, scene.optics.width, scene.optics.height)
    start_us, duration_us = (0, round(seconds * 1e6)) if background is None else (counted.first_us, counted.length_us)
    lost = recorder.queue.lost if background is None else 0
    if shift_us:
        click.echo(f"{out}: its clock begins at 0; {shift_us} us were subtracted (header line t0)", err=True)
    truth = {"seed": seed, "n_events": counted.size, "n_lost": lost, **truth_table(scene, duration_us, start_us)}
    write_whole(truth_file, json.dumps(truth, indent=1) + "\n")
    click.echo(f"{out}: {counted.size} events in {duration_us * 1e-6:g} s; {truth_file}: the truth")


def truth_path(recording: Path) -> Path:
    """Return the file of the ground truth of a recording: its whole name, so that no two recordings share one."""
    return recording.with_name(recording.name + ".truth.json")


class EventCounter:
    """Passes chunks of events on; afterwards it knows how many events there were, and when.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        Events in the order of time.

    Attributes
    ----------
    size : int
        Number of events so far.
    first_us, length_us : int
        Time of the first event, and time from the first event to the end of the last one so far [us].
    """

    def __init__(self, chunks: Iterable[Events]) -> None:
        self._chunks = chunks
        self.size = self.first_us = self.length_us = 0

    def __iter__(self) -> Iterator[Events]:
        """Yield the chunks one by one."""
        for chunk in self._chunks:
            if chunk.size:
                self.first_us = self.first_us if self.size else int(chunk["t"][0])
                self.length_us = int(chunk["t"][-1]) - self.first_us + 1
                self.size += chunk.size
            yield chunk


def _write_mystery(out: Path, seed: int) -> None:
    """Write the exercise recording of a seed, and print the fingerprint of its IDs."""
    ctx = click.get_current_context()
    for option in ctx.command.params:
        given = option.name and ctx.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
        if given and option.name not in ("out", "mystery", "force"):
            raise ValueError(f"--mystery decides everything by its seed; leave {option.opts[0]} out")
    scene = make_mystery_scene(seed)
    counted = EventCounter(_with_progress_bar(Recorder(scene, SECONDS, np.random.default_rng([seed, 1]))))
    with written(out):
        write_recording(out, counted, scene.optics.width, scene.optics.height)
    fingerprint = fingerprint_ids(placed.marker.payload for placed in scene.markers)
    click.echo(f"{out}: {counted.size} events in {SECONDS:g} s; fingerprint of the IDs: {fingerprint}")


def _scene(options: dict[str, Any], phase_share: float) -> Scene:
    """Return the scene that the options of the command line describe."""
    whole = marker_of(options)
    marker = replace(whole, phase_us=phase_share * whole.packet_format.packet_us)
    pose = Pose.facing(options["distance_m"], x_m=options["x_m"], y_m=options["y_m"], yaw_deg=options["yaw_deg"])
    path = spin(pose, options["rpm"]) if options["rpm"] else Still(pose)
    return Scene(
        markers=(PlacedMarker(marker=marker, path=path),),
        optics=Optics(),
        light=Light(illuminance_lux=options["lux"]),
    )


def _with_progress_bar(recorder: Recorder) -> Iterator[Events]:
    """Yield the recorder's chunks, with a progress bar on a terminal if they take longer than two seconds."""
    with tqdm(total=recorder.duration_us * 1e-6, unit="s", disable=None, delay=2) as bar:
        for chunk in recorder:
            yield chunk
            bar.update(0.01)
