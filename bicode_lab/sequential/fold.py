"""Events of a region on the transmitter's chips, ON and OFF apart.

The LED switches on the grid of chips only, so the ON events of a marker have a spectral line at the chip rate, and so
have its OFF events. The lines give the clock of the transmitter. The two polarities come after their edges with
different latencies, so each has an origin of its own. It lies in the quietest part of the chip, where no pulse is cut
in two. Whole chips of difference between the two remain open; the reader tries them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit

Floats = npt.NDArray[np.float64]

PHASES = 8  # bins of a chip
ON, OFF = 0, 1
MAX_ERROR_PPM = 1100.0  # +-1000, and the width of the line
BLOCK_CHIPS = 32  # 1000 ppm rotate the line by 12 degrees within a block
OVERSAMPLING = 8  # frequencies that are tried within the width of a line
BESIDE = 4  # rates on either side of the chip rate, to compare with
CAP = 3.0  # a bin counts as no more than this many times the count of a usual bin of an edge
UNSEEN_EVENTS = 14.0  # where the usual rate would have made this many events, and there is none, nothing was seen


@dataclass(frozen=True, eq=False)
class Bins:
    """ON and OFF counts of a region in short bins.

    Parameters
    ----------
    chips : ndarray, shape (n,)
        Time of the middle of each bin in nominal chips, ascending. Time that was not seen has no bins.
    counts : ndarray, shape (n, 2)
        ON and OFF events in each bin.
    """

    chips: Floats
    counts: Floats

    def seen(self, quiet_chips: float) -> Bins:
        """Leave out the time in which the light cannot have been in view.

        Parameters
        ----------
        quiet_chips : float
            Longest time without an edge within the code [chips].

        Returns
        -------
        Bins
            Without the gaps that are longer than that by so much that the usual rate would have made `UNSEEN_EVENTS`
            events in the rest.
        """
        at = np.flatnonzero(self.counts.any(axis=1))
        if not at.size:
            return self
        rate = self.counts.sum() / max(float(self.chips[-1] - self.chips[0]), 1.0)
        ends = np.concatenate([[-1], at, [self.chips.size]])  # bins with events, and the ends of the time
        times = self.chips[np.clip(ends, 0, self.chips.size - 1)]
        keep = np.ones(self.chips.size, bool)
        for k in np.flatnonzero(np.diff(times) > quiet_chips + UNSEEN_EVENTS / rate):
            keep[ends[k] + 1 : ends[k + 1]] = False
        return Bins(self.chips[keep], self.counts[keep])

    def capped(self) -> Bins:
        """Limit the counts of single bins, so that a burst of clutter cannot outweigh all edges."""
        counts = self.counts.copy()
        for side in (ON, OFF):
            some = np.sort(counts[counts[:, side] > 0, side])
            if some.size:
                usual = some[np.searchsorted(np.cumsum(some), some.sum() / 2)]
                np.minimum(counts[:, side], CAP * usual, out=counts[:, side])
        return Bins(self.chips, counts)


@dataclass(frozen=True, eq=False)
class Clock:
    """The clock of a transmitter: chip number of a moment = rate * moment - origin of the polarity.

    Parameters
    ----------
    rate : float
        Chips of the transmitter per nominal chip.
    origin : ndarray, shape (2,)
        Where the chips of the ON and of the OFF events begin [chips].
    """

    rate: float
    origin: Floats

    @property
    def error_ppm(self) -> float:
        """How much longer the transmitter's chip is than nominal [1e-6]."""
        return (1 / self.rate - 1) * 1e6

    def later_off(self, chips: int) -> Clock:
        """Return the clock whose OFF events come later after their edges by a number of chips."""
        return Clock(self.rate, self.origin + np.array([0.0, chips]))


@dataclass(frozen=True, eq=False)
class Folded:
    """Counts on chips: of frames that are laid over each other, or of chips in a row.

    Parameters
    ----------
    sums, squares, exposure : ndarray, shape (chips, 2, PHASES)
        Sum of the counts of the bins and of their squares, and number of bins that were seen.
    """

    sums: Floats
    squares: Floats
    exposure: Floats

    def rolled(self, chips: int) -> Folded:
        """Roll the chips so that chip number `chips` becomes the first."""
        at = chips % len(self.sums)
        return Folded(*(np.concatenate([part[at:], part[:at]]) for part in (self.sums, self.squares, self.exposure)))

    def part(self, first: int, n_chips: int) -> Folded:
        """Return `n_chips` chips from number `first` on."""
        return Folded(*(part[first : first + n_chips] for part in (self.sums, self.squares, self.exposure)))

    @property
    def chips_seen(self) -> float:
        """Number of chips that were seen, each as often as it was."""
        return float(self.exposure[:, ON].sum()) / PHASES

    def scatter(self) -> Floats:
        """Return the variance of the counts from frame to frame over their mean, for ON and OFF, 1 or more, shape (2,).

        It needs no levels, and is 1 where no bin was seen twice.
        """
        n = np.maximum(self.exposure, 1)
        variance = (self.squares - self.sums**2 / n).sum(axis=(0, 2))
        mean = (self.sums * (1 - 1 / n)).sum(axis=(0, 2))
        scatter: Floats = np.maximum(variance / np.maximum(mean, 1e-9), 1.0)
        return scatter

    def mean_rate(self) -> Floats:
        """Return the mean count of a bin, for ON and OFF, shape (2,)."""
        rate: Floats = (self.sums.sum(axis=(0, 2)) + 0.5) / (self.exposure.sum(axis=(0, 2)) + 1)
        return rate


