"""Lock-in images: how many events a pixel makes at each edge of one LED, with everything else averaged out.

Once a packet is read, the state of the LED is known at all times. An ON event while the LED is on, or an OFF event
while it is off, is in phase. Noise, a wall and other lights make events in phase and out of phase alike, so what is
out of phase tells how much of what is in phase is theirs; it is subtracted. Within a phase, the events of the LED
follow its edge, with a latency and a spread that are learned from the events themselves. Each event in phase has
the weight

    w(d) = 1 - b / h(d),

where d is its delay behind the last edge, h(d) the density of all events at this delay and b the density out of
phase: the probability that the event is the LED's. All weights of a polarity are multiplied by one number, so that
the events of the LED add up to their count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.pose.led_clock import LedClock

Floats = npt.NDArray[np.float64]

BIN_US = 25.0  # of the delays
N_DELAYS = 160  # delays of up to 4 ms; later events count as the last
LEAST_LAG_US, MOST_LAG_US = -200.0, 400.0  # of the events behind the edges that were decoded
SMOOTH_BINS = 3  # the density of delays is averaged over so many bins


@dataclass(frozen=True, kw_only=True, eq=False)
class LockIn:
    """The lock-in image of one LED in a box of pixels.

    Parameters
    ----------
    box : Box
        The pixels.
    image : ndarray of float64, shape (box.h, box.w)
        Events per edge of the LED: those of an ON edge and those of an OFF edge added up, background subtracted.
    variance : ndarray of float64, shape (box.h, box.w)
        Variance of `image` by the background, as Poisson events.
    n_edges : int
        Number of ON edges and OFF edges in the span of time.
    lag_us : float
        Learned delay of the phase behind the edges that were decoded [us].
    t_us : float
        Middle of the span of time [us].
    doubt_px : tuple of 2 floats
        Standard deviation of the place of the whole image, along x and y; 0 for a plate that stands still [px].
    """

    box: Box
    image: Floats
    variance: Floats
    n_edges: int
    lag_us: float
    t_us: float
    doubt_px: tuple[float, float] = (0.0, 0.0)


def lock_in(
    events: Events, clock: LedClock, box: Box, start_us: float, end_us: float, core: Box | None = None
) -> LockIn | None:
    """Make the lock-in image of an LED.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        In the order of time; those outside the box and the span of time are left out.
    clock : LedClock
        Of the LED.
    box : Box
        The pixels of the image.
    start_us, end_us : float
        Span of time [us].
    core : Box, optional
        Pixels whose events tell latency and spread; None takes all of `box`.

    Returns
    -------
    LockIn or None
        None if the LED does not switch on and off in the span of time, or no event follows its edges.
    """
    used = events[(events["t"] >= start_us) & (events["t"] < end_us)]
    x, y = used["x"].astype(np.int64) - box.x, used["y"].astype(np.int64) - box.y
    inside = (x >= 0) & (x < box.w) & (y >= 0) & (y < box.h)
    x, y, p, t = x[inside], y[inside], used["p"][inside].astype(np.int64), used["t"][inside].astype(np.float64)
    learn = np.ones(x.size, np.bool_)
    if core is not None:
        learn = (x + box.x >= core.x) & (x + box.x < core.right) & (y + box.y >= core.y) & (y + box.y < core.bottom)
    return lock_in_at(x, y, p, t, learn, clock, box, start_us, end_us)


def lock_in_at(
    x: npt.NDArray[np.int64], y: npt.NDArray[np.int64], p: npt.NDArray[np.int64], t: Floats,
    learn: npt.NDArray[np.bool_], clock: LedClock, box: Box, start_us: float, end_us: float,
    latest: int = N_DELAYS,
) -> LockIn | None:  # fmt: skip
    """Make the lock-in image of events at places that may have been moved.

    Parameters
    ----------
    x, y : ndarray of int64, shape (n,)
        Column and row in the box [px].
    p : ndarray of int64, shape (n,)
        Polarity, 0 or 1.
    t : ndarray of float64, shape (n,)
        Time [us].
    learn : ndarray of bool, shape (n,)
        Which events tell latency and spread.
    clock, box, start_us, end_us
        See `lock_in`.
    latest : int
        Events that lie so many bins of `BIN_US` or more behind the last edge are left out.

    Returns
    -------
    LockIn or None
        See `lock_in`.
    """
    lag = find_lag(t[learn], p[learn], clock)
    times, rises = clock.edges(start_us - 2 * clock.packet_us, end_us)
    n_on = int((rises & (times >= start_us)).sum())
    n_off = int((~rises & (times >= start_us)).sum())
    if not n_on or not n_off or not x.size:
        return None
    delay, in_phase = delays(t - lag, p, times, rises)
    time_in, _ = phase_times(times + lag, rises, start_us, end_us)
    time_in[:, latest:] = 0
    time_out = time_in.sum(1)[::-1].copy()
    early = delay < latest
    x, y, p, delay, in_phase, learn = x[early], y[early], p[early], delay[early], in_phase[early], learn[early]
    weights, back = _weights(delay[learn], in_phase[learn], p[learn], time_in, time_out)
    if not weights.any():
        return None
    image, variance = np.zeros((box.h, box.w)), np.zeros((box.h, box.w))
    _add(x, y, p, delay, in_phase, weights, back, 1 / np.array([n_off, n_on], float), image, variance)
    return LockIn(
        box=box, image=image, variance=variance, n_edges=min(n_on, n_off), lag_us=lag, t_us=(start_us + end_us) / 2
    )


def find_lag(t: Floats, p: npt.NDArray[np.int64], clock: LedClock) -> float:
    """Find by how much the events lag behind the edges that were decoded.

    Parameters
    ----------
    t : ndarray of float64, shape (n,)
        Times of events [us].
    p : ndarray of int64, shape (n,)
        Their polarities.
    clock : LedClock

    Returns
    -------
    float
        The lag at which most events are in phase, of those that are a multiple of `BIN_US` [us].
    """
    n_bins = max(1, round(clock.packet_us / BIN_US))
    at = np.floor((t - clock.start_us) / clock.packet_us % 1.0 * n_bins).astype(np.int64) % n_bins
    lead = np.bincount(at, 2.0 * p - 1, n_bins)
    chips = np.array(clock.chips, float)
    state = 2 * chips[(np.arange(n_bins) * chips.size) // n_bins] - 1
    lags = np.arange(round(LEAST_LAG_US / BIN_US), round(MOST_LAG_US / BIN_US) + 1)
    score = np.array([lead @ np.roll(state, lag) for lag in lags])
    return float(lags[int(np.argmax(score))] * BIN_US)


def delays(
    t: Floats, p: npt.NDArray[np.int64], times: Floats, rises: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Return how far each event lies behind the last edge, and whether it is in phase with it.

    Parameters
    ----------
    t : ndarray of float64, shape (n,)
        Times of events [us].
    p : ndarray of int64, shape (n,)
        Their polarities.
    times, rises : ndarray, shape (m,)
        Edges, see `LedClock.edges`.

    Returns
    -------
    delay : ndarray of int64, shape (n,)
        In bins of `BIN_US`, at most ``N_DELAYS - 1``.
    in_phase : ndarray of bool, shape (n,)
    """
    last = np.maximum(np.searchsorted(times, t, side="right") - 1, 0)
    delay = np.clip((t - times[last]) / BIN_US, 0, N_DELAYS - 1).astype(np.int64)
    return delay, rises[last] == (p > 0)


