"""Find where events keep the clock of a marker (IV-E: "only the region that blinks at the marker frequency").

The LED switches on the grid of chips only. Taken as phasors at the chip rate, the events of a marker point in one
direction, its ON events and its OFF events each in their own; those of textures, hot pixels and mains lamps point
anywhere. So phasors are summed in blocks of `BLOCK_PX` pixels, ON and OFF apart, and windows of 2 x 2 blocks are looked
at. With independent noise the power 2 |sum|^2 / count of each polarity is chi-squared with 2 degrees of freedom.

A region is a set of neighbouring windows in which the powers of both polarities add up to twice `MIN_POWER`, with at
least one window in which each reaches `MIN_POWER`. Noise alone makes such a window with a probability of
exp(-MIN_POWER): less than 0.01 windows in a period of a sensor of a megapixel. In the events of a second, which are
searched for markers that are too faint for one period, the powers must add up to twice `FAINT_POWER`, and each reach
`WEAKER_POWER` only, because a faint plate's ON and OFF events differ; noise makes 0.1 such windows in a search. The
latency of a pixel in little light varies by as much as a chip, so that the line at the chip rate is weak; but a packet
that is repeated has lines at the multiples of its own rate, too. They are looked for in the busiest windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events, words
from bicode_lab.kernels import njit
from bicode_lab.sequential.fold import MAX_ERROR_PPM

BLOCK_PX = 4
MIN_POWER = 16.0
FAINT_POWER, WEAKER_POWER = 18.0, 6.0  # of events of a second, in which ten clock errors are tried
N_BUSY, BUSY_EVENTS = 64, 8  # windows whose events are looked at for frames, and least events of their weaker polarity
MOST_EVENTS = 400  # of a polarity and window; a faint marker has fewer in a second
HARMONICS, REPEATED_POWER = (
    10,
    120.0,
)  # of the frame rate; noise has a power of 40, and reaches 120 in one of 1e9 windows
MIN_SHARE = 0.1  # of the strongest block of a window, below which a block does not belong to what blinks there
N_ANGLES = 256  # angles of a phasor, a power of 2
FRACTION = 1 << 32  # angles are counted in whole numbers of this fraction

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class LatticeRegion:
    """A box in which events keep the clock.

    Parameters
    ----------
    box : Box
        [px]
    power : float
        Largest power of the weaker polarity in a window.
    """

    box: Box
    power: float


class LatticeFinder:
    """Finder of regions that keep the clock of a chip; its memory is used again in every period.

    Parameters
    ----------
    chip_us : float
        Nominal length of a chip [us].
    frame_chips : int
        Length of a frame [chips].
    width, height : int
        Sensor size [px].
    """

    def __init__(self, chip_us: float, frame_chips: int, width: int, height: int) -> None:
        self._chip_us, self._frame_us = chip_us, chip_us * frame_chips
        self._size = width, height
        self._columns, self._rows = -(-width // BLOCK_PX), -(-height // BLOCK_PX)
        self._sums = np.zeros((self._rows, self._columns, 2, 4), np.float32)
        angles = 2 * np.pi * (np.arange(N_ANGLES) + 0.5) / N_ANGLES
        self._table = np.stack([np.cos(angles), np.sin(angles)], axis=1).astype(np.float32)

    def __call__(self, events: Events) -> list[LatticeRegion]:
        """Find the regions of one period, the one with the highest power first.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)

        Returns
        -------
        list of LatticeRegion
        """
        return self._regions(events, [0.0], MIN_POWER, MIN_POWER)

    def faint(self, events: Events) -> list[LatticeRegion]:
        """Find the regions in events of a second or so, for which the clock of the transmitter matters.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)

        Returns
        -------
        list of LatticeRegion
        """
        if not events.size:
            return []
        span_chips = float(events["t"][-1] - events["t"][0]) / self._chip_us
        n_steps = int(np.ceil(2 * MAX_ERROR_PPM * 1e-6 * span_chips))  # half the width of the line apart
        errors_ppm = np.linspace(-MAX_ERROR_PPM, MAX_ERROR_PPM, 2 * n_steps + 1)
        clocked = self._regions(events, errors_ppm.tolist(), FAINT_POWER, WEAKER_POWER)
        boxes = [region.box for region in clocked]
        repeated = [LatticeRegion(box, 0.0) for box in self._repeated(events, span_chips)]
        return clocked + [region for region in repeated if not any(region.box.overlaps(box) for box in boxes)]

    def _repeated(self, events: Events, span_chips: float) -> list[Box]:
        """Return the busy windows whose events repeat with the frame, for any clock error."""
        boxes = self._busy(events)
        window_of = np.full((self._rows, self._columns), -1, np.int16)
        for number, box in enumerate(boxes):
            row, column = box.y // BLOCK_PX, box.x // BLOCK_PX
            window_of[row : row + 2, column : column + 2] = number
        span_frames = span_chips * self._chip_us / self._frame_us
        n_steps = int(np.ceil(2 * MAX_ERROR_PPM * 1e-6 * HARMONICS * span_frames))
        frame_us = self._frame_us * (1 + np.linspace(-MAX_ERROR_PPM, MAX_ERROR_PPM, 2 * n_steps + 1) * 1e-6)
        steps = np.round(N_ANGLES * FRACTION / frame_us).astype(np.int64)
        lines = np.zeros((len(boxes), 2, steps.size, HARMONICS, 2))
        n_events = np.zeros((len(boxes), 2), np.int64)
        _add_lines(words(events), int(events["t"][0]), steps, self._table, window_of, lines, n_events)
        power = 2 * (lines**2).sum(axis=(3, 4)) / n_events[:, :, None]
        return [box for box, best in zip(boxes, power.sum(axis=1).max(axis=1), strict=True) if best >= REPEATED_POWER]

    def _busy(self, events: Events) -> list[Box]:
        """Return the windows with the most events of their weaker polarity, none of which overlap."""
        counts = np.zeros((2, self._rows + 1, self._columns + 1), np.int64)
        _count(words(events), counts)
        windows = (counts[:, :-1, :-1] + counts[:, 1:, :-1] + counts[:, :-1, 1:] + counts[:, 1:, 1:]).min(axis=0)
        boxes: list[Box] = []
        for at in np.argsort(-windows, axis=None, kind="stable")[: 4 * N_BUSY]:
            row, column = divmod(int(at), self._columns)
            if windows[row, column] < BUSY_EVENTS:
                break
            box = Box(column * BLOCK_PX, row * BLOCK_PX, 2 * BLOCK_PX, 2 * BLOCK_PX).clipped(*self._size)
            if not any(box.overlaps(other) for other in boxes):
                boxes.append(box)
        return boxes[:N_BUSY]

    def _regions(
        self, events: Events, errors_ppm: Sequence[float], min_power: float, weaker_power: float
    ) -> list[LatticeRegion]:
        """Find the regions whose mean power and power of the weaker polarity are large enough for any clock error."""
        belongs = np.zeros((self._rows, self._columns), np.uint8)
        power = np.zeros((self._rows, self._columns), np.float32)
        for error_ppm in errors_ppm if events.size else []:
            self._sums[:] = 0
            chip_us = self._chip_us * (1 + error_ppm * 1e-6)
            _add(words(events), int(events["t"][0]), round(N_ANGLES * FRACTION / chip_us), self._table, self._sums)
            _windows(self._sums, min_power, MIN_SHARE, belongs, power)
        n, labels, stats, _ = cv2.connectedComponentsWithStats(belongs, connectivity=8)
        regions = []
        for k in range(1, n):
            x, y, w, h, _ = (int(value) for value in stats[k])
            inside = labels[y : y + h, x : x + w] == k
            strength = float(power[y : y + h, x : x + w][inside].max())
            if strength < weaker_power:
                continue
            box = Box(x * BLOCK_PX, y * BLOCK_PX, w * BLOCK_PX, h * BLOCK_PX).clipped(*self._size)
            regions.append(LatticeRegion(box, strength))
        return sorted(regions, key=lambda region: -region.power)


@njit(cache=True, nogil=True)
def _add(events, start_us, steps, table, sums):  # type: ignore[no-untyped-def]
    """Add the phasor of each event, given as `events.words`, to the sums of its block and polarity.

    It turns by `steps` / `FRACTION` angles in a microsecond.
    """
    for i in range(events.shape[0]):
        word = events[i, 0]
        x, y, p = word & 0xFFFF, (word >> 16) & 0xFFFF, (word >> 32) & 1
        angle = (((events[i, 1] - start_us) * steps) // FRACTION) & (N_ANGLES - 1)
        block = sums[y // BLOCK_PX, x // BLOCK_PX, p]
        block[0] += table[angle, 0]
        block[1] += table[angle, 1]
        block[2] += 1


@njit(cache=True, nogil=True)
def _count(events, counts):  # type: ignore[no-untyped-def]
    """Count the events of each polarity and block."""
    for i in range(events.shape[0]):
        word = events[i, 0]
        counts[(word >> 32) & 1, ((word >> 16) & 0xFFFF) // BLOCK_PX, (word & 0xFFFF) // BLOCK_PX] += 1


@njit(cache=True, nogil=True)
def _add_lines(events, start_us, steps, table, window_of, lines, n_events):  # type: ignore[no-untyped-def]
    """Add the phasors of the first `MOST_EVENTS` events of each window and polarity at multiples of frame rates."""
    for i in range(events.shape[0]):
        word = events[i, 0]
        window = window_of[((word >> 16) & 0xFFFF) // BLOCK_PX, (word & 0xFFFF) // BLOCK_PX]
        p = (word >> 32) & 1
        if window < 0 or n_events[window, p] == MOST_EVENTS:
            continue
        n_events[window, p] += 1
        for j in range(steps.size):
            turned = (events[i, 1] - start_us) * steps[j]
            for k in range(lines.shape[3]):
                angle = (turned * (k + 1) // FRACTION) & (N_ANGLES - 1)
                lines[window, p, j, k, 0] += table[angle, 0]
                lines[window, p, j, k, 1] += table[angle, 1]


@njit(cache=True, nogil=True)
def _windows(sums, min_power, min_share, belongs, best):  # type: ignore[no-untyped-def]
    """Mark the blocks that belong to a window that passes, and raise the power of the best window of each block."""
    rows, columns = sums.shape[:2]
    for r in range(max(rows - 1, 1)):
        for c in range(max(columns - 1, 1)):
            n_events = 0.0
            for i in range(r, min(r + 2, rows)):
                for j in range(c, min(c + 2, columns)):
                    n_events += sums[i, j, 0, 2] + sums[i, j, 1, 2]
            if n_events < min_power:  # a power is at most twice the number of events
                continue
            weaker, together = np.inf, 0.0
            lines = np.zeros((2, 2))
            for p in range(2):
                n = 0.0
                for i in range(r, min(r + 2, rows)):
                    for j in range(c, min(c + 2, columns)):
                        lines[p, 0] += sums[i, j, p, 0]
                        lines[p, 1] += sums[i, j, p, 1]
                        n += sums[i, j, p, 2]
                power = 2 * (lines[p, 0] ** 2 + lines[p, 1] ** 2) / max(n, 1.0)
                weaker, together = min(weaker, power), together + power
            if together < 2 * min_power:
                continue
            strongest = 0.0
            own = np.zeros((2, 2))
            for i in range(r, min(r + 2, rows)):
                for j in range(c, min(c + 2, columns)):
                    for p in range(2):
                        length = np.sqrt(lines[p, 0] ** 2 + lines[p, 1] ** 2)
                        along = sums[i, j, p, 0] * lines[p, 0] + sums[i, j, p, 1] * lines[p, 1]
                        own[i - r, j - c] += along / max(length, 1e-9)
                    strongest = max(strongest, own[i - r, j - c])
            for i in range(r, min(r + 2, rows)):
                for j in range(c, min(c + 2, columns)):
                    if own[i - r, j - c] >= max(1.0, min_share * strongest):
                        belongs[i, j] = 1
                        best[i, j] = max(best[i, j], weaker)
