"""Find where something blinks that is too faint for the regions of a single period.

A marker at the limit of its range makes an event in some of its edges only, too few in one period to tell them from
noise by counting. But over a second its events keep the clock of the transmitter. Taken as phasors at the chip rate,
they point in one direction: their sum grows with their number, while that of noise, hot pixels and lamps grows with
its square root. So:

1. Candidates are the pixels whose 3 x 3 neighbours made enough events of both polarities.
2. The phasors of their events are summed, ON and OFF apart (their latencies differ), for several clock errors.
3. A pixel is kept if the power 2 |sum|^2 / count of both polarities reaches `MIN_POWER`. With noise alone, each power
   is chi-squared with 2 degrees of freedom, so that 15 has a probability of 5e-4, twice.
4. The kept pixels around a peak of the power make a box.

A box is only a place to look at; `repeated_packets` decides whether it holds a marker.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.soft_receiver.clock import MAX_ERROR_PPM

MIN_EVENTS = 6  # of each polarity in the 3 x 3 neighbours of a candidate
MIN_POWER = 15.0
REACH_PX = 4  # the image of a faint marker is no wider than twice this
BORDER_PX = 1
MAX_CANDIDATES = 20_000  # of more, those with the most events are taken
MAX_REGIONS = 16


def find_faint_regions(events: Events, chip_us: float, width: int, height: int) -> list[Box]:
    """Find boxes in which the events keep a clock of one chip.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of up to a second.
    chip_us : float
        Nominal length of a chip [us].
    width, height : int
        Sensor size [px].

    Returns
    -------
    list of Box
        Up to `MAX_REGIONS` boxes, the one with the highest power first.
    """
    if not events.size:
        return []
    counts = np.zeros((2, height, width), np.int32)
    _count(events, counts)
    around = counts.copy()
    _sum_neighbours(counts, around)
    candidates = np.flatnonzero(np.minimum(around[0], around[1]).ravel() >= MIN_EVENTS)
    if not candidates.size:
        return []
    if candidates.size > MAX_CANDIDATES:
        n_events = around[:, candidates // width, candidates % width].sum(axis=0)
        candidates = np.sort(candidates[np.argsort(-n_events, kind="stable")[:MAX_CANDIDATES]])
    powers = _powers(events, around, candidates, chip_us, width, height)
    kept = powers >= MIN_POWER
    return _boxes(candidates[kept], powers[kept], width, height)


def _powers(
    events: Events,
    around: npt.NDArray[np.int32],
    candidates: npt.NDArray[np.int64],
    chip_us: float,
    width: int,
    height: int,
) -> npt.NDArray[np.float64]:
    """Return the power at the chip rate around each candidate: of the weaker polarity, at the best clock error."""
    start_us = int(events["t"][0])
    span_chips = (int(events["t"][-1]) - start_us) / chip_us
    n_steps = int(np.ceil(2 * MAX_ERROR_PPM * 1e-6 * span_chips))  # half the width of the line apart
    errors = np.linspace(-MAX_ERROR_PPM, MAX_ERROR_PPM, 2 * n_steps + 1) * 1e-6
    number = np.full((height, width), -1, np.int32)
    number[candidates // width, candidates % width] = np.arange(candidates.size)
    powers = np.zeros(candidates.size)
    n = around[:, candidates // width, candidates % width]
    for error in errors:
        sums = np.zeros((2, candidates.size, 2))
        _add_phasors(events, number, start_us, 1 / (chip_us * (1 + error)), sums)
        both = 2 * (sums**2).sum(axis=2) / n
        np.maximum(powers, both.min(axis=0), out=powers)
    return powers


def _boxes(pixels: npt.NDArray[np.int64], powers: npt.NDArray[np.float64], width: int, height: int) -> list[Box]:
    """Return the boxes of the kept pixels around each peak of the power."""
    boxes: list[Box] = []
    y, x = pixels // width, pixels % width
    free = np.ones(pixels.size, bool)
    for peak in np.argsort(-powers, kind="stable"):
        if not free[peak] or len(boxes) == MAX_REGIONS:
            continue
        distance = np.maximum(np.abs(x - x[peak]), np.abs(y - y[peak]))
        near = (distance <= REACH_PX) & free
        x0, x1 = int(x[near].min()) - BORDER_PX, int(x[near].max()) + BORDER_PX
        y0, y1 = int(y[near].min()) - BORDER_PX, int(y[near].max()) + BORDER_PX
        boxes.append(Box.between(x0, y0, x1 + 1, y1 + 1).clipped(width, height))
        free &= distance > 2 * REACH_PX
    return boxes


@njit(cache=True)
def _count(events, counts):  # type: ignore[no-untyped-def]
    """Count the events of each polarity and pixel."""
    _, height, width = counts.shape
    for i in range(events.size):
        x, y = events[i]["x"], events[i]["y"]
        if x < width and y < height:
            counts[1 if events[i]["p"] > 0 else 0, y, x] += 1


@njit(cache=True)
def _sum_neighbours(counts, around):  # type: ignore[no-untyped-def]
    """Add the events of each pixel to the sums of its eight neighbours."""
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
def _add_phasors(events, number, start_us, rate, sums):  # type: ignore[no-untyped-def]
    """Add the phasor of each event to the sums of the candidate pixels around it."""
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
                if real == 0.0 and imaginary == 0.0:  # computed late: most events are near no candidate
                    angle = 2 * np.pi * ((events[i]["t"] - start_us) * rate % 1.0)
                    real, imaginary = np.cos(angle), np.sin(angle)
                sums[p, number[ny, nx], 0] += real
                sums[p, number[ny, nx], 1] += imaginary