def phase_times(times: Floats, rises: npt.NDArray[np.bool_], start_us: float, end_us: float) -> tuple[Floats, Floats]:
    """Return for how long each delay is in phase, and how long each polarity is out of phase.

    Parameters
    ----------
    times, rises : ndarray, shape (m,)
        Edges, see `LedClock.edges`; the first lies ahead of the span.
    start_us, end_us : float
        Span of time [us].

    Returns
    -------
    time_in : ndarray, shape (2, N_DELAYS)
        For OFF and ON events [us].
    time_out : ndarray, shape (2,)
        [us]
    """
    ends = np.append(times[1:], max(end_us, times[-1]))
    time_in = np.zeros((2, N_DELAYS))
    for polarity in (0, 1):
        mine = rises == (polarity > 0)
        low = np.clip(start_us - times[mine], 0, None)
        high = np.clip(np.minimum(ends[mine], end_us) - times[mine], low, None)
        border = np.append(np.arange(N_DELAYS) * BIN_US, np.inf)
        covered = np.clip(border[None, 1:], low[:, None], high[:, None])
        covered = covered - np.clip(border[None, :-1], low[:, None], high[:, None])
        time_in[polarity] = covered.sum(0)
    return time_in, time_in.sum(1)[::-1].copy()


def _weights(
    delay: npt.NDArray[np.int64], in_phase: npt.NDArray[np.bool_], p: npt.NDArray[np.int64],
    time_in: Floats, time_out: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the weight of each polarity and delay, and that of an event out of phase."""
    weights, back = np.zeros((2, N_DELAYS)), np.zeros(2)
    for polarity in (0, 1):
        own = p == polarity
        counts = np.bincount(delay[own & in_phase], minlength=N_DELAYS).astype(float)
        window = np.ones(SMOOTH_BINS)
        counts, time = (np.convolve(each, window, mode="same") for each in (counts, time_in[polarity]))
        rate = (own & ~in_phase).sum() / max(time_out[polarity], 1.0)
        density = np.divide(counts, time, out=np.zeros(N_DELAYS), where=time > 0)
        share = np.divide(rate, density, out=np.ones(N_DELAYS), where=density > 0)
        weight = np.clip(1 - share, 0, 1)
        mine = np.clip(density - rate, 0, None) * time  # events of the LED, of which the weights keep a part
        if not (weight * mine).any():
            continue
        weights[polarity] = weight * mine.sum() / (weight @ mine)
        if time_out[polarity] > 0:
            back[polarity] = weights[polarity] @ time_in[polarity] / time_out[polarity]
    return weights, back


@njit(cache=True)
def _add(
    x: npt.NDArray[np.int64], y: npt.NDArray[np.int64], p: npt.NDArray[np.int64], delay: npt.NDArray[np.int64],
    in_phase: npt.NDArray[np.bool_], weights: Floats, back: Floats, per_edge: Floats, image: Floats, variance: Floats,
) -> None:  # fmt: skip
    """Add up the weighted events of each pixel."""
    for i in range(x.size):
        unit = per_edge[p[i]]
        if in_phase[i]:
            image[y[i], x[i]] += weights[p[i], delay[i]] * unit
        else:
            w = back[p[i]] * unit
            image[y[i], x[i]] -= w
            variance[y[i], x[i]] += w * w + w * unit
