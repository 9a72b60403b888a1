"""Rows of lights that are no markers: one for each region and each 50 ms, of the interval code or of a frequency."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from bicode_lab.events import Events, slice_time
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.lights.readers import LightReading, read_frequency, read_interval, stretches
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.inspect.light import blinking_boxes, events_inside

WIDTHS = {"t_us": 12, "x": 5, "y": 5, "w": 4, "h": 4, "value": 5, "rate_hz": 10, "margin": 8, "reason": 14}
SECOND_US = 1_000_000


def reader_of(line_code: str, rate_hz: float | None) -> Callable[[Events], LightReading]:
    """Return what reads one stretch of a light.

    Parameters
    ----------
    line_code : str
        "interval" or "frequency".
    rate_hz : float, optional
        Base periods per second of the interval code; None finds it.

    Returns
    -------
    callable

    Raises
    ------
    ValueError
        If a rate is given for lights whose frequency is to be found, or is impossible.
    """
    if line_code == "frequency":
        if rate_hz is not None:
            raise ValueError("--rate-hz is what --line-code frequency finds; leave it out")
        return read_frequency
    line = IntervalLine(rate_hz=rate_hz) if rate_hz is not None else None
    return lambda events: read_interval(events, line)


def light_rows(
    events: Events, read: Callable[[Events], LightReading], width: int, height: int
) -> Iterator[dict[str, Any]]:
    """Yield a row for each region that blinks and each 50 ms; regions are looked for in each second.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Those of a recording, in the order of time.
    read : callable
        See `reader_of`.
    width, height : int
        Sensor size [px].

    Yields
    ------
    dict
        Values by the names of `WIDTHS`.
    """
    if not events.size:
        return
    settings = ReceiverSettings(width=width, height=height)
    first, last = int(events["t"][0]), int(events["t"][-1])
    for begin in range(first, last + 1, SECOND_US):
        part = slice_time(events, begin, begin + SECOND_US)
        boxes = blinking_boxes(part, settings) if part.size else []
        for box in boxes:
            for stretch in stretches(events_inside(part, box)):
                one = read(stretch)
                yield {
                    "t_us": one.t_us, "x": box.x, "y": box.y, "w": box.w, "h": box.h,
                    "value": one.value, "rate_hz": one.rate_hz, "margin": one.margin, "reason": one.reason,
                }  # fmt: skip


def answer_of_rows(rows: list[dict[str, Any]]) -> str:
    """Return what was read, in words.

    Parameters
    ----------
    rows : list of dict
        See `light_rows`.

    Returns
    -------
    str
    """
    if not rows:
        return "nothing blinks, so no light was read"
    read = [row for row in rows if row["reason"] is None]
    regions = len({(row["x"], row["y"], row["w"], row["h"]) for row in rows})
    line = f"{len(read)} of {len(rows)} looks at {regions} {'region' if regions == 1 else 'regions'} were read"
    return line if read else f"{line}; bicode inspect says what light each of them is"
