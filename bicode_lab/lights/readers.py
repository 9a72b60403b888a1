"""Read lights of the interval code, and lights that are told apart by their frequency.

Both say why where there is no reading: the light is named first (`name_light`), and a light that is surely another is
not read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bicode_lab.events import Events, slice_time
from bicode_lab.lights.evidence import PULSE_SHIFTS
from bicode_lab.lights.fit import Clock, fit_clock, weights_of
from bicode_lab.lights.forward import fold
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.lights.name import LOOK_US, SURE, LightName, name_light
from bicode_lab.lights.sample import onsets, take_sample

OTHER_LIGHT = "other_light"
TOO_FEW = "too_few_events"
NOT_SURE = "not_sure"
PERIODIC = ("constant_frequency", "pwm", "mains")


@dataclass(frozen=True, kw_only=True)
class LightReading:
    """What one stretch of a light says.

    Parameters
    ----------
    t_us : int
        Begin of the stretch [us].
    value : int or None
        The number that was read; None for lights of one frequency, and where none was read.
    rate_hz : float or None
        Base rate or frequency that was found [Hz].
    margin : float
        Natural logarithm of the odds against any other reading.
    reason : str or None
        Why there is no reading: "too_few_events", "other_light" or "not_sure".
    """

    t_us: int
    value: int | None = None
    rate_hz: float | None = None
    margin: float = 0.0
    reason: str | None = None


def stretches(events: Events, length_us: int = LOOK_US) -> Iterator[Events]:
    """Yield the events of one stretch of time after the other; a last one shorter than half is left out.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    length_us : int
        [us]

    Yields
    ------
    ndarray of EVENT_DTYPE
    """
    if events.size:
        first, last = int(events["t"][0]), int(events["t"][-1])
        for begin in range(first, max(first + 1, last - length_us // 2 + 2), length_us):
            yield slice_time(events, begin, begin + length_us)


def read_frequency(events: Events) -> LightReading:
    """Read the frequency of a light from one stretch of its events.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region; 50 ms of them are looked at.

    Returns
    -------
    LightReading
    """
    name = name_light(events)
    if name.kind in PERIODIC:
        return LightReading(t_us=int(events["t"][0]), rate_hz=name.rate_hz, margin=name.margin)
    return _none(events, name, PERIODIC)


def read_interval(events: Events, line: IntervalLine | None = None) -> LightReading:
    """Read the number that a light sends by the interval code from one stretch of its events.

    The stretch is folded at each length that a word may have, and every number is tried at every phase.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region.
    line : IntervalLine, optional
        The code; None takes eight bits and finds the base rate.

    Returns
    -------
    LightReading
    """
    name = name_light(events)
    if name.kind not in ("interval", "unknown") or (line is None and name.likely != "interval"):
        return _none(events, name, ("interval",))
    rate_hz = name.rate_hz if line is None else line.rate_hz
    begins = onsets(events)
    clock = fit_clock(take_sample(begins if begins.size else events), rate_hz) if rate_hz else None
    if clock is None:
        return _none(events, name, ("interval",))
    value, margin = _likeliest_word(clock, line or IntervalLine(rate_hz=1e6 / clock.period_us))
    start_us, found_hz = int(events["t"][0]), 1e6 / clock.period_us
    if margin < SURE:
        return LightReading(t_us=start_us, rate_hz=found_hz, margin=margin, reason=NOT_SURE)
    return LightReading(t_us=start_us, value=value, rate_hz=found_hz, margin=margin)


def _likeliest_word(clock: Clock, line: IntervalLine) -> tuple[int, float]:
    """Return the number that fits the ticks of a clock best, and its margin to any other number, and to no pulse."""
    best = np.full(2**line.bits, -np.inf)
    words = [line.gaps(value) for value in range(2**line.bits)]
    length = np.array([sum(gaps) for gaps in words])
    pulses = np.array([np.concatenate([[0], np.cumsum(gaps[:-1])]) for gaps in words])
    for shift in PULSE_SHIFTS:
        weights = weights_of(clock, shift)
        for n in np.unique(length).tolist():
            folded = fold(weights, n)
            gain = folded[:, 3] - folded[:, 0]
            mine = np.flatnonzero(length == n)
            place = (pulses[mine][:, :, None] + np.arange(n)) % n
            best[mine] = np.maximum(best[mine], gain[place].sum(1).max(1) + folded[:, 0].sum())
    order = np.argsort(-best)
    return int(order[0]), float(best[order[0]] - max(best[order[1]], 0.0))


def _none(events: Events, name: LightName, wanted: tuple[str, ...]) -> LightReading:
    """Return the reading of a light that is not read, with the reason."""
    start_us = int(events["t"][0]) if events.size else 0
    if name.kind in ("none", "noise"):
        reason = TOO_FEW
    else:
        reason = NOT_SURE if name.likely in wanted or name.kind == "unknown" else OTHER_LIGHT
    return LightReading(t_us=start_us, rate_hz=name.rate_hz, margin=name.margin, reason=reason)
