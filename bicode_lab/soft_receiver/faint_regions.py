"""Where does something faint blink?   events of up to a second -> boxes

A marker at the edge of its range makes an event in some of its edges only, too few in a period to be
told from noise by counting. But over a second its events keep the transmitter's clock: folded to
the length of a chip they point one way, and their sum grows with their number while that of
noise, of hot pixels and of lamps grows with its root. So:

1. pixels whose 3 x 3 neighbours made enough events of both polarities are looked at;
2. their events are summed as turns of the chip rate, for a few clock errors, ON and OFF apart
   (a pixel's latency differs between them);
3. a pixel is kept where 2 |sum|^2 / count of both reaches `LEAST_POWER`: chi-squared with 2 degrees of
   freedom each under noise, 15 is p = 5e-4 twice;
4. kept pixels near a peak are its box.

What is found is only a place to look; whether it is a marker is for `repeats` to say.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.soft_receiver.clock import MOST_PPM

LEAST_EVENTS = 6  # of each polarity in a pixel's 3 x 3 neighbours
LEAST_POWER = 15.0
REACH_PX = 4  # a faint marker's image is no wider than twice this
RIM_PX = 1
MOST_PIXELS = 20_000  # looked at, those of most events first


def find_faint_regions(events: Events, chip_us: float, width: int, height: int, most: int = 16) -> list[Box]:
    """Events in, boxes (x, y, w, h) [px] in which they keep a clock of one chip out, the strongest first.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Of up to a second.
    chip_us : float
        Length of a nominal chip [us].
    width, height : int
        Sensor [px].
    most : int
        Boxes given out.
    """
    if not events.size:
        return []
    counts = np.zeros((2, height, width), np.int32)
    _count(events, counts)
    around = counts.copy()
    _sum_neighbours(counts, around)
    asked = np.flatnonzero(np.minimum(around[0], around[1]).ravel() >= LEAST_EVENTS)
    if not asked.size:
        return []
    if asked.size > MOST_PIXELS:
        n_events = around[:, asked // width, asked % width].sum(axis=0)
        asked = np.sort(asked[np.argsort(-n_events, kind="stable")[:MOST_PIXELS]])
    powers = _powers(events, around, asked, chip_us, width, height)
    kept = powers >= LEAST_POWER
    return _boxes(asked[kept], powers[kept], width, height, most)


def _powers(
    events: Events, around: npt.NDArray[np.int32], asked: npt.NDArray[np.int64], chip_us: float, width: int, height: int
) -> npt.NDArray[np.float64]:
    """Pixels in; the weaker polarity's power of the chip rate around each, of the best clock error, out."""
    start_us = int(events["t"][0])
    span_chips = (int(events["t"][-1]) - start_us) / chip_us
    n_steps = int(np.ceil(2 * MOST_PPM * 1e-6 * span_chips))  # half a line's width apart
    errors = np.linspace(-MOST_PPM, MOST_PPM, 2 * n_steps + 1) * 1e-6
    number = np.full((height, width), -1, np.int32)
    number[asked // width, asked % width] = np.arange(asked.size)
    powers = np.zeros(asked.size)
    n = around[:, asked // width, asked % width]
    for error in errors:
        sums = np.zeros((2, asked.size, 2))
        _add_turns(events, number, start_us, 1 / (chip_us * (1 + error)), sums)
        both = 2 * (sums**2).sum(axis=2) / n
        np.maximum(powers, both.min(axis=0), out=powers)
    return powers


def _boxes(
    pixels: npt.NDArray[np.int64], powers: npt.NDArray[np.float64], width: int, height: int, most: int
) -> list[Box]:
    """Kept pixels and their powers in; the box of each peak's surroundings out."""
    boxes: list[Box] = []
    y, x = pixels // width, pixels % width
    free = np.ones(pixels.size, bool)
    for peak in np.argsort(-powers, kind="stable"):
        if not free[peak] or len(boxes) == most:
            continue
        away = np.maximum(np.abs(x - x[peak]), np.abs(y - y[peak]))
        near = (away <= REACH_PX) & free
        x0, x1 = max(int(x[near].min()) - RIM_PX, 0), min(int(x[near].max()) + RIM_PX, width - 1)
        y0, y1 = max(int(y[near].min()) - RIM_PX, 0), min(int(y[near].max()) + RIM_PX, height - 1)
        boxes.append(Box.between(x0, y0, x1 + 1, y1 + 1))
        free &= away > 2 * REACH_PX
    return boxes


@njit(cache=True)
def _count(events, counts):  # type: ignore[no-untyped-def]
    _, height, width = counts.shape
    for i in range(events.size):
        x, y = events[i]["x"], events[i]["y"]
        if x < width and y < height:
            counts[1 if events[i]["p"] > 0 else 0, y, x] += 1


@njit(cache=True)
def _sum_neighbours(counts, around):  # type: ignore[no-untyped-def]
    """Add the eight neighbours of each pixel that made events to their sums."""
    _, height, width = counts.shape
    for p in range(2):
        for y in range(height):
            for x in range(width):
                n = counts[p, y, x]
                if n == 0:
                    continue
                for ny in range(y - 1, y + 2):
                    for nx in range(x - 1, x + 2):
                        if 0 <= ny < height and 0 <= nx < width and (ny != y or nx != x):
                            around[p, ny, nx] += n


@njit(cache=True)
def _add_turns(events, number, start_us, rate, sums):  # type: ignore[no-untyped-def]
    """Add each event's turn to the sums of the pixels asked for around it."""
    height, width = number.shape
    for i in range(events.size):
        x, y = events[i]["x"], events[i]["y"]
        if x >= width or y >= height:
            continue
        p = 1 if events[i]["p"] > 0 else 0
        real = imaginary = 0.0
        for ny in range(np.int64(y) - 1, np.int64(y) + 2):
            for nx in range(np.int64(x) - 1, np.int64(x) + 2):
                if not (0 <= ny < height and 0 <= nx < width) or number[ny, nx] < 0:
                    continue
                if real == 0.0 and imaginary == 0.0:  # most events are near no pixel asked for
                    turn = 2 * np.pi * ((events[i]["t"] - start_us) * rate % 1.0)
                    real, imaginary = np.cos(turn), np.sin(turn)
                sums[p, number[ny, nx], 0] += real
                sums[p, number[ny, nx], 1] += imaginary
