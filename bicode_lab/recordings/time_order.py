"""Drop the events of a damaged recording whose times contradict those around them.

One time far ahead must not cost all events after it. So lenient reading does not compare an event with the one before
it alone: it keeps the longest sequence of events whose times never decrease. An event is judged when the events that
follow it are known, thus the last ones of a block wait for the next block.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, copy_events, join, no_events, words
from bicode_lab.kernels import njit
from bicode_lab.recordings.validate import BACKWARDS, COUNT, EVENT, EVENTS, MISTIMED, Ints

_WAITING_EVENTS = 4096


@njit(cache=True)
def longest_ordered(t: Ints) -> npt.NDArray[np.bool_]:
    """Mark the longest sequence of times that never decrease; of two equally long ones, that with the later times."""
    n = t.size
    keep = np.zeros(n, np.bool_)
    ends = np.empty(n, np.int64)  # ends[k]: where a sequence of k + 1 times up to the end of `t` begins
    after = np.empty(n, np.int64)  # the next event of the sequence that begins here
    length = 0
    for i in range(n - 1, -1, -1):
        low, high = 0, length
        while low < high:
            middle = (low + high) // 2
            if t[ends[middle]] >= t[i]:
                low = middle + 1
            else:
                high = middle
        after[i] = ends[low - 1] if low > 0 else -1
        ends[low] = i
        if low == length:
            length += 1
    here = ends[length - 1] if length else np.int64(-1)
    while here >= 0:
        keep[here] = True
        here = after[here]
    return keep


class TimeOrder:
    """Passes on the events of a stream whose times never decrease, and counts the others.

    Parameters
    ----------
    state, tally : ndarray of int64
        See `validate.validate_event`; the tally is changed in place.
    """

    def __init__(self, state: Ints, tally: Ints) -> None:
        self._state, self._tally = state, tally
        self._waiting = no_events()
        self._last_us: int | None = None

    def judge(self, events: Events, final: bool = False) -> Events:
        """Return the events that are known to be in the order of time.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)
            The next events of the stream.
        final : bool
            True where no more follow; then none is left waiting.

        Returns
        -------
        ndarray of EVENT_DTYPE, shape (m,)
        """
        together = join([self._waiting, events])
        end = together.size if final else max(together.size - _WAITING_EVENTS, 0)
        times = together["t"].astype(np.int64)
        late = np.zeros(times.size, np.bool_) if self._last_us is None else times < self._last_us
        keep = ~late
        if (np.diff(times[keep]) < 0).any():
            keep[keep] = longest_ordered(times[keep])
        decided, kept = together[:end], keep[:end]
        good = words(decided)[kept].view(together.dtype).ravel()
        if not kept.all():
            self._count(times[:end], kept)
        if good.size:
            self._last_us = int(good["t"][-1])
        self._waiting = copy_events(together[end:])
        return good

    def _count(self, times: Ints, kept: npt.NDArray[np.bool_]) -> None:
        """Count each dropped event: one before the good event ahead of it steps back, another is too far ahead."""
        first = np.iinfo(np.int64).min if self._last_us is None else self._last_us
        before = np.maximum.accumulate(np.where(kept, times, first))
        n_back = int(np.count_nonzero(~kept & (times < before)))
        for rule, count in ((BACKWARDS, n_back), (MISTIMED, int(np.count_nonzero(~kept)) - n_back)):
            self._tally[rule, COUNT] += count
            self._tally[rule, EVENT] = self._state[EVENTS]
