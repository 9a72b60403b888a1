"""The transmitter's clock, found in the marks of a recording.

A mark is a bin in which ON or OFF events lead. The LED switches on the grid of chips only, so the marks have a spectral
line at the chip rate, whatever is sent. The frequency of the line is the clock of the transmitter, its phase is the
middle of the pulses of events. ON and OFF pulses come after their edges with different delays, so each has a phase of
its own: the OFF line is rotated onto the ON line before the two are added.

The clock is taken as constant over the marks that are looked at: one second of a marker, or a text of some seconds.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.recognition.led_state import edge_gates

Floats = npt.NDArray[np.float64]
Marks = npt.NDArray[np.int8]
"""What each bin says: +1 ON, -1 OFF, 0 nothing; shape (n,)."""

MAX_ERROR_PPM = 1100.0  # +-1000, and the width of the line
BLOCK_CHIPS = 32  # 1000 ppm rotate the line by 12 degrees within a block
OVERSAMPLING = 8  # frequencies that are tried within the width of a line


def lead_marks(n_on: npt.ArrayLike, n_off: npt.ArrayLike, gate: float = 0.0) -> Marks:
    """Turn ON and OFF counts into marks: +1 where ON leads, -1 where OFF leads, 0 where neither does (II-B).

    A bin gives one mark, however many events it holds: a readout that is full sends its events in bursts, and so the
    number of events of an edge varies much more than a Poisson count does.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts in each bin.
    gate : float
        Fraction 0 .. 1 of the lead of a usual edge below which a bin gives no mark, see `led_state.edge_gates`: the box
        of a near marker holds thousands of pixels, and one stray event among them must not be a mark.

    Returns
    -------
    ndarray of int8, shape (n,)

    Examples
    --------
    >>> lead_marks([3, 0, 1, 0], [0, 2, 1, 0])
    array([ 1, -1,  0,  0], dtype=int8)
    """
    lead = np.asarray(n_on, np.int64) - np.asarray(n_off, np.int64)
    gate_on, gate_off = edge_gates(n_on, n_off, gate)
    return (lead > gate_on).astype(np.int8) - (lead < -gate_off).astype(np.int8)


def find_chips(marks: Marks, bin_us: float, chip_us: float) -> tuple[Floats, float, float]:
    """Find the chip number of each bin from the marks alone.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        See `lead_marks`.
    bin_us, chip_us : float
        Length of a bin and nominal length of a chip [us].

    Returns
    -------
    chips : ndarray, shape (n,)
        Chip number of the middle of each bin, with its fraction; the middle of the ON pulses is at whole numbers.
    error_ppm : float
        How much longer the transmitter's chip is than nominal [1e-6], within +-`MAX_ERROR_PPM`.
    power : float
        Power of the line, 2 |sum|^2 / number of marks: chi-squared with 2 degrees of freedom if there is no line.
    """
    middles_us = (np.arange(marks.size) + 0.5) * bin_us
    n_blocks = max(1, int(np.ceil(marks.size * bin_us / (BLOCK_CHIPS * chip_us))))
    marked = np.flatnonzero(marks)
    if not marked.size:
        return np.asarray(middles_us / chip_us, np.float64), 0.0, 0.0
    phasors = np.exp(2j * np.pi * middles_us[marked] / chip_us)
    block = np.minimum((middles_us[marked] / (BLOCK_CHIPS * chip_us)).astype(np.int64), n_blocks - 1)
    is_on = marks[marked] > 0
    lines = [_block_sums(phasors[side], block[side], n_blocks) for side in (is_on, ~is_on)]
    between = np.vdot(lines[1], lines[0])
    line = lines[0] + lines[1] * (between / abs(between) if abs(between) > 0 else 1.0)
    # A chip that is longer by a fraction d rotates the line by -d of a turn per chip: a spectral line over the blocks.
    n_steps = int(MAX_ERROR_PPM * 1e-6 * n_blocks * BLOCK_CHIPS * OVERSAMPLING)
    steps = np.arange(-n_steps, n_steps + 1)
    sums = np.fft.ifft(line, n_blocks * OVERSAMPLING, norm="forward")[steps]
    strength = np.abs(sums)
    at = int(np.argmax(strength))
    rate = float(steps[at] + _peak_offset(strength, at)) / (n_blocks * OVERSAMPLING * BLOCK_CHIPS)
    best = np.vdot(np.exp(-2j * np.pi * rate * (np.arange(n_blocks) + 0.5) * BLOCK_CHIPS), line)
    nominal = middles_us / chip_us
    chips: Floats = nominal * (1 + rate) - np.angle(best) / (2 * np.pi)
    return chips, -rate * 1e6, float(2 * abs(best) ** 2 / marked.size)


def _peak_offset(values: Floats, at: int) -> float:
    """Return how far from the largest value, number `at`, the parabola through it and its neighbours is highest."""
    if not 0 < at < values.size - 1:
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def _block_sums(
    phasors: npt.NDArray[np.complex128], block: npt.NDArray[np.int64], n: int
) -> npt.NDArray[np.complex128]:
    """Sum complex numbers within each of `n` blocks."""
    real = np.bincount(block, phasors.real, n)
    imaginary = np.bincount(block, phasors.imag, n)
    return np.asarray(real + 1j * imaginary, np.complex128)
