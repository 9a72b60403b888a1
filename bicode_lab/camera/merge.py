"""A marker in the recording of another camera: synthetic events among real ones."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from bicode_lab.camera.recorder import CHUNK_US, Recorder
from bicode_lab.camera.scene import Scene
from bicode_lab.events import Events, copy_events, join, merge, no_events

MAX_DURATION_S = 1e6


def stream_over(background: Iterable[Events], scene: Scene, rng: np.random.Generator) -> Iterator[Events]:
    """Merge the events of a scene into a recording, until the recording ends.

    The scene starts with the first event of the recording and uses its clock. The scene makes neither background
    activity nor events of hot pixels, because the recording has its own. The markers do not occlude the background.

    Parameters
    ----------
    background : iterable of ndarray of EVENT_DTYPE
        Chunks of the recording in the order of time.
    scene : Scene
        Without a wall; its sensor has the size of the recording's sensor.
    rng : numpy.random.Generator

    Yields
    ------
    ndarray of EVENT_DTYPE
        Sorted by time; at most a chunk of the recording and `CHUNK_US` of the scene.

    Raises
    ------
    ValueError
        If the scene has a wall.
    """
    if scene.wall is not None:
        raise ValueError("the scene has a wall, but the recording is its background; take wall=None")
    quiet = replace(scene, pixel_model=replace(scene.pixel_model, background_hz=0.0, hot_pixels=0))
    synthetic = iter(Recorder(quiet, MAX_DURATION_S, rng))
    held = no_events()
    start_us: int | None = None
    drawn_us = 0  # the scene is recorded up to here
    for chunk in background:
        if not chunk.size:
            continue
        if start_us is None:
            start_us = drawn_us = int(chunk["t"][0])
        end_us = int(chunk["t"][-1])
        while True:
            settled_us = min(drawn_us, end_us + 1)
            real, marker = (bisect_left(e["t"], settled_us) for e in (chunk, held))
            if real or marker:
                yield merge(chunk[:real], held[:marker])
            chunk, held = chunk[real:], held[marker:]
            if drawn_us > end_us:
                break
            fresh = copy_events(next(synthetic))
            fresh["t"] += start_us
            held = join([held, fresh])
            drawn_us += CHUNK_US
