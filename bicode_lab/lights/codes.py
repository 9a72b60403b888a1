"""What each kind of light may do from one tick of its clock to the next, and how probable each choice is.

At a tick the light does one of four things, a *deed*: nothing, a rise, a fall, or both within one tick. A code is a
list of states and of steps between them. A step has its probability and the deed that comes with it. Codes that leave
less free explain what fits them with fewer choices, and so with a higher probability.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

NOTHING, RISE, FALL, BOTH = range(4)
LONGEST_START_BITS = 8
SHORTEST_START_BITS = 2
SHORTEST_DATA_BITS = 2
DATA_BITS = 11.0  # of a packet on average: payload and checksum
PAPER_START_CHIPS, PAPER_DATA_BITS = 6, 11  # III-A
IDLE = 0.15  # share of the letters after which a serial line rests
STAYS_IDLE = 0.8
BITS = 8  # of the interval code


@dataclass(frozen=True, eq=False)
class Code:
    """States of a kind of light and the steps between them.

    Parameters
    ----------
    n_states : int
    source, target : ndarray of int64, shape (steps,)
        State before and after each step.
    share : ndarray of float64, shape (steps,)
        Probability of the step, given the state before it.
    deed : ndarray of int64, shape (steps,)
        What the light does: `NOTHING`, `RISE`, `FALL` or `BOTH`.
    start : ndarray of float64, shape (n_states,)
        How often the light is in each state, whenever one looks.
    """

    n_states: int
    source: npt.NDArray[np.int64]
    target: npt.NDArray[np.int64]
    share: npt.NDArray[np.float64]
    deed: npt.NDArray[np.int64]
    start: npt.NDArray[np.float64]


Step = tuple[object, object, float]


def _of_levels(steps: Iterable[Step], level: dict[object, int]) -> Code:
    """Make a code whose states have levels, so that the deed of a step is the change of the level."""
    listed = list(steps)
    number = {name: k for k, name in enumerate(level)}
    deed = [{0: NOTHING, 1: RISE, -1: FALL}[level[after] - level[before]] for before, after, _ in listed]
    return _code(len(level), [(number[before], number[after], share) for before, after, share in listed], deed)


def _code(n_states: int, steps: list[tuple[int, int, float]], deed: list[int]) -> Code:
    """Make a code from its numbered steps."""
    source, target, share = (np.array(column) for column in zip(*steps, strict=True))
    chances = np.zeros((n_states + 1, n_states))
    np.add.at(chances, (target, source), share)
    chances[:n_states] -= np.eye(n_states)
    chances[n_states] = 1.0
    start = np.linalg.lstsq(chances, np.append(np.zeros(n_states), 1.0))[0]
    return Code(n_states, source, target, share.astype(float), np.array(deed), np.maximum(start, 0.0))


@cache
def free_code() -> Code:
    """Return the code of a light that may switch or not at every tick."""
    return _of_levels([(a, b, 0.5) for a in (0, 1) for b in (0, 1)], {0: 0, 1: 1})


@cache
def bicode_code() -> Code:
    """Return the code of Bicode packets: bits of two unlike chips, and a start of two to eight bits without light."""
    level: dict[object, int] = {("first", 0): 0, ("second", 1): 1, ("first", 1): 1, ("second", 0): 0}
    level |= {("start", k): 0 for k in range(2 * LONGEST_START_BITS)}
    steps: list[Step] = [(("first", a), ("second", 1 - a), 1.0) for a in (0, 1)]
    to_start = 1 / (DATA_BITS + 1)
    for a in (0, 1):
        steps += [(("second", a), ("first", b), (1 - to_start) / 2) for b in (0, 1)]
        steps.append((("second", a), ("start", 0), to_start))
    for k in range(2 * LONGEST_START_BITS):
        bits, last = (k + 1) / 2, k == 2 * LONGEST_START_BITS - 1
        leave = 1.0 if last else 0.5 if bits >= SHORTEST_START_BITS and bits == int(bits) else 0.0
        if leave:
            steps += [(("start", k), ("first", b), leave / 2) for b in (0, 1)]
        if leave < 1:
            steps.append((("start", k), ("start", k + 1), 1 - leave))
    return _of_levels(steps, level)


@cache
def standard_bicode_code() -> Code:
    """Return the code of the paper's packet: three bits without light, then eleven bits of payload and checksum."""
    level: dict[object, int] = {("start", k): 0 for k in range(PAPER_START_CHIPS)}
    steps: list[Step] = [(("start", k), ("start", k + 1), 1.0) for k in range(PAPER_START_CHIPS - 1)]
    ahead: list[object] = [("start", PAPER_START_CHIPS - 1)]
    for bit in range(PAPER_DATA_BITS):
        level |= {(bit, half, chip): chip for half in (0, 1) for chip in (0, 1)}
        steps += [(one, (bit, 0, chip), 0.5) for one in ahead for chip in (0, 1)]
        steps += [((bit, 0, chip), (bit, 1, 1 - chip), 1.0) for chip in (0, 1)]
        ahead = [(bit, 1, 0), (bit, 1, 1)]
    steps += [(one, ("start", 0), 1.0) for one in ahead]
    return _of_levels(steps, level)


