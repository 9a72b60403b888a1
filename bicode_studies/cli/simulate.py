"""``bicode simulate OUT``: a marker in front of the synthetic camera, as a file with its truth beside it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from tqdm import tqdm

from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Recorder, Scene, Still, spin, stream_over, truth_table
from bicode_lab.events import Events
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.recordings import WRITABLE, open_recording, write_recording
from bicode_studies.cli.options import Number, Real


@click.command()
@click.argument("out", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--payload", type=Number(), default=0x25, show_default=True, help="The blinked ID.")
@click.option("--aruco-id", type=Number(), default=7, show_default=True, help="Pattern of DICT_4X4_50.")
@click.option("--distance-m", type=Real(), default=2.5, show_default=True)
@click.option("--x-m", type=Real(), default=0.0, show_default=True, help="To the right of the optical axis.")
@click.option("--y-m", type=Real(), default=0.0, show_default=True, help="Below it.")
@click.option("--yaw-deg", type=Real(), default=0.0, show_default=True, help="Out of plane (IV-B).")
@click.option("--rpm", type=Real(), default=0.0, show_default=True, help="Spin in its plane (IV-F).")
@click.option("--size-m", type=Real(), default=0.05, show_default=True, help="Side of the plate.")
@click.option("--current-ma", type=Real(), default=10.7, show_default=True)
@click.option("--lux", type=Real(), default=350.0, show_default=True, help="Ambient light.")
@click.option("--f-id-hz", type=Real(), default=1000.0, show_default=True, help="Bit rate.")
@click.option("--payload-bits", type=Number(), default=8, show_default=True)
@click.option("--manchester", type=click.Choice(["ieee", "thomas"]), default="ieee", show_default=True)
@click.option("--checksum", type=click.Choice(["sum", "crc3"]), default="sum", show_default=True)
@click.option("--clock-error-ppm", type=Real(), default=0.0, show_default=True, help="The transmitter's clock.")
@click.option("--seconds", type=Real(), default=1.0, show_default=True, help="Not used with --background.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="All chance, the phase included.")
@click.option("--background", type=click.Path(path_type=Path), help="A recording to put the marker into.")
def simulate(out: Path, seconds: float, seed: int, background: Path | None, **options: Any) -> None:
    """Write the events of one marker to OUT and what is true of them to OUT's name with .truth.json.

    OUT's ending chooses the format: .npz, .raw (EVT3), .aedat4, .dat, .csv or .h5.
    """
    if out.suffix.lower() not in WRITABLE:
        raise ValueError(f"{out.name} names no format written here; end it in one of {' '.join(WRITABLE)}")
    if not out.parent.is_dir():
        raise ValueError(f"there is no folder {out.parent}; make it first")
    rng = np.random.default_rng(seed)
    scene = _scene(options, phase_share=float(rng.random()))
    if background is None:
        recorder = Recorder(scene, seconds, rng)
        counted = Counted(_watched(recorder))
    else:
        recording = open_recording(background)
        scene = replace(scene, optics=replace(scene.optics, width=recording.width, height=recording.height))
        counted = Counted(tqdm(stream_over(recording.chunks(), scene, rng), unit=" chunks", disable=None, delay=2))
    shift_us = write_recording(out, counted, scene.optics.width, scene.optics.height)
    start_us, duration_us = (0, round(seconds * 1e6)) if background is None else (counted.first_us, counted.length_us)
    lost = recorder.queue.lost if background is None else 0
    if shift_us:
        click.echo(f"{out}: its clock begins at 0; {shift_us} us were taken off (header line t0)", err=True)
    truth = {"seed": seed, "n_events": counted.size, "n_lost": lost, **truth_table(scene, duration_us, start_us)}
    truth_file = out.with_suffix(".truth.json")
    truth_file.write_text(json.dumps(truth, indent=1) + "\n")
    click.echo(f"{out}: {counted.size} events in {duration_us * 1e-6:g} s; {truth_file}: the truth")


class Counted:
    """Chunks in, the same out, one after the other; afterwards it knows how many events there were, and when."""

    def __init__(self, chunks: Iterable[Events]) -> None:
        self._chunks = chunks
        self.size = self.first_us = self.length_us = 0

    def __iter__(self) -> Iterator[Events]:
        for chunk in self._chunks:
            if chunk.size:
                self.first_us = self.first_us if self.size else int(chunk["t"][0])
                self.length_us = int(chunk["t"][-1]) - self.first_us + 1
                self.size += chunk.size
            yield chunk


def _scene(options: dict[str, Any], phase_share: float) -> Scene:
    """The command line's options in, the scene they describe out."""
    packet_format = PacketFormat(
        payload_bits=options["payload_bits"],
        checksum=options["checksum"],
        f_id_hz=options["f_id_hz"],
        manchester=options["manchester"],
    )
    marker = Marker(
        payload=options["payload"],
        board=Board(aruco_id=options["aruco_id"], size_m=options["size_m"]),
        packet_format=packet_format,
        current_ma=options["current_ma"],
        clock_error_ppm=options["clock_error_ppm"],
        phase_us=phase_share * packet_format.packet_us,
    )
    pose = Pose.facing(options["distance_m"], x_m=options["x_m"], y_m=options["y_m"], yaw_deg=options["yaw_deg"])
    path = spin(pose, options["rpm"]) if options["rpm"] else Still(pose)
    return Scene(
        markers=(PlacedMarker(marker=marker, path=path),),
        optics=Optics(),
        light=Light(illuminance_lux=options["lux"]),
    )


def _watched(recorder: Recorder) -> Iterator[Events]:
    """The recorder's chunks, with a progress bar where somebody watches a long run."""
    with tqdm(total=recorder.duration_us * 1e-6, unit="s", disable=None, delay=2) as bar:
        for chunk in recorder:
            yield chunk
            bar.update(0.01)
