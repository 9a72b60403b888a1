"""``bicode mystery OUT``: a recording of several markers, and nothing that says which."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from bicode_lab.camera import Recorder
from bicode_lab.recordings import WRITABLE, write_recording
from bicode_studies.cli.simulate import Counted
from bicode_studies.own_recording.mystery import SECONDS, digest_of, mystery_scene


@click.command()
@click.argument("out", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="IDs, places and all other chance.")
def mystery(out: Path, seed: int) -> None:
    """Write the events of four markers to OUT; their IDs are for the reader to find.

    No truth is written beside it. What is printed at the end checks an answer without telling it:
    bicode_studies.own_recording.mystery.digest_of(ids) of the right IDs gives the same.
    """
    if out.suffix.lower() not in WRITABLE:
        raise ValueError(f"{out.name} names no format written here; end it in one of {' '.join(WRITABLE)}")
    if not out.parent.is_dir():
        raise ValueError(f"there is no folder {out.parent}; make it first")
    scene = mystery_scene(seed)
    counted = Counted(Recorder(scene, SECONDS, np.random.default_rng([seed, 1])))
    write_recording(out, counted, scene.optics.width, scene.optics.height)
    fingerprint = digest_of(placed.marker.payload for placed in scene.markers)
    click.echo(f"{out}: {counted.size} events in {SECONDS:g} s; fingerprint of the IDs: {fingerprint}")
