"""Fig. 2 g, first half: is the LED on or off?   events in a region -> LED state over time

A steady LED makes no events; only its switching does. So ON and OFF events are counted in
bins of delta_t_ID, and the larger side names the state (II-B, Fig. 6). What is counted are
pixels of the 3-valued delta_t_ID frame: those whose polarities add up to more, or to less,
than 0 in the bin.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from bicode_lab.events import Events, slice_time, words

Counts = npt.NDArray[np.int32]
NO_BOX = -1
OFFSET = 32768  # a pixel's sum of polarities is stored above this, next to its bin
MOST_BINS = 32_000  # whose numbers fit into the upper half of a 32 bit word
ONE_OFF = 1 << 32
LOW_16 = np.uint64(0xFFFF)


class LedCounter:
    """Memory for one sensor's box numbers and pixel sums, made once and used period after period.

    Parameters
    ----------
    width, height : int
        Sensor [px].
    """

    def __init__(self, width: int, height: int) -> None:
        self._box_of = np.full((height, width), NO_BOX, np.int16)
        self._sums = np.zeros((height, width), np.int32)
        self._stamp = 1

    def __call__(
        self,
        events: Events,
        boxes: Sequence[Sequence[int]],
        start_us: int,
        n_bins: int,
        delta_t_id_us: int,
        count: str = "pixels",
    ) -> tuple[Counts, Counts]:
        """Events and boxes in, ON and OFF counts of every box and bin out.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,)
            Those before `start_us` or behind the last bin are left out.
        boxes : sequence of (x, y, w, h)
            Where boxes overlap, the first one gets the pixel [px].
        start_us : int
            Start of the first bin [us].
        n_bins : int
        delta_t_id_us : int
            Length of a bin [us].
        count : {"pixels", "events"}

        Returns
        -------
        n_on, n_off : ndarray of int32, shape (len(boxes), n_bins)
        """
        slices = [_inside(box) for box in boxes]
        for number in range(len(boxes) - 1, -1, -1):
            self._box_of[slices[number]] = number
        counts = np.zeros((len(boxes), n_bins), np.int64)
        for first in range(0, n_bins, MOST_BINS):
            part = counts[:, first : first + MOST_BINS]
            if self._stamp + part.shape[1] > MOST_BINS:
                self._sums[:] = 0
                self._stamp = 1
            begin_us = start_us + first * delta_t_id_us
            end_us = begin_us + part.shape[1] * delta_t_id_us
            here = words(slice_time(events, begin_us, end_us))
            _count(here, self._box_of, self._sums, self._stamp, begin_us, delta_t_id_us, part, count == "events")
            self._stamp += part.shape[1]
        for part_of_sensor in slices:
            self._box_of[part_of_sensor] = NO_BOX
        return (counts & 0xFFFFFFFF).astype(np.int32), (counts >> 32).astype(np.int32)


def count_on_off(
    events: Events, box: Sequence[int], start_us: int, n_bins: int, delta_t_id_us: int, count: str = "pixels"
) -> tuple[Counts, Counts]:
    """Events and one box in, ON and OFF counts of each bin out, shape (n_bins,): the curves of Fig. 6.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    box : (x, y, w, h)
        Region [px].
    start_us : int
        Start of the first bin [us].
    n_bins : int
    delta_t_id_us : int
        Length of a bin [us].
    count : {"pixels", "events"}
        Pixels of the 3-valued frame, or single events.

    Returns
    -------
    n_on, n_off : ndarray of int32, shape (n_bins,)

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> events = make_events(x=[0, 1, 1, 0, 9], y=[0] * 5, p=[1, 1, 1, 0, 1], t_us=[5, 6, 7, 300, 301])
    >>> count_on_off(events, (0, 0, 2, 1), start_us=0, n_bins=3, delta_t_id_us=250)
    (array([2, 0, 0], dtype=int32), array([0, 1, 0], dtype=int32))
    """
    x, y, w, h = box
    inside = events[(events["x"] >= x) & (events["x"] < x + w) & (events["y"] >= y) & (events["y"] < y + h)]
    n_on, n_off = LedCounter(max(x + w, 1), max(y + h, 1))(inside, [box], start_us, n_bins, delta_t_id_us, count)
    return n_on[0], n_off[0]


def led_state(
    n_on: npt.ArrayLike, n_off: npt.ArrayLike, *, gate_on: float = 0.0, gate_off: float = 0.0, before: int = 0
) -> npt.NDArray[np.uint8]:
    """ON and OFF counts in, shape (n,); the LED's state in each bin out, shape (n,), 0 off, 1 on.

    ON where ON counts lead, OFF where OFF counts lead, and as before where neither does (II-B).

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
    gate_on, gate_off : float
        Lead below which a bin says nothing; 0 is the paper's rule. See `edge_gates`.
    before : int
        State ahead of the first bin.

    Examples
    --------
    >>> led_state([0, 5, 0, 0, 3], [0, 1, 0, 4, 3])
    array([0, 1, 1, 0, 0], dtype=uint8)
    """
    lead = np.asarray(n_on, np.int64) - np.asarray(n_off, np.int64)
    says = np.where(lead > max(gate_on, 0), 1, np.where(lead < -max(gate_off, 0), 0, -1))
    last = np.maximum.accumulate(np.where(says >= 0, np.arange(lead.size), -1))
    return np.where(last >= 0, says[np.maximum(last, 0)], before).astype(np.uint8)


def edge_gates(n_on: npt.ArrayLike, n_off: npt.ArrayLike, share: float) -> tuple[float, float]:
    """ON and OFF counts in; the lead that counts as an edge, for ON and for OFF, out: a share of a usual edge's.

    A near marker's box holds thousands of pixels, and a single stray event in the quiet start would
    turn the state of the paper's plain rule. A usual edge is sum(lead^2) / sum(lead) over the bins
    that lead to its side: the mean lead, weighed by itself, so that tails of an edge hardly count.

    Examples
    --------
    >>> edge_gates([100, 0, 0, 100], [0, 80, 0, 0], share=0.25)
    (25.0, 20.0)
    """
    lead = np.asarray(n_on, np.float64) - np.asarray(n_off, np.float64)
    gates = []
    for side in (np.maximum(lead, 0), np.maximum(-lead, 0)):
        total = side.sum()
        gates.append(share * float((side * side).sum() / total) if total > 0 else 0.0)
    return gates[0], gates[1]


def _inside(box: Sequence[int]) -> tuple[slice, slice]:
    """A box in, the rows and columns of it that exist out."""
    x, y, w, h = (int(value) for value in box)
    return slice(max(y, 0), max(y + h, 0)), slice(max(x, 0), max(x + w, 0))


@njit(cache=True)
def _count(events, box_of, sums, stamp, start_us, delta_t_id_us, counts, whole):  # type: ignore[no-untyped-def]
    """Count as the events come: a pixel joins or leaves a side when its sum in the bin crosses 0.

    `events` are words, see `events.words`, all of them inside the bins. A count is two in one word, ON in
    the lower half; a pixel's sum stands in `sums` above OFFSET, under the number of its bin.
    """
    height, width = box_of.shape
    boxes, held_sums = box_of.ravel(), sums.ravel()
    here = np.zeros(counts.shape[0], np.int64)  # of this bin
    k, end_us, bin_word = 0, start_us + delta_t_id_us, np.int64(stamp) << 16
    for i in range(events.shape[0]):
        if events[i, 1] >= end_us:
            counts[:, k] += here
            here[:] = 0
            k = (events[i, 1] - start_us) // delta_t_id_us
            end_us = start_us + (k + 1) * delta_t_id_us
            bin_word = np.int64(stamp + k) << 16
        word = np.uint64(events[i, 0])
        x, y = word & LOW_16, (word >> np.uint64(16)) & LOW_16
        if x >= np.uint64(width) or y >= np.uint64(height):
            continue
        pixel = y * np.uint64(width) + x
        box = boxes[pixel]
        if box < 0:
            continue
        is_on = np.int64((word >> np.uint64(32)) & np.uint64(1))
        if whole:
            here[box] += 1 if is_on else ONE_OFF
            continue
        held = np.int64(held_sums[pixel]) - bin_word  # below 0 where it is of a bin before
        old = held - OFFSET if held >= 0 else 0
        new = old + 2 * is_on - 1
        held_sums[pixel] = np.int32(bin_word + new + OFFSET)
        leaves, joins = np.int64(old > 0) + ONE_OFF * np.int64(old < 0), np.int64(new > 0) + ONE_OFF * np.int64(new < 0)
        here[box] += joins - leaves
    if counts.shape[1] > 0:
        counts[:, k] += here
