"""Read a beacon's letters with the paper's rule, and measure the beacon's transmitter.

The paper's rule on a beacon: the larger of the ON and OFF counts tells the LED's state (II-B), and a letter is framed
as in any serial port (UART).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, slice_time
from bicode_lab.kernels import njit
from bicode_lab.recognition import edge_gates, led_state

FRAME_CHIPS = 11  # start 0, 7 bits with the most significant first, even parity, two stop bits 1
FIRST_PARITY = 8  # number of the chip that holds the parity
PAUSE_CHIPS = 1  # letters farther apart than this did not follow each other


class ReadLetter(NamedTuple):
    """A letter that was read."""

    t_us: int
    """Begin of its start bit [us]."""
    letter: str
    """The character."""
    parity_ok: bool
    """Whether its parity bit is right."""


@dataclass(frozen=True)
class Transmitter:
    """What the letters that were read tell about their transmitter.

    Parameters
    ----------
    n_letters : int
        Number of letters that were used.
    slower_ppm : float
        How much slower its clock is than its stated rate [ppm], by the camera's clock.
    on_per_rise : float
        ON events per rise of the light.
    off_per_fall : float
        OFF events per fall of the light.
    """

    n_letters: int
    slower_ppm: float
    on_per_rise: float
    off_per_fall: float


def measure_transmitter(
    events: Events, t_us: npt.ArrayLike, frames: npt.ArrayLike, rate_hz: float
) -> Transmitter | None:
    """Measure the transmitter's clock and its events per edge, over the longest run of letters without a pause.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events of the light.
    t_us : array_like, shape (letters,)
        When each letter began [us].
    frames : array_like, shape (letters, 11)
        Levels of its chips, 0 or 1.
    rate_hz : float
        Stated rate of the transmitter [chips per second].

    Returns
    -------
    Transmitter or None
        None where no two letters follow each other.
    """
    times, chips = np.asarray(t_us, np.int64), np.asarray(frames, np.int64).reshape(-1, FRAME_CHIPS)
    letter_us = FRAME_CHIPS * 1e6 / rate_hz
    breaks = np.flatnonzero(np.diff(times) > letter_us + PAUSE_CHIPS * 1e6 / rate_hz)
    ends = np.concatenate([[0], breaks + 1, [times.size]])
    longest = int(np.argmax(np.diff(ends)))
    run = slice(int(ends[longest]), int(ends[longest + 1]))
    t, levels = times[run], chips[run].ravel()
    if t.size < 2:
        return None
    period_us = float(np.polyfit(np.arange(t.size), t, 1)[0])
    turns = np.diff(levels, prepend=1)  # before a start bit the light is on
    p = slice_time(events, int(t[0]), int(t[-1] + period_us))["p"]
    on, off = int((p > 0).sum()), int((p == 0).sum())
    return Transmitter(
        t.size, 1e6 * (period_us / letter_us - 1), on / int((turns > 0).sum()), off / int((turns < 0).sum())
    )


def read_letters_by_rule(
    events: Events, rate_hz: float, *, bins_per_chip: int = 2, gate: float = 0.0
) -> list[ReadLetter]:
    """Read the letters of a light with the paper's rule for the LED's state.

    A fall is the begin of a letter if the chips at the places of both stop bits are 1. Each chip is sampled in its
    middle. Any other fall is ignored.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region; x and y are not used.
    rate_hz : float
        Rate of the light [chips per second], above 0.
    bins_per_chip : int
        Counts per chip, 2 or more; the paper's delta_t_ID is half a chip (III-B).
    gate : float
        See `recognition.edge_gates`; 0 is the paper's rule.

    Returns
    -------
    list of ReadLetter
        In the order of time.

    Raises
    ------
    ValueError
        If `rate_hz` or `bins_per_chip` is out of range.
    """
    if not rate_hz > 0 or bins_per_chip < 2:
        raise ValueError(
            f"rate_hz={rate_hz}, bins_per_chip={bins_per_chip}: choose a rate above 0 and 2 bins or more (II-B)"
        )
    if not events.size:
        return []
    bin_us = 1e6 / rate_hz / bins_per_chip
    start_us = int(events["t"][0]) - ceil(bin_us)  # the light was on, or the first fall is the first event
    number = ((events["t"] - start_us) / bin_us).astype(np.int64)
    n_bins = int(number[-1]) + 1 + FRAME_CHIPS * bins_per_chip  # a last letter may end in ones, without an event
    n_on, n_off = (np.bincount(number[(events["p"] > 0) == side], minlength=n_bins) for side in (True, False))
    gate_on, gate_off = edge_gates(n_on, n_off, gate)
    state = led_state(n_on, n_off, gate_on=gate_on, gate_off=gate_off, before=1)
    letters = []
    for first, value, parity in _frames(state, bins_per_chip):
        letters.append(ReadLetter(start_us + round(first * bin_us), chr(value), bool(parity)))
    return letters


@njit(cache=True)
def _frames(state, m):  # type: ignore[no-untyped-def]
    """Return (first bin, code, whether the parity is even) of each letter in the LED's state; `m` bins are a chip."""
    found = []
    i = 1
    while i + m * (FRAME_CHIPS - 1) + m // 2 < state.size:
        middle = i + m // 2
        is_start = state[i - 1] == 1 and state[i] == 0 and state[middle] == 0
        if is_start and state[middle + m * (FRAME_CHIPS - 2)] == 1 and state[middle + m * (FRAME_CHIPS - 1)] == 1:
            value = 0
            ones = np.int64(state[middle + m * FIRST_PARITY])
            for k in range(1, FIRST_PARITY):
                value = 2 * value + state[middle + m * k]
                ones += state[middle + m * k]
            found.append((i, value, ones % 2 == 0))
            i = middle + m * (FRAME_CHIPS - 1)
        else:
            i += 1
    return found
