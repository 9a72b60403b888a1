"""Tell whether the LED is on or off from the events in a region (Fig. 2, first half of box g).

A steady LED makes no events; only its edges do. So ON and OFF are counted in bins of delta_t_ID, and the larger count
gives the state (II-B, Fig. 6). What is counted are the pixels of the 3-valued frame of delta_t_ID: those whose
polarities add up to more than 0 in the bin, or to less.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.kernels import njit
from bicode_lab.recognition.event_codes import AHEAD, ONE, CodedEvents, EventCoder, prefetch

Counts = npt.NDArray[np.int32]
CountKind = Literal["pixels", "events"]


class LedCounter:
    """Counter of ON and OFF in boxes of one sensor; its memory is used again in every period.

    Parameters
    ----------
    width, height : int
        Sensor size [px].
    """

    def __init__(self, width: int, height: int) -> None:
        self._coder = EventCoder(width, height)
        self._box_of: dict[type, npt.NDArray[np.unsignedinteger]] = {}
        self._sums = np.zeros(height * width, np.int16)

    def __call__(
        self,
        events: Events | CodedEvents,
        boxes: Sequence[Sequence[int]],
        start_us: int,
        n_bins: int,
        delta_t_id_us: int,
        count: CountKind = "pixels",
    ) -> tuple[Counts, Counts]:
        """Count ON and OFF in every box and bin.

        Parameters
        ----------
        events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
            Events before `start_us` or after the last bin are left out.
        boxes : sequence of (x, y, w, h)
            Where boxes overlap, the pixel belongs to the first one [px].
        start_us : int
            Start of the first bin [us].
        n_bins : int
            Number of bins.
        delta_t_id_us : int
            Length of a bin [us].
        count : {"pixels", "events"}
            Whether to count pixels of the 3-valued frame, or single events.

        Returns
        -------
        n_on, n_off : ndarray of int32, shape (len(boxes), n_bins)

        Raises
        ------
        ValueError
            If events lie outside the sensor.
        """
        coded = self._coder(events)
        box_of, slices = self._numbers(len(boxes)), [_inside(box) for box in boxes]
        for number in range(len(boxes) - 1, -1, -1):
            box_of[slices[number]] = number
        cuts = coded.cuts(start_us + np.arange(n_bins + 1, dtype=np.int64) * delta_t_id_us)
        counts = np.zeros((len(boxes), n_bins), np.int64)
        none = box_of.dtype.type(np.iinfo(box_of.dtype).max)
        _count(coded.codes, cuts, box_of.ravel(), none, self._sums, counts, count == "events")
        for part_of_sensor in slices:
            box_of[part_of_sensor] = none
        return (counts & 0xFFFFFFFF).astype(np.int32), (counts >> 32).astype(np.int32)

    def _numbers(self, n_boxes: int) -> npt.NDArray[np.unsignedinteger]:
        """Return the table of each pixel's box, empty so far; a byte per pixel is enough for few boxes."""
        kind = np.uint8 if n_boxes < np.iinfo(np.uint8).max else np.uint32
        if kind not in self._box_of:
            shape = self._coder.height, self._coder.width
            self._box_of[kind] = np.full(shape, np.iinfo(kind).max, kind)
        return self._box_of[kind]


def count_on_off(
    events: Events, box: Sequence[int], start_us: int, n_bins: int, delta_t_id_us: int, count: CountKind = "pixels"
) -> tuple[Counts, Counts]:
    """Count ON and OFF in one box and every bin: the curves of Fig. 6.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    box : (x, y, w, h)
        Region [px].
    start_us : int
        Start of the first bin [us].
    n_bins : int
        Number of bins.
    delta_t_id_us : int
        Length of a bin [us].
    count : {"pixels", "events"}
        Whether to count pixels of the 3-valued frame, or single events.

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
    """Decide the state of the LED in each bin: on where ON leads, off where OFF leads, else as before (II-B).

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts in each bin.
    gate_on, gate_off : float
        Lead up to which a bin does not change the state; 0 is the paper's rule. See `edge_gates`.
    before : int
        State before the first bin: 0 off, 1 on.

    Returns
    -------
    ndarray of uint8, shape (n,)
        0 off, 1 on.

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
    """Compute the lead that a bin needs to count as an edge, for ON and for OFF.

    The box of a near marker holds thousands of pixels. With the paper's plain rule, one stray event in the quiet start
    would change the state. So a fraction of the lead of a usual edge is required. The lead of a usual edge is
    sum(lead^2) / sum(lead) over the bins in which its polarity leads: the mean lead, weighted by the lead itself, so
    that the tails of edges hardly count.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts in each bin.
    share : float
        Fraction of the lead of a usual edge, 0 .. 1; 0 is the paper's plain rule.

    Returns
    -------
    gate_on, gate_off : float
        Lead that ON has to exceed over OFF, and OFF over ON.

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
    """Return the rows and the columns of a box, without those of negative number."""
    x, y, w, h = (int(value) for value in box)
    return slice(max(y, 0), max(y + h, 0)), slice(max(x, 0), max(x + w, 0))


@njit(cache=True)
def _count(codes, cuts, box_of, none, sums, counts, whole):  # type: ignore[no-untyped-def]
    """Count ON and OFF of each box and bin into the two halves of a word, ON in the lower half.

    `codes` are those of `event_codes`; bin k is codes[cuts[k]:cuts[k + 1]]; `none` is the number that means no box. The
    events inside boxes are gathered first, without a branch that the processor would predict wrongly. Two passes over
    them follow: one adds up the polarities of each pixel, the other reads each sum once.
    """
    most = max(cuts[1:] - cuts[:-1]) if cuts.size > 1 else 0
    inside, box = np.empty(most, np.uint32), np.empty(most, box_of.dtype)
    here = np.zeros(counts.shape[0], np.int64)  # counts of this bin
    for k in range(counts.shape[1]):
        part, ahead = codes[cuts[k] : cuts[k + 1]], codes[cuts[k] + AHEAD :]
        n = 0
        for i in range(part.size):
            prefetch(box_of, np.uint64(ahead[i]) >> ONE)
            number = box_of[np.uint64(part[i]) >> ONE]
            inside[n], box[n] = part[i], number
            n += number != none
        if not whole:
            for j in range(n):
                code = np.uint64(inside[j])
                sums[code >> ONE] += np.int16(2 * np.int64(code & ONE) - 1)
        here[:] = 0
        for j in range(n):
            code = np.uint64(inside[j])
            held = np.int64(2 * np.int64(code & ONE) - 1) if whole else np.int64(sums[code >> ONE])
            here[np.uint64(box[j])] += np.int64(held > 0) + (np.int64(held < 0) << 32)
            sums[code >> ONE] = 0  # a pixel counts once
        counts[:, k] = here
