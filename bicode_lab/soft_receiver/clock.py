"""When do the transmitter's chips begin?   marks in time -> chip number of every bin

Edges happen on the grid of chips, so the marks (bins that say ON or OFF) have a spectral line
at the chip rate, whatever is sent. Its frequency is the transmitter's clock, its phase the middle
of the pulses. ON and OFF pulses lag their edges differently, so each has a phase of its
own: the OFF line is turned onto the ON line before they are added.

A crystal keeps its rate over what is looked at: a second of a marker, a text of some seconds.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.recognition.led_state import edge_gates

Floats = npt.NDArray[np.float64]
Marks = npt.NDArray[np.int8]

MOST_PPM = 1100.0  # +-1000, and the width of the line
BLOCK_CHIPS = 32  # 1000 ppm turn the line by 12 degrees in a block
OVERSAMPLING = 8  # frequencies tried in the width of a line


def lead_marks(n_on: npt.ArrayLike, n_off: npt.ArrayLike, gate: float = 0.0) -> Marks:
    """ON and OFF counts in, shape (n,); what each bin says out: +1 ON leads, -1 OFF leads, 0 nothing (II-B).

    `gate` is the share of a usual lead below which a bin says nothing, see `led_state.edge_gates`: a near
    marker's box holds thousands of pixels, and one stray event among them is no mark.

    A bin speaks once, however many events it holds: a readout that is full sends its events in bursts,
    and the number of events of an edge varies far more than counting alone would make it.

    Examples
    --------
    >>> lead_marks([3, 0, 1, 0], [0, 2, 1, 0])
    array([ 1, -1,  0,  0], dtype=int8)
    """
    lead = np.asarray(n_on, np.int64) - np.asarray(n_off, np.int64)
    gate_on, gate_off = edge_gates(n_on, n_off, gate)
    return (lead > gate_on).astype(np.int8) - (lead < -gate_off).astype(np.int8)


def find_chips(marks: Marks, bin_us: float, chip_us: float) -> tuple[Floats, float, float]:
    """Marks in, shape (n,); the chip number of each bin's middle, the clock's error and the line's power out.

    Parameters
    ----------
    marks : ndarray of int8, shape (n,)
        See `lead_marks`.
    bin_us, chip_us : float
        Length of a bin and of a nominal chip [us].

    Returns
    -------
    chips : ndarray, shape (n,)
        Not whole: the middle of the ON pulses is at whole numbers.
    error_ppm : float
        How much longer the transmitter's chip is than nominal [1e-6].
    power : float
        2 |sum|^2 / count: chi-squared with 2 degrees of freedom where there is no line.
    """
    middles_us = (np.arange(marks.size) + 0.5) * bin_us
    n_blocks = max(1, int(np.ceil(marks.size * bin_us / (BLOCK_CHIPS * chip_us))))
    marked = np.flatnonzero(marks)
    if not marked.size:
        return np.asarray(middles_us / chip_us, np.float64), 0.0, 0.0
    turns = np.exp(2j * np.pi * middles_us[marked] / chip_us)
    block = np.minimum((middles_us[marked] / (BLOCK_CHIPS * chip_us)).astype(np.int64), n_blocks - 1)
    is_on = marks[marked] > 0
    lines = [_sums(turns[side], block[side], n_blocks) for side in (is_on, ~is_on)]
    between = np.vdot(lines[1], lines[0])
    line = lines[0] + lines[1] * (between / abs(between) if abs(between) > 0 else 1.0)
    # A chip longer by d turns the line by -d turns a chip: a line among blocks.
    n_steps = int(MOST_PPM * 1e-6 * n_blocks * BLOCK_CHIPS * OVERSAMPLING)
    steps = np.arange(-n_steps, n_steps + 1)
    sums = np.fft.ifft(line, n_blocks * OVERSAMPLING, norm="forward")[steps]
    strength = np.abs(sums)
    at = int(np.argmax(strength))
    rate = float(steps[at] + _summit(strength, at)) / (n_blocks * OVERSAMPLING * BLOCK_CHIPS)
    best = np.vdot(np.exp(-2j * np.pi * rate * (np.arange(n_blocks) + 0.5) * BLOCK_CHIPS), line)
    nominal = middles_us / chip_us
    chips: Floats = nominal * (1 + rate) - np.angle(best) / (2 * np.pi)
    return chips, -rate * 1e6, float(2 * abs(best) ** 2 / marked.size)


def _summit(values: Floats, at: int) -> float:
    """Values and the number of the largest in; where the parabola through it and its neighbours is highest, out."""
    if not 0 < at < values.size - 1:
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def _sums(turns: npt.NDArray[np.complex128], block: npt.NDArray[np.int64], n: int) -> npt.NDArray[np.complex128]:
    """Complex numbers and their blocks in, each block's sum out."""
    real = np.bincount(block, turns.real, n)
    imaginary = np.bincount(block, turns.imag, n)
    return np.asarray(real + 1j * imaginary, np.complex128)
