"""Events of lights that are made for one test: a square of pixels that switches, noise, and defects."""

from __future__ import annotations

import numpy as np

from bicode_lab.events import Events, make_events, merge
from bicode_lab.marker import LedWaveform, PacketFormat

WIDTH, HEIGHT = 320, 240


def blinking(
    packet: PacketFormat | None = None,
    payload: int = 37,
    seconds: float = 0.4,
    side_px: int = 8,
    spread_us: float = 60.0,
    seed: int = 0,
    at: tuple[int, int] = (100, 60),
) -> Events:
    """Return the events of a square that blinks a packet: each pixel makes one at each edge, some 150 us late."""
    wave = LedWaveform(payload=payload, packet_format=packet or PacketFormat(), phase_us=1234.0)
    times, levels = wave.steps(0, seconds * 1e6)
    times, levels = times[1:], levels[1:]
    rng = np.random.default_rng(seed)
    place = np.arange(side_px**2)
    t = (times[:, None] + 150 + rng.normal(0, spread_us, (times.size, place.size))).ravel()
    x = np.tile(at[0] + place % side_px, times.size)
    y = np.tile(at[1] + place // side_px, times.size)
    p = np.repeat((levels > 0).astype(int), place.size)
    return ordered(x, y, p, t)


def noise(n: int = 3000, seconds: float = 0.4, seed: int = 1) -> Events:
    """Return events anywhere at any time."""
    rng = np.random.default_rng(seed)
    return ordered(
        rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.integers(0, 2, n), rng.uniform(0, seconds * 1e6, n)
    )


def ordered(x: object, y: object, p: object, t: object) -> Events:
    """Return events in the order of time."""
    whole = np.maximum(np.round(np.asarray(t, float)), 0).astype(np.int64)
    order = np.argsort(whole, kind="stable")
    return make_events(np.asarray(x)[order], np.asarray(y)[order], np.asarray(p)[order], whole[order])


def together(*parts: Events) -> Events:
    """Return all events in the order of time."""
    return merge(*parts)
