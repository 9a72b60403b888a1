"""Find lights that blink at an unknown rate, and the edges of one of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box, overlapping_groups
from bicode_lab.events import Events, slice_time
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition import ReceiverSettings, edge_gates, find_regions, settings_for
from bicode_lab.recognition.chips import find_edges

RATES_HZ = (125.0, 500.0, 1000.0, 2000.0, 8000.0)  # frames of these rates find everything between, and beyond a little
LOOKS = 4  # periods in which regions are searched for, for each rate
MOST_REGIONS = 6
BINS_US = (20, 80, 160)  # bins for the length of a bit
LEAST_PACKETS = 3
LOOK_AT_US = 2_000_000  # of the light of a region, to find its edges


def blinking_boxes(events: Events, settings: ReceiverSettings) -> list[Box]:
    """Return the boxes in which something blinks, at whatever rate.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    settings : ReceiverSettings
        Sensor, and rules for regions.

    Returns
    -------
    list of Box
        Those with the most events first.
    """
    first, last = int(events["t"][0]), int(events["t"][-1])
    boxes: list[Box] = []
    for rate_hz in RATES_HZ:
        at_rate = settings_for(PacketFormat(f_id_hz=rate_hz), width=settings.width, height=settings.height)
        period_us = at_rate.delta_t_whole_us
        looks = max(1, min(LOOKS, (last - first) // period_us))
        for start_us in np.linspace(first, max(first, last - period_us), looks).astype(int).tolist():
            part = slice_time(events, start_us, start_us + period_us)
            if part.size:
                boxes += [region.box for region in find_regions(part, start_us, at_rate)]
    merged = [box for box, _ in overlapping_groups(boxes)]
    return sorted(merged, key=lambda box: -events_inside(events, box).size)[:MOST_REGIONS]


def bit_lengths_us(events: Events, bin_us: int = BINS_US[0]) -> list[float]:
    """Return the lengths that a bit may have in the light of one region.

    The time from one rise to the next is two, three or four chips, and so is that from one fall to the next.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events of the region.
    bin_us : int
        Length of the bins in which edges are looked for [us]: coarse ones for a light whose edges are smeared.

    Returns
    -------
    list of float
        The likeliest first [us].
    """
    times, rises = edges_of(events, bin_us)
    steps = np.concatenate([np.diff(times[rises]), np.diff(times[~rises])]) * bin_us
    steps = steps[steps > 2 * bin_us]
    if steps.size < 2 * LEAST_PACKETS:
        return []
    # The smallest length that is common: a tenth of all steps lie within 12 % of it.
    logs = np.sort(np.log(steps))
    upper = np.searchsorted(logs, logs + 0.12, side="right")
    common = np.flatnonzero(upper - np.arange(logs.size) >= 0.1 * logs.size)
    if not common.size:
        return []
    peaks = []
    for start in (int(common[0]), int(np.argmax(upper - np.arange(logs.size)))):
        peak = float(np.exp(np.median(logs[start : upper[start]])))
        peaks += [peak / ratio for ratio in (1.0, 1.5, 2.0)]
    return [each for k, each in enumerate(peaks) if all(abs(each / other - 1) > 0.04 for other in peaks[:k])]


def edges_of(events: Events, bin_us: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return the edges of the light in bins, and which are rises."""
    if not events.size:
        return np.zeros(0), np.zeros(0, bool)
    first = int(events["t"][0])
    last = min(int(events["t"][-1]), first + LOOK_AT_US)
    part = slice_time(events, first, last + 1)
    bins = (part["t"] - first) // bin_us
    n_bins = int(bins[-1]) + 1
    n_on = np.bincount(bins[part["p"] == 1], minlength=n_bins)
    n_off = np.bincount(bins[part["p"] == 0], minlength=n_bins)
    gates = edge_gates(n_on, n_off, 0.2)
    times, rises = find_edges(n_on.astype(np.int64) - n_off, *gates)
    return times, rises


def events_inside(events: Events, box: Box) -> Events:
    """Return the events in a box."""
    across = (events["x"] >= box.x) & (events["x"] < box.right)
    return events[across & (events["y"] >= box.y) & (events["y"] < box.bottom)]
