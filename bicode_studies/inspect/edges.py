"""Measure the edges of a light that blinks: how long its events take, and how many each pixel makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_studies.inspect.light import BINS_US, bit_lengths_us, edges_of, events_inside

LEAST_BINS = 5  # in a bit
EVEN = 0.18  # chips; more is the unevenness of chance
MOST_CHIPS = 8
ACTIVE_SHARE = 0.2  # a pixel of the light has at least this share of the events of a usual one


@dataclass(frozen=True, kw_only=True)
class Edges:
    """Edges of one light.

    Parameters
    ----------
    bit_us : float
        Shortest common time from one rise to the next [us].
    on_width_us, off_width_us : float
        Time in which 80 % of the events of a rise and of a fall come [us].
    per_pixel : float
        Events of one polarity that a pixel of the light makes at an edge.
    """

    bit_us: float
    on_width_us: float
    off_width_us: float
    per_pixel: float


def measure_edges(events: Events, box: Box) -> Edges | None:
    """Measure the edges of the light in a box.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    box : Box

    Returns
    -------
    Edges or None
        None if the light does not switch as a whole.
    """
    mine = events_inside(events, box)
    for bin_us in BINS_US:
        lengths = bit_lengths_us(mine, bin_us)
        if lengths and lengths[0] >= LEAST_BINS * bin_us:
            times, rises = edges_of(mine, bin_us)
            if _unevenness(times * bin_us, rises, lengths[0]) <= EVEN:
                return _edges(mine, box, times * bin_us + bin_us / 2, rises, lengths[0])
    return None


def _edges(
    mine: Events, box: Box, times_us: npt.NDArray[np.float64], rises: npt.NDArray[np.bool_], bit_us: float
) -> Edges:
    """Measure the events around edges at some times since the first event [us]."""
    first = int(mine["t"][0])
    moments_us = first + times_us
    n_edges, widths = 0, []
    for polarity, which in ((1, rises), (0, ~rises)):
        t_us = mine["t"][mine["p"] == polarity]
        widths.append(_width_us(t_us, moments_us[which], bit_us / 2))
        n_edges += int(np.count_nonzero(which))
    pixels = np.bincount((mine["y"].astype(np.int64) - box.y) * box.w + (mine["x"] - box.x), minlength=box.area)
    usual = np.quantile(pixels[pixels > 0], 0.9)
    active = max(1, int(np.count_nonzero(pixels >= ACTIVE_SHARE * usual)))
    seen_s = max(1, int(mine["t"][-1]) - first)
    share = min(1.0, 2e6 / seen_s)  # edges are looked for in the first two seconds
    per_pixel = mine.size * share / max(n_edges, 1) / active
    return Edges(bit_us=bit_us, on_width_us=widths[0], off_width_us=widths[1], per_pixel=per_pixel)


def _unevenness(times_us: npt.NDArray[np.float64], rises: npt.NDArray[np.bool_], bit_us: float) -> float:
    """Return how far the times between edges of one kind are from whole chips [chips]; .29 is that of chance."""
    steps = np.concatenate([np.diff(times_us[rises]), np.diff(times_us[~rises])]) / (bit_us / 2)
    steps = steps[(steps > 0.5) & (steps < MOST_CHIPS)]
    return float(np.sqrt(np.mean((steps - np.round(steps)) ** 2))) if steps.size else 1.0


def _width_us(t_us: npt.NDArray[np.int64], moments_us: npt.NDArray[np.float64], chip_us: float) -> float:
    """Return the time in which the middle 80 % of the events around some moments lie [us]."""
    if not moments_us.size or not t_us.size:
        return 0.0
    nearest = np.searchsorted((moments_us[1:] + moments_us[:-1]) / 2, t_us)
    away = t_us - moments_us[nearest]
    away = away[np.abs(away) <= chip_us]
    low, high = np.quantile(away, [0.1, 0.9]) if away.size else (0.0, 0.0)
    return float(high - low)
