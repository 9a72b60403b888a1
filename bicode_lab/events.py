"""The type of events, and what every stage does with them: make, check, slice, merge, cut into windows.

An event says that pixel (x, y) became brighter (p = 1) or darker (p = 0) at time t.
Events are kept in one structured array, sorted by time:

    field   type   meaning                         range
    x       u2     column, from the left [px]      0 .. width - 1
    y       u2     row, from the top [px]          0 .. height - 1
    p       i2     polarity                        0 (OFF, darker), 1 (ON, brighter)
    t       i8     time [us]                       never decreases from one event to the next

The layout is byte for byte that of Metavision's ``EventCD``. The paper writes the polarity as +1 and -1 (II-A); only
`polarity_sign` makes these values.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

EVENT_DTYPE = np.dtype([("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<i8")], align=True)

Events = npt.NDArray[np.void]
"""A one-dimensional array of `EVENT_DTYPE`, sorted by ``t``."""


def make_events(x: npt.ArrayLike, y: npt.ArrayLike, p: npt.ArrayLike, t_us: npt.ArrayLike) -> Events:
    """Make an event array from its columns, sorted by time.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Pixel column and row [px], 0 .. 65535.
    p : array_like, shape (n,)
        Polarity, 0 or 1.
    t_us : array_like, shape (n,)
        Time [us]; events of equal time keep their order.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)

    Raises
    ------
    ValueError
        If the columns differ in length, a polarity is neither 0 nor 1, or a coordinate is not in 0 .. 65535.

    Examples
    --------
    >>> make_events(x=[5, 6], y=[1, 1], p=[1, 0], t_us=[20, 10])["t"]
    array([10, 20])
    """
    columns = [np.atleast_1d(np.asarray(column)) for column in (x, y, p, t_us)]
    lengths = [column.size for column in columns]
    if len(set(lengths)) > 1:
        raise ValueError(f"columns x, y, p, t have {lengths} entries; give one of each per event")
    if lengths[0] and not np.isin(columns[2], (0, 1)).all():
        worst = columns[2][~np.isin(columns[2], (0, 1))][0]
        raise ValueError(f"polarity {worst} is neither 0 nor 1; store OFF as 0 and ON as 1")
    for name, column in zip("xy", columns, strict=False):
        if lengths[0] and not 0 <= column.min() <= column.max() <= 65535:
            raise ValueError(f"{name} runs from {column.min()} to {column.max()}; pixels are numbered 0 .. 65535")
    events = np.zeros(lengths[0], EVENT_DTYPE)
    for name, column in zip(("x", "y", "p", "t"), columns, strict=True):
        events[name] = column
    times = events["t"]
    if times.size > 1 and (times[1:] < times[:-1]).any():
        events = events[np.argsort(times, kind="stable")]
    return events


def no_events() -> Events:
    """Return an empty event array."""
    return np.empty(0, EVENT_DTYPE)


def check_events(events: Events, width: int, height: int) -> None:
    """Check that an event array keeps the rules at the top of this file.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    width, height : int
        Sensor size [px].

    Raises
    ------
    ValueError
        If the type is wrong, time runs backwards, a polarity is neither 0 nor 1, or a coordinate is outside the sensor.
        The message tells how many events break the rule, and which is the first.
    """
    if events.dtype != EVENT_DTYPE:
        raise ValueError(f"events have type {events.dtype}; make them with make_events(x, y, p, t_us)")
    if events.size == 0:
        return
    rules = (
        (events["x"] >= width, f"x outside the {width} px wide sensor"),
        (events["y"] >= height, f"y outside the {height} px high sensor"),
        ((events["p"] != 0) & (events["p"] != 1), "a polarity that is neither 0 nor 1"),
        (np.diff(events["t"], prepend=events["t"][0]) < 0, "a time before the event ahead of it"),
    )
    for broken, what in rules:
        count = int(np.count_nonzero(broken))
        if count:
            first = int(np.argmax(broken))
            raise ValueError(
                f"{count} of {events.size} events have {what}; the first is number {first}: {events[first]}"
            )


def slice_time(events: Events, start_us: int, end_us: int) -> Events:
    """Return a view of the events with ``start_us <= t < end_us``.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    start_us, end_us : int
        Times [us].

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (m,)

    Examples
    --------
    >>> e = make_events([0, 0, 0], [0, 0, 0], [1, 0, 1], [10, 20, 30])
    >>> slice_time(e, 10, 30)["t"]
    array([10, 20])
    """
    times = events["t"]  # bisect reads a few of them; numpy's searchsorted would copy all of them first
    return events[bisect_left(times, start_us) : bisect_left(times, end_us)]


def polarity_sign(events: Events) -> npt.NDArray[np.int8]:
    """Return the polarity as the paper writes it: +1 for ON, -1 for OFF (II-A).

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)

    Returns
    -------
    ndarray of int8, shape (n,)

    Examples
    --------
    >>> polarity_sign(make_events([0, 0], [0, 0], [1, 0], [1, 2]))
    array([ 1, -1], dtype=int8)
    """
    return np.where(events["p"] > 0, np.int8(1), np.int8(-1))


def merge(*streams: Events) -> Events:
    """Merge event arrays into one that is sorted by time.

    Parameters
    ----------
    *streams : ndarray of EVENT_DTYPE, shape (n,)
        Of events with equal times, those of the first array come first.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (m,)
    """
    together = join(streams)
    return words(together)[np.argsort(together["t"], kind="stable")].view(EVENT_DTYPE).ravel()


def join(chunks: Iterable[Events]) -> Events:
    """Join the chunks of a stream into one array.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        In the order of time.

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
    """
    return np.concatenate([words(no_events()), *(words(chunk) for chunk in chunks)]).view(EVENT_DTYPE).ravel()


def windows(
    chunks: Iterable[Events] | Events, length_us: int, *, t0_us: int | None = None, max_events: int | None = None
) -> Iterator[tuple[int, Events]]:
    """Cut a stream of events into windows of equal length; windows without events are left out.

    Window k spans ``[t0_us + k * length_us, t0_us + (k + 1) * length_us)``. No more than one window and one chunk
    are held in memory, and a quiet gap costs no time, however long it is.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE, or one such array
        Each chunk begins no earlier than the one before it ends; chunks may have any length.
    length_us : int
        Length of a window [us], 1 or more.
    t0_us : int, optional
        Start of window 0 [us]; earlier events are left out. None takes the time of the first event.
    max_events : int, optional
        A window with more events comes in several parts with the same start. None never divides a window.

    Yields
    ------
    start_us : int
        Start of the window [us].
    events : ndarray of EVENT_DTYPE, shape (n,)
        Its events, n >= 1; a view of the chunk where the window lies inside one chunk.

    Raises
    ------
    ValueError
        If `length_us` is below 1, or a chunk begins before the previous one ends.

    Examples
    --------
    >>> stream = make_events([0, 0, 0], [0, 0, 0], [1, 0, 1], [10, 25, 95])
    >>> [(start_us, events["t"].tolist()) for start_us, events in windows(stream, 20)]
    [(10, [10, 25]), (90, [95])]
    """
    if length_us < 1:
        raise ValueError(f"length_us={length_us} is shorter than one microsecond; choose 1 or more")
    held: list[Events] = []
    n_held, start_us, last_us = 0, t0_us, None
    for chunk in [chunks] if isinstance(chunks, np.ndarray) else chunks:
        if not chunk.size:
            continue
        first_us = int(chunk["t"][0])
        if last_us is not None and first_us < last_us:
            raise ValueError(f"time runs backwards: {first_us} us follows {last_us} us; sort the events")
        last_us = int(chunk["t"][-1])
        if start_us is None:
            start_us = first_us
        rest = chunk if first_us >= start_us or held else chunk[bisect_left(chunk["t"], start_us) :]
        while rest.size:
            here_us = int(rest["t"][0])
            if held and (here_us >= start_us + length_us or n_held == max_events):
                yield start_us, _together(held)
                held, n_held = [], 0
            if here_us >= start_us + length_us:
                start_us += (here_us - start_us) // length_us * length_us
            end = bisect_left(rest["t"], start_us + length_us)  # np.searchsorted would copy the whole column
            if max_events is not None:
                end = min(end, max_events - n_held)
            held.append(rest[:end])
            n_held += end
            rest = rest[end:]
    if held and start_us is not None:
        yield start_us, _together(held)


def _together(parts: list[Events]) -> Events:
    """Join the parts of a window; a single part is not copied."""
    return parts[0] if len(parts) == 1 else join(parts)


def copy_events(events: Events) -> Events:
    """Return a copy of events that may be changed."""
    return words(events).copy().view(EVENT_DTYPE).ravel()


def words(events: Events) -> npt.NDArray[np.int64]:
    """View each event as two 64-bit words, which numpy copies ten times faster than records.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)

    Returns
    -------
    ndarray of int64, shape (n, 2)
        x + 2^16 y + 2^32 p, and t; the same memory if it is contiguous.
    """
    return np.ascontiguousarray(events).view(np.int64).reshape(-1, 2)
