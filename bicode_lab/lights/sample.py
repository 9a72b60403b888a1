"""Thin the events of a light, and list the clocks that its edges may follow."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events

Floats = npt.NDArray[np.float64]

PER_EDGE = 6.0  # events of an edge that count as independent of each other
MOST_KEPT = 1_600
LONG_RUN = 12.0  # events of an edge, from which on its beginning can be told from stray events
WHOLE_RUN, ONSET = 0.1, 0.2  # of the usual run: what counts as an edge, and its beginning
BIN_US = 10.0
FFT_BINS = 32_768  # at 10 us a step of 3 Hz
SLOWEST_HZ, FASTEST_HZ = 25.0, 26_000.0
LEVELS = (0.9, 0.7, 0.5, 0.35, 0.2)  # of the highest peak of the spectrum
HIGHEST_PEAKS = 2
BANDS_HZ = (1_000.0, 2_000.0, 4_000.0, 5_657.0, 8_000.0, 11_314.0, 16_000.0, FASTEST_HZ)  # the highest peak of each


@dataclass(frozen=True, eq=False)
class Sample:
    """Times of the events of a light, of which at most a few are kept for each edge.

    Parameters
    ----------
    on_us, off_us : ndarray of float64
        Times of ON and OFF events since the first event [us].
    length_us : float
        Time from the first event to the last one [us].
    trust : float
        What the evidence of each event is worth, 0 .. 1: events of one edge depend on each other.
    all_on_us, all_off_us : ndarray of float64
        Times of all events, also of those that are not kept [us].
    """

    on_us: Floats
    off_us: Floats
    length_us: float
    trust: float
    all_on_us: Floats
    all_off_us: Floats


def usual_run(polarity: npt.ArrayLike) -> float:
    """Return the length of a run of events of one polarity that half of all events lie in, or in a longer one.

    Parameters
    ----------
    polarity : array_like
        Polarities in the order of time.

    Returns
    -------
    float
        1 or more.

    Examples
    --------
    >>> usual_run([1, 1, 1, 0, 0, 0, 1, 0])
    3.0
    """
    p = np.asarray(polarity)
    if not p.size:
        return 1.0
    turns = np.flatnonzero(np.diff(p)) + 1
    lengths = np.sort(np.diff(np.concatenate([[0], turns, [p.size]])))
    return float(lengths[np.searchsorted(np.cumsum(lengths), p.size / 2)])


def take_sample(events: Events) -> Sample:
    """Keep so many events that one light takes some milliseconds to look at.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Two or more, in the order of time.

    Returns
    -------
    Sample
    """
    step = max(1, math.ceil(events.size / MOST_KEPT))
    t_us = (events["t"] - events["t"][0]).astype(np.float64)
    is_on = events["p"] > 0
    on_us, off_us = t_us[is_on], t_us[~is_on]
    trust = min(1.0, PER_EDGE * step / usual_run(events["p"]))
    return Sample(on_us[step // 2 :: step], off_us[step // 2 :: step], float(t_us[-1]), trust, on_us, off_us)


def onsets(events: Events) -> Events:
    """Return the first events of each edge of a light that makes many: those of runs of one polarity.

    The events of an edge may take longer than the light takes to switch again. Their beginning does not.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (m,)
        Empty where runs of one polarity are short.

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> t = np.arange(400)
    >>> onsets(make_events(t * 0, t * 0, t // 100 % 2, t))["t"][:8].tolist()
    [0, 3, 6, 9, 12, 15, 18, 100]
    """
    p = events["p"]
    usual = usual_run(p)
    if usual < LONG_RUN:
        return events[:0]
    begins = np.concatenate([[0], np.flatnonzero(np.diff(p)) + 1])
    ends = np.append(begins[1:], p.size)
    long = ends - begins >= WHOLE_RUN * usual
    begins, ends = begins[long], ends[long]
    first = np.append(True, p[begins[1:]] != p[begins[:-1]])
    n = max(1, int(ONSET * usual))
    step = max(1, n // int(PER_EDGE))
    keep = np.zeros(p.size, np.bool_)
    for begin, end in zip(begins[first], ends[first], strict=True):
        keep[begin : min(end, begin + n) : step] = True
    return events[keep]


def candidate_rates_hz(sample: Sample) -> list[float]:
    """Return frequencies at which edges of one kind may be whole cycles apart, the lowest first.

    All edges that follow a clock add up at its frequency and at its multiples, so the clock is among the lowest of
    the high peaks of the spectrum. Lower peaks are listed as well, since smeared edges add up less.

    Parameters
    ----------
    sample : Sample

    Returns
    -------
    list of float
        [Hz]
    """
    power = np.zeros(FFT_BINS // 2 + 1)
    n_bins = max(2, min(FFT_BINS, math.ceil((sample.length_us + 1) / BIN_US)))
    for t_us in (sample.all_on_us, sample.all_off_us):
        if t_us.size > 1:
            counts = np.bincount((t_us / BIN_US).astype(np.int64).clip(0, n_bins - 1), minlength=n_bins)
            power += np.abs(np.fft.rfft(counts - counts.mean(), FFT_BINS)) ** 2 / t_us.size
    step_hz = 1e6 / BIN_US / FFT_BINS
    low = max(math.ceil(SLOWEST_HZ / step_hz), math.ceil(0.8e6 / max(sample.length_us, 1.0) / step_hz), 1)
    high = int(FASTEST_HZ / step_hz)
    inner = power[low:high]
    if inner.size < 3:
        return []
    peaks = np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] > inner[2:])) + 1
    if not peaks.size:
        return []
    heights = inner[peaks]
    chosen = {int(peaks[np.argmax(heights >= level * heights.max())]) for level in LEVELS}
    chosen |= set(peaks[np.argsort(-heights)[:HIGHEST_PEAKS]].tolist())
    hertz = (peaks + low) * step_hz
    for begin, end in itertools.pairwise(BANDS_HZ):
        inside = np.flatnonzero((hertz >= begin) & (hertz < end))
        chosen |= set(peaks[inside[np.argmax(heights[inside])]][None].tolist()) if inside.size else set()
    rates = [_top_hz(inner, place, low, step_hz) for place in chosen]
    listed: list[float] = []
    for rate in rates:
        near = any(abs(rate - other) * sample.length_us < 0.4e6 for other in listed)
        if SLOWEST_HZ <= rate <= FASTEST_HZ and not near:
            listed.append(rate)
    return sorted(listed)


def _top_hz(power: Floats, place: int, first: int, step_hz: float) -> float:
    """Return the frequency of the top of the parabola through a peak and its neighbours [Hz]."""
    left, here, right = (float(power[place + k]) for k in (-1, 0, 1))
    bend = left - 2 * here + right
    return (first + place + (0.5 * (left - right) / bend if bend < 0 else 0.0)) * step_hz