@cache
def uart_code(data_bits: int, stop_bits: int, even_parity: bool) -> Code:
    """Return the code of UART frames: start 0, data, parity if there is one, stop 1; the line rests at 1.

    Parameters
    ----------
    data_bits, stop_bits : int
    even_parity : bool
        Whether a bit after the data makes the number of ones even.

    Returns
    -------
    Code
    """
    level: dict[object, int] = {"idle": 1, (0, 0, 0): 0}
    layer: list[tuple[int, int, int]] = [(0, 0, 0)]
    steps: list[Step] = []
    for k in range(1, data_bits + 1):
        ahead = {(k, bit, parity ^ bit if even_parity else 0): bit for _, _, parity in layer for bit in (0, 1)}
        for state, bit in ahead.items():
            level[state] = bit
        steps += [(one, (k, bit, one[2] ^ bit if even_parity else 0), 0.5) for one in layer for bit in (0, 1)]
        layer = list(ahead)
    if even_parity:
        level |= {("parity", bit): bit for bit in (0, 1)}
        steps += [(one, ("parity", one[2]), 1.0) for one in layer]
        last: list[object] = [("parity", 0), ("parity", 1)]
    else:
        last = list(layer)
    for k in range(stop_bits):
        level["stop", k] = 1
        steps += [(one, ("stop", k), 1.0) for one in last]
        last = [("stop", k)]
    steps += [(last[0], "idle", IDLE), (last[0], (0, 0, 0), 1 - IDLE)]
    steps += [("idle", "idle", STAYS_IDLE), ("idle", (0, 0, 0), 1 - STAYS_IDLE)]
    return _of_levels(steps, level)


@cache
def repeated_bicode_code(n_chips: int) -> Code | None:
    """Return the code of a Bicode packet of so many chips that follows itself; None if no packet has so many.

    Parameters
    ----------
    n_chips : int
        Chips of start, payload and checksum.

    Returns
    -------
    Code or None
    """
    longest = min(LONGEST_START_BITS, n_chips // 2 - SHORTEST_DATA_BITS)
    if n_chips % 2 or longest < SHORTEST_START_BITS:
        return None
    level: dict[object, int] = {("start", k): 0 for k in range(2 * longest)}
    steps: list[Step] = []
    for k in range(2 * longest):
        ends = k % 2 == 1 and k + 1 >= 2 * SHORTEST_START_BITS
        lengths = longest - max((k + 1) // 2, SHORTEST_START_BITS) + 1
        leave = 1 / lengths if ends else 0.0
        if leave:
            steps += [(("start", k), (k + 1, chip), leave / 2) for chip in (0, 1)]
        if leave < 1:
            steps.append((("start", k), ("start", k + 1), 1 - leave))
    for k in range(2 * SHORTEST_START_BITS, n_chips):
        level |= {(k, chip): chip for chip in (0, 1)}
        for chip in (0, 1):
            if k == n_chips - 1:
                steps.append(((k, chip), ("start", 0), 1.0))
            elif k % 2:
                steps += [((k, chip), (k + 1, after), 0.5) for after in (0, 1)]
            else:
                steps.append(((k, chip), (k + 1, 1 - chip), 1.0))
    return _of_levels(steps, level)


@cache
def interval_code() -> Code:
    """Return the interval code: pulses whose distances are four base periods (start), then eight times two or three."""
    states = [(place, gap, k) for place in range(BITS + 1) for gap in ((2, 3) if place else (4,)) for k in range(gap)]
    number = {state: k for k, state in enumerate(states)}
    steps, deed = [], []
    for place, gap, k in states:
        if k + 1 < gap:
            steps.append((number[place, gap, k], number[place, gap, k + 1], 1.0))
            deed.append(NOTHING)
        else:
            after = (place + 1) % (BITS + 1)
            choices = (2, 3) if after else (4,)
            steps += [(number[place, gap, k], number[after, other, 0], 1 / len(choices)) for other in choices]
            deed += [BOTH] * len(choices)
    return _code(len(states), steps, deed)
