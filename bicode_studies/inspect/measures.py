"""Measure a recording chunk by chunk: rates, polarities, events of each pixel, and gaps, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events

BIN_US = 1_000
BEGIN_US, MOST_BEGIN_EVENTS = 2_000_000, 4_000_000  # what is kept of the beginning
HOT_RATIO = 10  # a hot pixel has so many times the events of the busiest of its neighbours
HOT_HZ = 5.0  # and at least this rate
LEAST_HOT_EVENTS = 20
HOLE_US = 200
BUSY_PER_MS = 1_000  # events in the millisecond before and after a hole
ROW_RATIO = 4.0  # a saturated row has so many times the events of the rows around it
REST_OF_ROW = 0.8  # the busiest pixels of a row, such as those of a light, are left out
ROW_HALF = 8  # rows on each side that count as around
PIECE_BINS, MOST_PIECES = 4_000, 200  # of the rate, for its spectrum: 4 s each
FREQUENCIES_HZ = np.arange(20.0, 480.0, 1.0)

Counts = npt.NDArray[np.int64]


@dataclass(kw_only=True, eq=False)
class Measures:
    """What was measured of a recording.

    Parameters
    ----------
    width, height : int
        Sensor size [px].

    Attributes
    ----------
    n_events, n_on : int
        Number of events, and of ON events.
    first_us, last_us : int
        Times of the first and the last event [us].
    step_us : int
        Greatest common divisor of the times since the first event.
    on, off : ndarray of int64, shape (n,)
        ON and OFF events in each millisecond.
    per_pixel : ndarray of int64, shape (height, width)
        Events of each pixel.
    holes : list of (int, int)
        Start and length of gaps after a busy millisecond [us].
    longest_gap : (int, int)
        Start and length of the longest gap [us].
    begin : list of ndarray of EVENT_DTYPE
        The events of the first seconds.
    """

    width: int
    height: int
    n_events: int = 0
    n_on: int = 0
    first_us: int = 0
    last_us: int = 0
    step_us: int = 0
    on: Counts = field(default_factory=lambda: np.zeros(0, np.int64))
    off: Counts = field(default_factory=lambda: np.zeros(0, np.int64))
    per_pixel: Counts = field(default_factory=lambda: np.zeros((0, 0), np.int64))
    holes: list[tuple[int, int]] = field(default_factory=list)
    longest_gap: tuple[int, int] = (0, 0)
    begin: list[Events] = field(default_factory=list)
    _last_ms: Counts = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)

    @property
    def span_us(self) -> int:
        """Time from the first event to the last [us]."""
        return self.last_us - self.first_us

    @property
    def seconds(self) -> float:
        """Time from the first event to the last, at least one millisecond [s]."""
        return max(self.span_us, BIN_US) * 1e-6

    def add(self, events: Events) -> None:
        """Add the next events.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)
            In the order of time.
        """
        if not events.size:
            return
        if not self.n_events:
            self.first_us = int(events["t"][0])
            self.last_us = self.first_us
            self.per_pixel = np.zeros((self.height, self.width), np.int64)
        times = events["t"] - self.first_us
        self._look_for_gaps(times)
        if self.step_us != 1:
            self.step_us = int(np.gcd(self.step_us, np.gcd.reduce(times)))
        bins, is_on = times // BIN_US, events["p"] == 1
        self.on = _added(self.on, bins[is_on], int(bins[-1]) + 1)
        self.off = _added(self.off, bins[~is_on], int(bins[-1]) + 1)
        place = events["y"].astype(np.int64) * self.width + events["x"]
        self.per_pixel += np.bincount(place, minlength=self.width * self.height).reshape(self.height, self.width)
        if self.last_us - self.first_us <= BEGIN_US and self.n_events <= MOST_BEGIN_EVENTS:
            self.begin.append(events)
        self.n_events += events.size
        self.n_on += int(np.count_nonzero(is_on))
        self.last_us = int(events["t"][-1])

    def _look_for_gaps(self, times: Counts) -> None:
        """Note the longest gap, and the gaps before which the rate was high."""
        known = np.concatenate([self._last_ms, times])
        gaps = np.diff(known)
        if gaps.size:
            longest = int(np.argmax(gaps))
            if gaps[longest] > self.longest_gap[1]:
                self.longest_gap = (int(self.first_us + known[longest]), int(gaps[longest]))
        new = max(0, self._last_ms.size - 1)  # the gaps before it were looked at with the chunk before
        for k in np.flatnonzero(gaps[new:] > HOLE_US) + new:
            if k + 1 - np.searchsorted(known, known[k] - BIN_US) >= BUSY_PER_MS:
                self.holes.append((int(self.first_us + known[k]), int(gaps[k])))
        self._last_ms = known[np.searchsorted(known, known[-1] - BIN_US) :].copy()

    def hot_pixels(self) -> npt.NDArray[np.int64]:
        """Return x and y of the hot pixels, the busiest first, shape (n, 2) [px].

        A hot pixel has far more events than each of its neighbours; light falls on several pixels.
        """
        if not self.n_events:
            return np.zeros((0, 2), np.int64)
        counts = self.per_pixel.astype(np.float32)
        around = cv2.dilate(counts, np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8))
        enough = (counts >= LEAST_HOT_EVENTS) & (counts >= HOT_HZ * self.seconds)
        y, x = np.nonzero(enough & (counts >= HOT_RATIO * np.maximum(around, 1)))
        order = np.argsort(-counts[y, x], kind="stable")
        return np.stack([x, y], axis=1)[order]

    def busy_rows(self) -> npt.NDArray[np.int64]:
        """Return the rows that have far more events than those around them, shape (n,); lights do not count."""
        if not self.n_events:
            return np.zeros(0, np.int64)
        rest = np.sort(self.per_pixel, axis=1)[:, : max(1, int(REST_OF_ROW * self.width))]
        rows = rest.sum(axis=1).astype(float)
        padded = np.pad(rows, ROW_HALF, mode="edge")
        around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * ROW_HALF + 1), axis=1)
        return np.flatnonzero(rows > np.maximum(ROW_RATIO * around, rest.shape[1]))

    def holes_in_busy_time(self) -> list[tuple[int, int]]:
        """Return start and length of the gaps whose milliseconds before and after are busy [us]."""
        total = self.on + self.off
        found = []
        for start_us, length_us in self.holes:
            after = (start_us + length_us - self.first_us) // BIN_US
            if total[after : after + 2].max() >= BUSY_PER_MS:
                found.append((start_us, length_us))
        return found

    def spectrum(self) -> npt.NDArray[np.float64]:
        """Return how strongly the rate swings at each of `FREQUENCIES_HZ`, as a share of the mean rate.

        A lamp makes ON events while it gets brighter and OFF events while it gets darker, so each polarity swings once
        in a period of the light; the stronger one is taken. Long recordings are looked at piece by piece.
        """
        best = np.zeros(FREQUENCIES_HZ.size)
        for counts in (self.on, self.off):
            if counts.size and counts.sum():
                pieces = np.array_split(counts, max(1, round(counts.size / PIECE_BINS)))
                swings = [_swings(piece, float(counts.mean())) for piece in pieces[:MOST_PIECES]]
                best = np.maximum(best, np.sqrt(np.mean(np.square(swings), axis=0)))
        return best


def _swings(counts: Counts, mean: float) -> npt.NDArray[np.float64]:
    """Return the amplitude of the counts at each frequency, as a share of a mean rate."""
    window = np.hanning(counts.size + 2)[1:-1]
    waves = np.exp(-2j * np.pi * np.outer(FREQUENCIES_HZ, np.arange(counts.size) * BIN_US * 1e-6))
    amplitude = 2 * np.abs(waves @ ((counts - counts.mean()) * window)) / window.sum()
    return np.asarray(amplitude / mean, np.float64)


def _added(counts: Counts, bins: npt.NDArray[np.int64], n_bins: int) -> Counts:
    """Return counts with the events in `bins` added; the array grows as it must."""
    if n_bins > counts.size:
        counts = np.concatenate([counts, np.zeros(n_bins - counts.size, np.int64)])
    if bins.size:
        low = int(bins[0])
        part = np.bincount(bins - low)
        counts[low : low + part.size] += part
    return counts


def measure(chunks: Iterable[Events], width: int, height: int) -> Measures:
    """Measure a recording.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        In the order of time.
    width, height : int
        Sensor size [px].

    Returns
    -------
    Measures
    """
    measures = Measures(width=width, height=height)
    for chunk in chunks:
        measures.add(chunk)
    return measures
