"""States of a line code with a memory of the chips before: what the Viterbi algorithm works on.

The events of a chip depend on the LED's edges before it, so the likelihood of a chip is known for each *context*: the
levels of the last `memory` chips, the newest one in bit 0. A node is a state of the line code together with a context.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver.line_code import LineCode


@dataclass(frozen=True, eq=False)
class Nodes:
    """The nodes of a line code.

    Parameters
    ----------
    context : ndarray of int32, shape (n,)
        Context of each node, 0 .. 2**memory - 1.
    before : ndarray of int32, shape (n, 4)
        Nodes that may come before each node; -1 where there are fewer than four.
    place : ndarray of int32, shape (n,)
        Number of the chip in its frame, see `line_code.Trellis`.
    """

    context: npt.NDArray[np.int32]
    before: npt.NDArray[np.int32]
    place: npt.NDArray[np.int32]


@cache
def build_nodes(line: LineCode, memory: int, checked: bool = False) -> Nodes:
    """Build the nodes of a line code; the result is kept, as it takes some time.

    Parameters
    ----------
    line : LineCode
    memory : int
        Number of chips in a context.
    checked : bool
        Whether only frames that pass the check of the code are allowed, as far as the code's states know it.

    Returns
    -------
    Nodes
    """
    trellis = line.trellis(checked)
    n, size = trellis.level.size, 1 << memory
    reached: set[tuple[int, int]] = set()
    ahead: dict[tuple[int, int], set[tuple[int, int]]] = {}
    frontier = [(s, context) for s in range(n) for context in range(size) if context & 1 == trellis.level[s]]
    followers: list[list[int]] = [[t for t in range(n) if s in trellis.before[t]] for s in range(n)]
    for _ in range(memory):  # drops the contexts that no path leads to
        reached, ahead = set(), {}
        for state, context in frontier:
            for follower in followers[state]:
                node = (follower, (context << 1 | int(trellis.level[follower])) & (size - 1))
                reached.add(node)
                ahead.setdefault(node, set()).add((state, context))
        frontier = sorted(reached)
    number = {node: i for i, node in enumerate(frontier)}
    before = np.full((len(frontier), 4), -1, np.int32)
    for node, i in number.items():
        known = sorted(number[other] for other in ahead[node] if other in number)
        before[i, : len(known)] = known
    contexts = np.array([c for _, c in frontier], np.int32)
    return Nodes(contexts, before, trellis.place[[s for s, _ in frontier]])


@cache
def frame_contexts(line: LineCode, memory: int) -> npt.NDArray[np.int32] | None:
    """List the contexts of every frame that passes the check, for a line code that repeats its frame.

    Parameters
    ----------
    line : LineCode
    memory : int
        Number of chips in a context.

    Returns
    -------
    ndarray of int32, shape (n, frame_chips), or None
        One row for each frame, from chip number ``memory - 1`` on, as a path that begins there has them; None if
        there are too many frames, see `LineCode.frames`.
    """
    frames = line.frames()
    if frames is None:
        return None
    levels = frames.astype(np.int32)
    return sum((np.roll(levels, back + 1 - memory, axis=1) << back for back in range(memory)), np.zeros_like(levels))


@cache
def build_free_nodes(memory: int) -> Nodes:
    """Build the nodes of a light that may have any level in any chip.

    Parameters
    ----------
    memory : int
        Number of chips in a context.

    Returns
    -------
    Nodes
        One for each context; place -1.

    Examples
    --------
    >>> build_free_nodes(2).before[:, :2].tolist()
    [[0, 2], [0, 2], [1, 3], [1, 3]]
    """
    contexts = np.arange(1 << memory, dtype=np.int32)
    before = np.full((contexts.size, 4), -1, np.int32)
    before[:, 0] = contexts >> 1
    before[:, 1] = contexts >> 1 | 1 << memory - 1
    return Nodes(contexts, before, np.full(contexts.size, -1, np.int32))
