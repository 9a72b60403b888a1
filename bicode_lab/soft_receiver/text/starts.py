"""Where the learning of a light's rates may begin: clocks, phases of the edges, and the order of ON and OFF.

The LED switches on the grid of chips only, so the ON events have a spectral line at the chip rate, and the OFF events
have one of their own (see `soft_receiver.clock`). The frequency of the two is the clock, and their phases are the
middles of the two kernels, up to whole chips: OFF events may come up to a chip before or after the ON events of an edge
of the same time. Each of these orders is a start. Where a line is too weak to say its phase, because there are few
events or because they scatter over half a chip, all phases are starts. If the lines of several clocks are alike, each
of them is tried.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.clock import BLOCK_CHIPS, MAX_ERROR_PPM, OVERSAMPLING
from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.text.amounts import OFF, ON, Amounts, usual_count
from bicode_lab.soft_receiver.text.edge_rates import FLOOR, Kernels

Floats = npt.NDArray[np.float64]

LEAD_CHIPS = 0.9  # from the begin of a kernel to the middle of its events
MOST_CLOCKS = 3
LIKE_BEST = 0.3  # a clock is tried if its line has this share of the power of the strongest
SURE_CLOCK = 15.0  # power of a line below which the nominal clock is tried, too
SURE_PHASE = 8.0  # power of a line below which quarters of a chip are tried, for OFF after ON halves
FARTHEST_CHIPS = 0.85  # from ON to OFF
NARROWEST, WIDEST = 0.05, 0.4  # standard deviations of kernels [chips]
ELSEWHERE = 0.003  # of the height of a kernel, in all its bins
EDGE_FRACTION = 0.25  # of the chips begin with a rise, as many with a fall
FIRST_BACKGROUND = 0.03  # of the mean amount of a bin


@dataclass(frozen=True)
class Start:
    """One place where the learning may begin.

    Parameters
    ----------
    rate : float
        Chip numbers advance by ``1 + rate`` per nominal chip.
    shift : float
        Chip number, by that clock, at which chip 0 begins.
    middle, width : (float, float)
        Middle and standard deviation of the ON kernel and of the OFF kernel [chips].
    """

    rate: float
    shift: float
    middle: tuple[float, float]
    width: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Line:
    """The sums of the phasors of one polarity within each block, and of the squares of their weights, and of these."""

    sums: npt.NDArray[np.complex128]
    squares: float
    weight: float


def find_starts(nominal: Floats, is_on: npt.NDArray[np.bool_]) -> list[Start]:
    """List the starts of a light.

    Parameters
    ----------
    nominal : ndarray, shape (n,)
        Time of each event since the first one, in nominal chips.
    is_on : ndarray of bool, shape (n,)

    Returns
    -------
    list of Start
        One or more.
    """
    n_blocks = int(nominal[-1] / BLOCK_CHIPS) + 1
    lines = [_line(nominal[side], n_blocks) for side in (is_on, ~is_on)]
    starts = []
    for rate in _clocks(lines):
        phases, widths, powers = zip(*(_phase(line, rate) for line in lines), strict=True)
        for on in [phases[ON]] if powers[ON] > SURE_PHASE else np.arange(4) / 4:
            for off in [phases[OFF]] if powers[OFF] > SURE_PHASE else on + np.arange(2) / 2:
                for later in (off - on) % 1 + np.array([-1, 0, 1]):
                    if abs(later) <= FARTHEST_CHIPS:
                        shift = float(on + min(later, 0) - LEAD_CHIPS)
                        middle = (float(on - shift), float(on + later - shift))
                        starts.append(Start(rate, shift, middle, (widths[ON], widths[OFF])))
    return starts


def first_kernels(start: Start, amounts: Amounts, n_chips: int) -> Kernels:
    """Make kernels as a start says them, with the mean amounts of the data.

    Parameters
    ----------
    start : Start
    amounts : ndarray, shape (chips, PHASES, 2)
        Amounts of the chips that are looked at.
    n_chips : int
        Length of the kernels.

    Returns
    -------
    Kernels
    """
    mean = amounts.mean(axis=(0, 1), dtype=np.float64)
    per_edge = mean * PHASES / EDGE_FRACTION / _active_share(amounts)
    at = (np.arange(n_chips * PHASES) + 0.5) / PHASES
    edge = np.empty((2, n_chips, PHASES))
    for side in (ON, OFF):
        shape = np.exp(-0.5 * ((at - start.middle[side]) / start.width[side]) ** 2) + ELSEWHERE
        edge[side] = (shape / shape.sum() * max(per_edge[side], FLOOR)).reshape(n_chips, PHASES)
    return Kernels(edge, FIRST_BACKGROUND * mean + FLOOR)


def _active_share(amounts: Amounts) -> float:
    """Return the share of pieces of eleven chips that hold a fifth of a usual one, or more."""
    n = len(amounts) // 11
    pieces = amounts.sum(axis=(1, 2))[: n * 11].reshape(n, 11).sum(axis=1)
    if not pieces.any():
        return 1.0
    return max(float((pieces > 0.2 * np.median(pieces[pieces > 0])).mean()), 0.05)


def _line(nominal: Floats, n_blocks: int) -> _Line:
    """Sum the phasors of the events of one polarity; a bin counts as two usual ones at most."""
    place, counts = np.unique((nominal * PHASES).astype(np.int64), return_counts=True)
    weights = np.minimum(counts, 2 * usual_count(counts))
    phasors = weights * np.exp(2j * np.pi * (place + 0.5) / PHASES)
    block = place // (PHASES * BLOCK_CHIPS)
    sums = np.bincount(block, phasors.real, n_blocks) + 1j * np.bincount(block, phasors.imag, n_blocks)
    return _Line(sums, max(float((weights**2).sum()), FLOOR), max(float(weights.sum()), FLOOR))


def _clocks(lines: list[_Line]) -> list[float]:
    """List the rates of the strongest lines, the strongest first."""
    n_blocks = lines[0].sums.size
    size = n_blocks * OVERSAMPLING
    most = int(MAX_ERROR_PPM * 1e-6 * size * BLOCK_CHIPS)
    steps = np.arange(-most, most + 1)
    each = [np.abs(np.fft.ifft(line.sums, size, norm="forward")[steps]) ** 2 / line.squares for line in lines]
    power = np.sum(each, axis=0)
    left, strongest = power.copy(), float(power.max())
    rates: list[float] = []
    while len(rates) < MOST_CLOCKS and left.max() > LIKE_BEST * strongest:
        at = int(np.argmax(left))
        rates.append(float(steps[at] + _peak_offset(power, at)) / (size * BLOCK_CHIPS))
        left[max(at - OVERSAMPLING, 0) : at + OVERSAMPLING + 1] = 0
    return rates if strongest > SURE_CLOCK else [*rates[:1], 0.0]


def _peak_offset(values: Floats, at: int) -> float:
    """Return how far from the largest value, number `at`, the parabola through it and its neighbours is highest."""
    if not 0 < at < values.size - 1:
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def _phase(line: _Line, rate: float) -> tuple[float, float, float]:
    """Return the phase of a line [chips], the width of its kernel [chips], and its power."""
    middles = (np.arange(line.sums.size) + 0.5) * BLOCK_CHIPS
    total = np.vdot(np.exp(-2j * np.pi * rate * middles), line.sums)
    sharpness = min(max(abs(total) / line.weight, 1e-6), 1.0)
    width = float(np.clip(np.sqrt(-2 * np.log(sharpness)) / (2 * np.pi), NARROWEST, WIDEST))
    return float(np.angle(total) / (2 * np.pi)), width, float(abs(total) ** 2 / line.squares)
