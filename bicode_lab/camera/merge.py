"""A marker in somebody else's recording: synthetic events among real ones."""

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
    """A recording's chunks and a scene in, both together out, until the recording ends.

    The scene starts with the recording's first event and takes over its clock; background
    events and hot pixels are left to the recording, which has its own. The markers hide
    nothing of what is behind them.

    Parameters
    ----------
    background : iterable of event arrays
        Chunks in the order of time; the scene's sensor must be theirs.
    scene : Scene
    rng : numpy Generator

    Yields
    ------
    ndarray of EVENT_DTYPE
        Sorted, and no longer than a background chunk and `CHUNK_US` of the scene.
    """
    if scene.wall is not None:
        raise ValueError("the scene has a wall, but the recording is its background; take wall=None")
    quiet = replace(scene, pixel_model=replace(scene.pixel_model, background_hz=0.0, hot_pixels=0))
    synthetic = iter(Recorder(quiet, MAX_DURATION_S, rng))
    held = no_events()
    start_us: int | None = None
    drawn_us = 0  # the scene is drawn up to here
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
