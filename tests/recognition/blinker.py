"""A simple generator of events for the tests of the receiver: a test double, not a camera.

At each edge of the LED every lit pixel makes one to three events with the polarity of the edge, each after a random
latency and with a given probability.
"""

from __future__ import annotations

import numpy as np

from bicode_lab.events import Events, make_events, merge
from bicode_lab.marker import Marker


def square(x: int, y: int, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns and rows of the pixels of a filled square."""
    rows, columns = np.mgrid[y : y + side, x : x + side]
    return columns.ravel(), rows.ravel()


def plate(marker: Marker, x: int, y: int, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns and rows of the pixels of the glowing cells of a plate that faces the camera."""
    cells = marker.board.cells()
    index = np.arange(side) * len(cells) // side
    rows, columns = np.nonzero(cells[np.ix_(index, index)])
    return columns + x, rows + y


def blink(
    marker: Marker,
    pixels: tuple[np.ndarray, np.ndarray],
    end_us: float,
    rng: np.random.Generator,
    *,
    start_us: float = 0,
    probability: float = 1.0,
    spread: float = 1.0,
) -> Events:
    """Make the events of the pixels of a marker from `start_us` to `end_us`."""
    times_us, levels = marker.waveform.steps(start_us, end_us)
    columns = []
    for t_us, level in zip(times_us[1:], levels[1:], strict=True):
        for k, chance in enumerate((1.0, 0.6, 0.3)):
            hit = rng.random(pixels[0].size) < probability * chance
            n = int(hit.sum())
            if level > 0:
                delay = 20 + spread * (40 * k + rng.gamma(2, 15, n))
            else:
                delay = 30 + spread * (60 * k + rng.gamma(2, 40, n))
            columns.append((pixels[0][hit], pixels[1][hit], np.full(n, int(level > 0)), t_us + delay))
    if not columns:
        return make_events([], [], [], [])
    x, y, p, t = (np.concatenate(column) for column in zip(*columns, strict=True))
    return make_events(x, y, p, t.astype(np.int64))


def noise(
    width: int, height: int, rate_hz: float, start_us: int, end_us: int, rng: np.random.Generator, off: float = 0.64
) -> Events:
    """Make background activity: independent events at a rate of `rate_hz` per pixel."""
    n = rng.poisson(rate_hz * width * height * (end_us - start_us) * 1e-6)
    return make_events(
        rng.integers(0, width, n), rng.integers(0, height, n), rng.random(n) >= off, rng.integers(start_us, end_us, n)
    )


def hot_pixels(
    n: int, width: int, height: int, rate_hz: float, end_us: int, rng: np.random.Generator, start_us: int = 0
) -> Events:
    """Make the events of `n` hot pixels, which fire all the time."""
    parts = []
    for x, y in zip(rng.integers(0, width, n), rng.integers(0, height, n), strict=True):
        k = rng.poisson(rate_hz * (end_us - start_us) * 1e-6)
        parts.append(make_events(np.full(k, x), np.full(k, y), rng.random(k) > 0.5, rng.integers(start_us, end_us, k)))
    return merge(*parts)
