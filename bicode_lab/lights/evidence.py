"""The evidence of each kind of light on each clock that the edges may follow."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.lights.codes import (
    Code,
    bicode_code,
    free_code,
    interval_code,
    repeated_bicode_code,
    standard_bicode_code,
    uart_code,
)
from bicode_lab.lights.fit import Clock, fit_clock, weights_of
from bicode_lab.lights.forward import fold, likely_repetitions, sum_over_paths
from bicode_lab.lights.sample import FASTEST_HZ, Sample, candidate_rates_hz

PERIODIC_HZ = (30.0, 12_000.0)
CLOCK_PARAMETERS = 10  # phase, width, shares, counts and their shape, of two polarities, less what both share
OTHER_RATES = (1 / 4, 1 / 3, 1 / 2, 2.0)  # of the likeliest clock
FEWEST_CYCLES = 2.2
SAME_PEAK = 0.2e6  # cycles over the length, in millionths
GRIDS = 3  # clocks that every code is tried on
RATES_HZ = {  # ticks per second
    "unknown": (25.0, 26_000.0),
    "bicode": (200.0, 24_000.0),
    "uart": (250.0, 25_000.0),
    "interval": (250.0, 25_000.0),
}
CODES = {
    "unknown": [free_code()],
    "bicode": [standard_bicode_code(), bicode_code()],
    "uart": [uart_code(8, 1, False), uart_code(8, 2, False), uart_code(7, 2, True)],
    "interval": [interval_code()],
}
UNKNOWN_IS_RARER = math.log(99.0)  # a code that is not known here
REPEATS = (20, 128)  # ticks
SHIFTS, PULSE_SHIFTS = (-1, 0, 1), (0, 1, 2)


@dataclass(frozen=True)
class Score:
    """Evidence of one kind on one clock."""

    evidence: float
    family: str
    clock: Clock | None = None


def clock_scores(sample: Sample) -> list[Score]:
    """Return the evidence of every kind that follows a clock, on every clock that may be."""
    tried = 2 * sample.length_us * 1e-6 * FASTEST_HZ  # clocks that can be told from each other
    n = sample.on_us.size + sample.off_us.size
    cost = math.log(max(tried, 1.0)) + 0.5 * CLOCK_PARAMETERS * math.log(n)
    clocks = _clocks(sample)
    scores = [
        Score(float(clock.on.edge.sum() + clock.off.edge.sum()) - cost, "periodic", clock)
        for clock in clocks
        if _within(1e6 / clock.period_us, PERIODIC_HZ)
    ]
    for clock in sorted(clocks, key=_promise)[-GRIDS:]:
        rate_hz = 1e6 / clock.period_us
        for family, limits in RATES_HZ.items():
            if _within(rate_hz, limits):
                scores.append(Score(_best_shift(clock, family) - cost, family, clock))
    return scores


def _clocks(sample: Sample) -> list[Clock]:
    """Return the clocks that the edges may follow: those of the spectrum, and simple multiples of the likeliest."""
    clocks: list[Clock] = []
    rates_hz = candidate_rates_hz(sample)
    for more in (False, True):
        if more and clocks:
            best = {max(clocks, key=key).period_us for key in (_promise, _regularity)}
            rates_hz = [factor * 1e6 / period_us for factor in OTHER_RATES for period_us in best]
        for rate_hz in rates_hz:
            clock = fit_clock(sample, rate_hz)
            if clock is None or sample.length_us < FEWEST_CYCLES * clock.period_us:
                continue
            known = (abs(1e6 / clock.period_us - 1e6 / other.period_us) for other in clocks)
            if all(distance_hz * sample.length_us >= SAME_PEAK for distance_hz in known):
                clocks.append(clock)
    return clocks


def _promise(clock: Clock) -> float:
    """Return the evidence if the light may do anything at each tick, for nothing."""
    return sum(float(np.maximum(side.edge, side.chance).sum()) for side in (clock.on, clock.off)) - sum(
        math.log(2.0) * side.edge.size / 2 for side in (clock.on, clock.off)
    )


def _regularity(clock: Clock) -> float:
    """Return the evidence if there is an edge at each tick."""
    return float(clock.on.edge.sum() + clock.off.edge.sum())


def _within(rate_hz: float, limits: tuple[float, float]) -> bool:
    """Return whether a rate lies within limits."""
    return limits[0] <= rate_hz <= limits[1]


def _evidence(table: npt.NDArray[np.float64], codes: Iterable[Code]) -> float:
    """Return the evidence of the likeliest of some codes."""
    return max(
        float(sum_over_paths(table, code.source, code.target, code.share, code.deed, code.start)) for code in codes
    )


def _best_shift(clock: Clock, family: str) -> float:
    """Return the evidence of the likeliest code and order of rises and falls, less the cost of the choice.

    A code that is sent again and again chooses only once, so it is looked at folded as well.
    """
    codes, shifts = CODES[family], PULSE_SHIFTS if family == "interval" else SHIFTS
    found = -math.inf
    for shift in shifts:
        weights = weights_of(clock, shift)
        found = max(found, _evidence(weights, codes) - math.log(len(codes)))
        for lag in {*likely_repetitions(weights, *REPEATS)} - {0}:
            ring = repeated_bicode_code(lag) if family == "bicode" else None
            repeated = [*codes, ring] if ring else codes
            cost = math.log(len(repeated) * REPEATS[1])
            found = max(found, _evidence(fold(weights, lag), repeated) - cost)
    return found - math.log(len(shifts)) - (UNKNOWN_IS_RARER if family == "unknown" else 0.0)
