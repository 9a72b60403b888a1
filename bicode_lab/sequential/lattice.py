"""Find where events keep the clock of a marker (IV-E: "only the region that blinks at the marker frequency").

The LED switches on the grid of chips only. Taken as phasors at the chip rate, the events of a marker point in one
direction, its ON events and its OFF events each in their own; those of textures, hot pixels and mains lamps point
anywhere. So phasors are summed in blocks of `BLOCK_PX` pixels, ON and OFF apart, and windows of 2 x 2 blocks are looked
at. With independent noise the power 2 |sum|^2 / count of each polarity is chi-squared with 2 degrees of freedom.

A region is a set of neighbouring windows in which the powers of both polarities add up to twice `MIN_POWER`, with at
least one window in which each reaches `MIN_POWER`. Noise alone makes such a window with a probability of
exp(-MIN_POWER): less than 0.01 windows in a period of a sensor of a megapixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import Events, words
from bicode_lab.kernels import njit

BLOCK_PX = 4
MIN_POWER = 16.0
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
    width, height : int
        Sensor size [px].
    """

    def __init__(self, chip_us: float, width: int, height: int) -> None:
        self._chip_us = chip_us
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
        if not events.size:
            return []
        self._sums[:] = 0
        _add(words(events), int(events["t"][0]), round(N_ANGLES * FRACTION / self._chip_us), self._table, self._sums)
        belongs, power = _windows(self._sums, MIN_POWER, MIN_SHARE)
        n, labels, stats, _ = cv2.connectedComponentsWithStats(belongs, connectivity=8)
        regions = []
        for k in range(1, n):
            x, y, w, h, _ = (int(value) for value in stats[k])
            inside = labels[y : y + h, x : x + w] == k
            strength = float(power[y : y + h, x : x + w][inside].max())
            if strength < MIN_POWER:
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
def _windows(sums, min_power, min_share):  # type: ignore[no-untyped-def]
    """Return which blocks belong to a window that passes, and the power of the best window of each block."""
    rows, columns = sums.shape[:2]
    belongs = np.zeros((rows, columns), np.uint8)
    best = np.zeros((rows, columns), np.float32)
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
    return belongs, best
