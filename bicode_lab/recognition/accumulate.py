"""Turn events into frames (Fig. 2, boxes a, b, d, e; Fig. 3).

The paper adds up the polarities (+1, -1) of the events of each pixel over delta_t; the frame holds the sign of that sum
(II-A). There are other rules as well, because the ON and OFF events of a blink nearly cancel in the sum:

    sum     sign of the sum of the polarities (the paper's text)
    last    polarity of the last event of the pixel (as the authors' SDK draws frames)
    any     +1 where there is an event
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
    """Accumulate the events of one delta_t into a 3-valued frame (Fig. 3).

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
        The events of one delta_t.
    width, height : int
        Sensor size [px].
    rule : {"sum", "last", "any"}
        How the events of a pixel become its value, see the top of this file.

    Returns
    -------
    ndarray of int8, shape (height, width)
        -1, 0 or +1.

    Raises
    ------
    ValueError
        If the rule is not known, or if events lie outside the sensor.

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
    """Count the events of each pixel.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,), or CodedEvents
    width, height : int
        Sensor size [px].

    Returns
    -------
    ndarray of int32, shape (height, width)
        Number of events, 0 or more.

    Raises
    ------
    ValueError
        If events lie outside the sensor.

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
    chunks: Iterable[Events] | Events, delta_t_us: int, width: int, height: int, rule: FrameRule = "sum"
) -> Iterator[tuple[int, Frame]]:
    """Turn a stream of events into frames of equal length; frames without events are included.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE, or one such array
        In the order of time. The first frame starts at the first event.
    delta_t_us : int
        Time of one frame [us], 1 or more.
    width, height : int
        Sensor size [px].
    rule : {"sum", "last", "any"}
        How the events of a pixel become its value, see `accumulate`.

    Yields
    ------
    t_us : int
        Start of the frame [us].
    frame : ndarray of int8, shape (height, width)
        -1, 0 or +1.

    Raises
    ------
    ValueError
        If `delta_t_us` is below 1, time runs backwards, or events lie outside the sensor.
    """
    if delta_t_us < 1:
        raise ValueError(f"delta_t_us={delta_t_us} is shorter than one microsecond; choose 1 or more")
    expected: int | None = None
    for start_us, events in windows(chunks, delta_t_us):
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
    """Set the pixel of each event to its polarity."""
    for i in range(codes.size):
        code = np.uint64(codes[i])
        frame[code >> ONE] = 1 if code & ONE else -1
