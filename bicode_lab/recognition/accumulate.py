"""Fig. 2 a, b, d, e and Fig. 3: events become frames.   events in delta_t -> image

The paper adds up the polarities (+1, -1) of each pixel's events over delta_t; the frame
holds the sign of that sum (II-A). Other rules are offered, because a blink's ON and OFF
events nearly cancel in the sum:

    sum     sign of the sum of polarities                     the paper's text
    last    polarity of the pixel's last event                as the authors' SDK draws frames
    any     +1 where anything happened
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, windows
from bicode_lab.kernels import njit
from bicode_lab.recognition.event_codes import ONE, CodedEvents, EventCoder
from bicode_lab.recognition.settings import FRAME_RULES, FrameRule

Frame = npt.NDArray[np.int8]
"""A 3-valued frame, shape (height, width), values -1, 0, +1."""


def accumulate(events: Events | CodedEvents, width: int, height: int, rule: FrameRule = "sum") -> Frame:
    """The events of one delta_t in, the 3-valued frame out (Fig. 3).

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    width, height : int
        Sensor [px].
    rule : {"sum", "last", "any"}
        See the top of this file.

    Returns
    -------
    ndarray of int8, shape (height, width)
        -1, 0 or +1.

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> events = make_events(x=[0, 0, 1, 2, 2, 2], y=[0] * 6, p=[1, 0, 1, 1, 1, 0], t_us=range(6))
    >>> [accumulate(events, 4, 1, rule).tolist() for rule in ("sum", "last", "any")]
    [[[0, 1, 1, 0]], [[-1, 1, -1, 0]], [[1, 1, 1, 0]]]
    """
    if rule not in FRAME_RULES:
        raise ValueError(f"rule={rule!r} is not known; choose one of {FRAME_RULES}")
    coded = EventCoder(width, height)(events)
    if rule == "sum":
        total = np.zeros((height, width), np.int32)
        _add(coded.codes[: coded.events.size], -1, total.ravel())
        return np.sign(total).astype(np.int8)
    frame = np.zeros((height, width), np.int8)
    _keep_last(coded.codes[: coded.events.size], frame.ravel())
    return np.abs(frame, out=frame) if rule == "any" else frame


def count_events(events: Events | CodedEvents, width: int, height: int) -> npt.NDArray[np.int32]:
    """The events of one delta_t in, how many each pixel made out, shape (height, width).

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> count_events(make_events([0, 0, 2], [0, 0, 0], [1, 0, 1], [1, 2, 3]), 3, 1)
    array([[2, 0, 1]], dtype=int32)
    """
    count = np.zeros((height, width), np.int32)
    coded = EventCoder(width, height)(events)
    _add(coded.codes[: coded.events.size], 1, count.ravel())
    return count


def frames(
    chunks: Iterable[Events] | Events,
    delta_t_us: int,
    width: int,
    height: int,
    rule: FrameRule = "sum",
    *,
    t0_us: int | None = None,
) -> Iterator[tuple[int, Frame]]:
    """A stream of events in, frame after frame of delta_t_us out, the empty ones too.

    Parameters
    ----------
    chunks : iterable of event arrays, or one event array
    delta_t_us : int
        Time of one frame [us].
    width, height : int
        Sensor [px].
    rule : {"sum", "last", "any"}
    t0_us : int, optional
        Start of the first frame [us]; None takes the first event.

    Yields
    ------
    t_us : int
        Start of the frame [us].
    frame : ndarray of int8, shape (height, width)
    """
    if delta_t_us < 1:
        raise ValueError(f"delta_t_us={delta_t_us} is not a time; choose 1 or more")
    expected: int | None = None
    for start_us, events in windows(chunks, delta_t_us, t0_us=t0_us):
        while expected is not None and expected < start_us:
            yield expected, np.zeros((height, width), np.int8)
            expected += delta_t_us
        yield start_us, accumulate(events, width, height, rule)
        expected = start_us + delta_t_us


@njit(cache=True, nogil=True)
def _add(codes, off, total):  # type: ignore[no-untyped-def]
    """Add 1 at the pixel of each ON event, and `off` at that of each OFF event."""
    for i in range(codes.size):
        code = np.uint64(codes[i])
        total[code >> ONE] += 1 if code & ONE else off


@njit(cache=True, nogil=True)
def _keep_last(codes, frame):  # type: ignore[no-untyped-def]
    """Set each event's pixel to its polarity."""
    for i in range(codes.size):
        code = np.uint64(codes[i])
        frame[code >> ONE] = 1 if code & ONE else -1
