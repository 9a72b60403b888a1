"""Events of a light that sends given chips: a test double for the soft receiver, not a camera."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, make_events


def edges(chips: npt.ArrayLike, chip_us: float, *, phase_us: float = 0.0, error_ppm: float = 0.0, before: int = 0):
    """Return the times of the edges of given levels [us] and whether they rise."""
    levels = np.concatenate([[before], np.asarray(chips, int)])
    at = np.flatnonzero(np.diff(levels))
    return phase_us + at * chip_us * (1 + error_ppm * 1e-6), levels[at + 1] > levels[at]


def light_events(
    chips: npt.ArrayLike,
    chip_us: float,
    rng: np.random.Generator,
    *,
    phase_us: float = 0.0,
    error_ppm: float = 0.0,
    before: int = 0,
    on_per_edge: float = 3.0,
    off_per_edge: float = 2.0,
    on_delay: float = 0.3,
    off_delay: float = 0.5,
    noise_hz: float = 0.0,
) -> Events:
    """Make the events of a light at x = y = 0: Poisson counts per edge, gamma latencies with means in chips, noise."""
    times, rises = edges(chips, chip_us, phase_us=phase_us, error_ppm=error_ppm, before=before)
    t, p = [np.zeros(0)], [np.zeros(0, int)]
    for polarity, mean, delay in ((1, on_per_edge, on_delay), (0, off_per_edge, off_delay)):
        mine = times[rises == polarity]
        hits = np.repeat(mine, rng.poisson(mean, mine.size))
        t.append(hits + rng.gamma(4, delay * chip_us / 4, hits.size))
        p.append(np.full(hits.size, polarity))
    end_us = phase_us + np.size(chips) * chip_us
    n = rng.poisson(noise_hz * end_us * 1e-6)
    t.append(rng.uniform(0, end_us, n))
    p.append(rng.integers(0, 2, n))
    zeros = np.zeros(sum(part.size for part in t), int)
    return make_events(zeros, zeros, np.concatenate(p), np.concatenate(t).astype(np.int64))
