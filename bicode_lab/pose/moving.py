"""Lock-in images of moving plates: events are taken back along the motion of the plate, and then counted.

Only events shortly behind an edge count: later ones are made by the borders of cells that move on while the LED is on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.pose.led_clock import LedClock
from bicode_lab.pose.lock_in import BIN_US, LockIn, delays, find_lag, lock_in_at
from bicode_lab.pose.motion import ImageMotion, find_motion

Floats = npt.NDArray[np.float64]

NEAR_EDGE_US = 320.0  # events so near behind an edge of their polarity show where the plate is, and count
CORE_BORDER_PX, BORDER_PX = 4, 8
LATENCY_DOUBT_US = 60.0  # the moment at which the plate was where its events are is known to about this
FAR_QUANTILE = 0.98  # share of these events that lie within the plate's box


def moving_lock_in(events: Events, clock: LedClock, core: Box, start_us: float, end_us: float) -> LockIn | None:
    """Make the lock-in image of a plate that moves, at the middle of a span of time.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        In the order of time.
    clock : LedClock
        Of the plate's LED.
    core : Box
        Box of the track, which covers the path of the plate.
    start_us, end_us : float
        Span of time, not much longer than a period [us].

    Returns
    -------
    LockIn or None
        None if the LED does not switch, or too few events follow its edges.
    """
    used = events[(events["t"] >= start_us) & (events["t"] < end_us)]
    left, top = core.x - CORE_BORDER_PX, core.y - CORE_BORDER_PX
    right, bottom = core.right + CORE_BORDER_PX, core.bottom + CORE_BORDER_PX
    used = used[(used["x"] >= left) & (used["x"] < right) & (used["y"] >= top) & (used["y"] < bottom)]
    x, y, t = (used[name].astype(np.float64) for name in ("x", "y", "t"))
    p = used["p"].astype(np.int64)
    times, rises = clock.edges(start_us - 2 * clock.packet_us, end_us)
    if not times.size or not x.size:
        return None
    lag = find_lag(t, p, clock)
    delay, in_phase = delays(t - lag, p, times, rises)
    latest = round(NEAR_EDGE_US / BIN_US)
    near = in_phase & (delay < latest)
    edge = np.searchsorted(times, t - lag, side="right")
    late_us = lag + float(delay[near].mean() + 0.5) * BIN_US if near.any() else 0.0
    middle_us = (start_us + end_us) / 2
    motion = find_motion(x[near], y[near], t[near] - late_us, edge[near], middle_us)
    if motion is None:
        return None
    u, v = motion.taken_back(x, y, t - late_us)
    box = _box_of(u[near], v[near], motion)
    column, row = np.rint(u).astype(np.int64) - box.x, np.rint(v).astype(np.int64) - box.y
    inside = (column >= 0) & (column < box.w) & (row >= 0) & (row < box.h)
    image = lock_in_at(
        column[inside], row[inside], p[inside], t[inside], np.ones(int(inside.sum()), np.bool_), clock, box, start_us,
        end_us, latest,
    )  # fmt: skip
    if image is None:
        return None
    doubt_px = np.abs(motion.velocity) * LATENCY_DOUBT_US * 1e-6
    return replace(image, doubt_px=(float(doubt_px[0]), float(doubt_px[1])))


def _box_of(u: Floats, v: Floats, motion: ImageMotion) -> Box:
    """Return the box of a plate whose events were taken back."""
    far = np.maximum(np.abs(u - motion.pivot_px[0]), np.abs(v - motion.pivot_px[1]))
    reach = float(np.quantile(far[far <= 3 * max(float(np.median(far)), 1.0)], FAR_QUANTILE)) + BORDER_PX
    x, y = (int(np.floor(value - reach)) for value in motion.pivot_px)
    size = int(np.ceil(2 * reach)) + 1
    return Box(x, y, size, size)