def find_clock(bins: Bins) -> Clock:
    """Find the clock in the counts alone.

    Parameters
    ----------
    bins : Bins
        At least one bin.

    Returns
    -------
    Clock
    """
    first = float(bins.chips[0])
    blocks = ((bins.chips - first) / BLOCK_CHIPS).astype(np.int64)
    n = int(blocks[-1]) + 1
    turn = np.exp(2j * np.pi * bins.chips)
    lines = np.zeros((2, n), np.complex128)
    for side in (ON, OFF):
        weight = bins.counts[:, side]
        lines[side] = np.bincount(blocks, weight * turn.real, n) + 1j * np.bincount(blocks, weight * turn.imag, n)
    # A chip that is longer by a fraction d rotates the line by -d of a turn per chip: a spectral line over the blocks.
    n_steps = int(MAX_ERROR_PPM * 1e-6 * n * BLOCK_CHIPS * OVERSAMPLING)
    steps = np.arange(-n_steps, n_steps + 1)
    sums = np.fft.ifft(lines, n * OVERSAMPLING, axis=1, norm="forward")[:, steps]
    squares = np.maximum((bins.counts**2).sum(axis=0), 1e-9)
    strength = (np.abs(sums) ** 2 / squares[:, None]).sum(axis=0)
    at = int(np.argmax(strength))
    rate = 1 + float(steps[at] + _peak_offset(strength, at)) / (n * OVERSAMPLING * BLOCK_CHIPS)
    return Clock(rate, np.array([_quiet_phase(rate * bins.chips, bins.counts[:, side]) for side in (ON, OFF)]))


def line_power(bins: Bins, n_chips: int) -> tuple[float, float]:
    """Measure the lines of ON and OFF at the nominal chip rate.

    Parameters
    ----------
    bins : Bins
    n_chips : int
        Length of a frame [chips].

    Returns
    -------
    power : float
        Sum of 2 |sum of phasors|^2 / count of ON and OFF: chi-squared with 4 degrees of freedom for independent events.
    ratio : float
        Power over that at rates beside the chip rate, mean of ON and OFF: about 1 for clutter that comes in bursts. The
        rates lie half way between multiples of the frame rate, where a frame that is repeated has no power.
    """
    beside = (np.arange(BESIDE) + 1.5) / n_chips
    rates = np.concatenate([[1.0], 1 - beside, 1 + beside])
    squares = np.abs(np.exp(2j * np.pi * rates[:, None] * bins.chips) @ bins.counts) ** 2
    total = np.maximum(bins.counts.sum(axis=0), 1)
    ratio = squares[0] / np.maximum(squares[1:].mean(axis=0), total / 2)
    return float((2 * squares[0] / total).sum()), float(ratio.mean())


def fold(bins: Bins, clock: Clock, n_chips: int, first: int | None = None) -> Folded:
    """Put counts on chips.

    Parameters
    ----------
    bins : Bins
    clock : Clock
    n_chips : int
        Number of chips.
    first : int, optional
        Number of the first chip; None lays all frames of `n_chips` over each other.

    Returns
    -------
    Folded
    """
    parts = np.zeros((3, n_chips, 2, PHASES))
    _fold(bins.chips, bins.counts, clock.rate, clock.origin, first or 0, first is None, parts)
    return Folded(*parts)


@njit(cache=True, nogil=True)
def _fold(chips, counts, rate, origin, first, is_ring, parts):  # type: ignore[no-untyped-def]
    """Add each bin to the sums, squares and exposure of its chip, in a ring of chips or in a row of them."""
    size = parts.shape[1] * PHASES
    for side in range(2):
        for k in range(chips.size):
            place = np.int64(np.floor((rate * chips[k] - origin[side] - first) * PHASES))
            if is_ring:
                place %= size
            elif not 0 <= place < size:
                continue
            chip, phase, count = place // PHASES, place % PHASES, counts[k, side]
            parts[0, chip, side, phase] += count
            parts[1, chip, side, phase] += count**2
            parts[2, chip, side, phase] += 1


def _quiet_phase(chips: Floats, weight: Floats) -> float:
    """Return the phase 0 .. 1 at which events are fewest."""
    fine = 2 * PHASES
    profile = np.bincount(np.floor((chips % 1.0) * fine).astype(np.int64) % fine, weight, fine)
    spectrum = np.fft.rfft(profile)
    spectrum[3:] = 0  # two harmonics: the rest is noise where events are few
    return float((np.argmin(np.fft.irfft(spectrum, fine)) + 0.5) / fine)


def _peak_offset(values: Floats, at: int) -> float:
    """Return how far from the largest value, number `at`, the parabola through it and its neighbours is highest."""
    if not 0 < at < values.size - 1:
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0
