"""Fit one clock to the events of a light: its phase and period, how edges spread, and how many events they make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.lights.edges import fit_edges, refine_period
from bicode_lab.lights.sample import Floats, Sample

OTHER_PEAK = 0.7  # cycles over the whole length


@dataclass(frozen=True, eq=False)
class Side:
    """What one polarity says, tick by tick.

    Parameters
    ----------
    phase_us : float
        When the edges of tick 0 make most events [us].
    width : float
        Standard deviation of the delay of the events of edges [cycles].
    count : float
        Mean events of an edge.
    stray : float
        Mean events by chance in a cycle.
    edge, chance : ndarray of float64, shape (ticks,)
        Log-likelihood of the events around each tick with an edge, and without one, over that of events that come
        evenly.
    """

    phase_us: float
    width: float
    count: float
    stray: float
    edge: Floats
    chance: Floats


@dataclass(frozen=True, eq=False)
class Clock:
    """A clock and what both polarities say about its ticks.

    Parameters
    ----------
    period_us : float
        Time between two ticks [us].
    on, off : Side
    """

    period_us: float
    on: Side
    off: Side


def fit_clock(sample: Sample, rate_hz: float) -> Clock | None:
    """Fit a clock near a rate.

    Parameters
    ----------
    sample : Sample
    rate_hz : float
        Ticks per second [Hz].

    Returns
    -------
    Clock or None
        None if a polarity has no events, or the best clock near the rate belongs to another peak of the spectrum.
    """
    if sample.on_us.size < 2 or sample.off_us.size < 2:
        return None
    period_us = refine_period(sample.on_us, sample.off_us, 1e6 / rate_hz)
    if abs(1 / period_us - rate_hz * 1e-6) * sample.length_us > OTHER_PEAK:
        return None
    return Clock(
        period_us,
        _fit_side(sample.on_us, sample, period_us),
        _fit_side(sample.off_us, sample, period_us),
    )


def _fit_side(t_us: Floats, sample: Sample, period_us: float) -> Side:
    """Fit one polarity."""
    first_us, width, count, stray, edge, chance = fit_edges(t_us, sample.length_us, period_us)
    return Side(first_us, width, count, stray, edge * sample.trust, chance * sample.trust)


def weights_of(clock: Clock, shift: int) -> npt.NDArray[np.float64]:
    """Return the log-likelihood of each deed at each tick, with falls that many ticks after the rises of their number.

    Parameters
    ----------
    clock : Clock
    shift : int
        Number of ticks that a fall is late.

    Returns
    -------
    ndarray of float64, shape (ticks, 4)
        Columns as in `codes`: nothing, rise, fall, both.
    """
    early = round((clock.off.phase_us - clock.on.phase_us) / clock.period_us)  # ticks are numbered from the first
    first = -shift + early
    begin, end = min(0, first), max(clock.on.edge.size, first + clock.off.edge.size)
    table = np.zeros((end - begin, 4))
    on = slice(-begin, -begin + clock.on.edge.size)
    off = slice(first - begin, first - begin + clock.off.edge.size)
    table[on, 0] += clock.on.chance
    table[on, 2] += clock.on.chance
    table[on, 1] += clock.on.edge
    table[on, 3] += clock.on.edge
    table[off, 0] += clock.off.chance
    table[off, 1] += clock.off.chance
    table[off, 2] += clock.off.edge
    table[off, 3] += clock.off.edge
    return table
