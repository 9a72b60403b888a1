"""Say in words whether a recording is sound for reading a marker, and what to change on the camera.

What a bias does is told by its effect, since its numbers differ between sensors; the names are those of the
documentation of the Metavision SDK: bias_diff_on and bias_diff_off (thresholds), bias_fo (bandwidth), bias_hpf
(high-pass), bias_refr (refractory period).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bicode_lab.boxes import Box
from bicode_lab.events import Events, join
from bicode_lab.lights.name import name_region
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.inspect.edges import Edges, measure_edges
from bicode_studies.inspect.light import blinking_boxes, events_inside
from bicode_studies.inspect.lights import light_in_words
from bicode_studies.inspect.measures import FREQUENCIES_HZ, Measures, measure
from bicode_studies.inspect.time_unit import remark_on_times

State = Literal["ok", "look", "bad"]
MAINS_HZ = {100: "50 Hz mains", 120: "60 Hz mains"}
SWING = 0.2  # of the mean rate, by which a lamp makes it swing
OUT_OF_NOISE = 6.0
WIDE = 0.38  # of a bit, of which half is the time to the next edge
LEAST_S = 0.2  # to tell 100 Hz from its neighbours
UNBALANCED = 3.0
BUSY_PER_S = 20e6
LONG_GAP_US = 1_000_000
HOT_SHARE = 0.1
NO_LIGHT = "bring the marker nearer, make it brighter, or raise the bandwidth (bias_fo)"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One finding of an examination.

    Parameters
    ----------
    name : str
        What was looked at.
    state : {"ok", "look", "bad"}
        Whether it is sound, worth a look, or keeps markers from being read.
    words : str
        What was found.
    advice : str
        What to change; empty where nothing has to.
    """

    name: str
    state: State
    words: str
    advice: str = ""

    def line(self) -> str:
        """Return the finding as a line of text."""
        return f"{self.state:4}  {self.name}: {self.words}" + (f"; {self.advice}" if self.advice else "")


def examine(
    chunks: Iterable[Events], width: int, height: int, dropped: Mapping[str, int] | None = None
) -> tuple[Finding, ...]:
    """Examine a recording.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        The events in the order of time, such as a `Recording`.
    width, height : int
        Sensor size [px].
    dropped : mapping of str to int, optional
        `Recording.dropped`: events that a lenient reading leaves out. It is read after the last chunk.

    Returns
    -------
    tuple of Finding

    Examples
    --------
    >>> from bicode_lab.events import no_events
    >>> print(examine([no_events()], 640, 480)[0].line())
    bad   events: there are none; take the lens cap off, and look whether the camera was recording
    """
    m = measure(chunks, width, height)
    if not m.n_events:
        none = "take the lens cap off, and look whether the camera was recording"
        return (Finding(name="events", state="bad", words="there are none", advice=none), *_dropped(dropped or {}))
    lights = _lights(m)
    return (
        _times(m),
        *_dropped(dropped or {}),
        _rate(m),
        _balance(m),
        _hot(m),
        _rows(m),
        _holes(m, lights),
        _flicker(m),
        _blinking(lights),
        *_names(m, lights),
    )


def _times(m: Measures) -> Finding:
    """Judge the unit and the steps of the times, and long gaps."""
    remark = remark_on_times(m.n_events, m.span_us, m.step_us)
    words = f"{m.n_events:,} events in {m.span_us * 1e-6:,.3f} s"
    if remark:
        return Finding(name="times", state="bad", words=remark)
    longest = m.longest_gap
    if longest[1] >= LONG_GAP_US:
        where = f"{words}, but none for {longest[1] * 1e-6:.1f} s from {(longest[0] - m.first_us) * 1e-6:.3f} s on"
        advice = "a part is missing, or times jump: record again, or cut the recording there"
        return Finding(name="times", state="look", words=where, advice=advice)
    if m.step_us > 100:
        coarse = f"{words}, with times in steps of {m.step_us} us"
        advice = "a half bit at 1 kHz lasts 500 us: record with the camera's own times of 1 us"
        return Finding(name="times", state="look", words=coarse, advice=advice)
    return Finding(name="times", state="ok", words=words)


def _dropped(dropped: Mapping[str, int]) -> list[Finding]:
    """Say what a lenient reading left out."""
    if not dropped:
        return []
    words = ", ".join(f"{count:,} {cause}" for cause, count in dropped.items())
    advice = "the file is damaged or was cut: copy or export it again, or read the rest with --lenient"
    return [Finding(name="file", state="bad", words=f"not readable: {words}", advice=advice)]


def _rate(m: Measures) -> Finding:
    """Judge the rate over time."""
    total = m.on + m.off
    mean, most = m.n_events / m.seconds, int(total.max()) * 1e3
    words = f"{_mega(mean)} events/s on average, {_mega(most)} in the busiest millisecond ({_course(total)})"
    near_top = float(np.mean(total >= 0.97 * total.max()))
    if most >= BUSY_PER_S and near_top > 0.1:
        advice = (
            "the readout is at its limit and loses events: crop to the marker (ROI), shade or darken the scene, make "
            "the thresholds less sensitive (bias_diff_on, bias_diff_off), or switch on the event rate control"
        )
        return Finding(name="rate", state="bad", words=f"{words}, and {near_top:.0%} of them as busy", advice=advice)
    return Finding(name="rate", state="ok", words=words)


def _course(total: np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    """Return the mean rate of up to four equal parts."""
    n = min(4, total.size)
    rates = [_mega(float(part.mean()) * 1e3) for part in np.array_split(total, n)]
    return f"parts of equal length: {', '.join(rates)}"


def _mega(rate: float) -> str:
    """Return a rate with three digits and a unit."""
    return f"{rate / 1e6:.3g} million" if rate >= 1e5 else f"{rate:,.0f}"


def _balance(m: Measures) -> Finding:
    """Judge the shares of ON and OFF."""
    n_off = m.n_events - m.n_on
    words = f"{m.n_on:,} ON and {n_off:,} OFF events"
    if not m.n_on or not n_off:
        advice = "a receiver needs both: check the polarity in the file, and the thresholds of the camera"
        return Finding(name="balance", state="bad", words=words, advice=advice)
    ratio = max(m.n_on, n_off) / min(m.n_on, n_off)
    if ratio < UNBALANCED:
        return Finding(name="balance", state="ok", words=words)
    more, bias = ("ON", "bias_diff_on") if m.n_on > n_off else ("OFF", "bias_diff_off")
    advice = f"make the {more} threshold less sensitive ({bias}), or the other one more"
    return Finding(name="balance", state="look", words=f"{words}, {ratio:.1f} to 1", advice=advice)


def _hot(m: Measures) -> Finding:
    """Judge hot pixels."""
    hot = m.hot_pixels()
    if not len(hot):
        return Finding(name="hot pixels", state="ok", words="none")
    share = int(m.per_pixel[hot[:, 1], hot[:, 0]].sum()) / m.n_events
    x, y = hot[0]
    rate = int(m.per_pixel[y, x]) / m.seconds
    words = f"{len(hot):,} with {share:.1%} of the events, the busiest at ({x}, {y}) with {rate:,.0f} events/s"
    if share < HOT_SHARE:
        return Finding(name="hot pixels", state="ok", words=words)
    advice = "mask them in the camera, let it cool, or make the thresholds less sensitive"
    return Finding(name="hot pixels", state="look", words=words, advice=advice)


def _rows(m: Measures) -> Finding:
    """Judge rows with too many events."""
    rows = m.busy_rows()
    if not rows.size:
        return Finding(name="rows", state="ok", words="no row stands out")
    listed = ", ".join(map(str, rows[:5])) + (f" and {rows.size - 5} more" if rows.size > 5 else "")
    advice = "the readout adds events to whole rows: lower the rate (ROI, less light, less sensitive thresholds)"
    return Finding(name="rows", state="look", words=f"far more events than around in row {listed}", advice=advice)


def _holes(m: Measures, lights: list[tuple[Box, Edges | None]]) -> Finding:
    """Judge gaps in the middle of busy time; if most events are those of a light, it makes the gaps."""
    of_light = sum(int(m.per_pixel[b.y : b.bottom, b.x : b.right].sum()) for b, edges in lights if edges is not None)
    holes = m.holes_in_busy_time()
    quiet_us = sum(length for _, length in holes)
    if len(holes) <= 2 or of_light > 0.5 * m.n_events:
        return Finding(name="holes", state="ok", words="no gaps in busy time")
    start_us, length_us = max(holes, key=lambda hole: hole[1])
    words = (
        f"{len(holes):,} gaps in busy time, {quiet_us / 1e3:.1f} ms in all, the longest of {length_us / 1e3:.2f} ms at "
        f"{(start_us - m.first_us) * 1e-6:.3f} s"
    )
    advice = "the link or the computer dropped events: lower the rate, use a faster port, or record to a faster disk"
    return Finding(name="holes", state="bad", words=words, advice=advice)


def _lights(m: Measures) -> list[tuple[Box, Edges | None]]:
    """Return the regions that blink in the first seconds, each with the edges of its light, if it is one."""
    events = join(m.begin)
    boxes = blinking_boxes(events, ReceiverSettings(width=m.width, height=m.height))
    return [(box, measure_edges(events, box)) for box in boxes]


def _names(m: Measures, lights: list[tuple[Box, Edges | None]]) -> list[Finding]:
    """Say of each region that blinks what light it is, and what would read it."""
    events = join(m.begin)
    found = []
    for box, _ in lights:
        words = light_in_words(name_region(events_inside(events, box)))
        where = f"{box.w} x {box.h} px at ({box.x}, {box.y})"
        found.append(Finding(name="light", state="ok", words=f"{where}: {words}"))
    return found


def _flicker(m: Measures) -> Finding:
    """Judge the flicker of lamps."""
    if m.seconds < LEAST_S:
        return Finding(name="flicker", state="ok", words=f"not judged: {m.seconds:.2f} s are too short for it")
    strength = m.spectrum()
    noise = float(np.median(strength))
    found = []
    for hz, mains in MAINS_HZ.items():
        near = np.abs(FREQUENCIES_HZ - hz) <= max(1.0, 0.5 / m.seconds)
        beside = (np.abs(FREQUENCIES_HZ - hz) > 4 / m.seconds + 2) & (np.abs(FREQUENCIES_HZ - hz) < 25)
        top = float(strength[near].max())
        if top > SWING and top > OUT_OF_NOISE * noise and top > 1.5 * float(strength[beside].max(initial=0.0)):
            found.append(f"{hz} Hz ({mains}), by {top:.0%} of the mean rate")
    if not found:
        return Finding(name="flicker", state="ok", words="none of 100 or 120 Hz")
    advice = (
        "a lamp flickers: use daylight or a lamp with a steady current, keep lamps out of view, or use the camera's "
        "filter against flicker, which must leave 500 Hz to 2 kHz alone"
    )
    return Finding(name="flicker", state="look", words=f"the rate swings at {' and '.join(found)}", advice=advice)


def _blinking(lights: list[tuple[Box, Edges | None]]) -> Finding:
    """Judge whether the pixels are fast and sensitive enough for a light that blinks at 1 kHz."""
    if not lights:
        words = "nothing blinks in the first seconds, so the biases cannot be judged"
        return Finding(name="blinking", state="look", words=words, advice="record with the marker in view, near enough")
    box, edges = next((each for each in lights if each[1] is not None), lights[0])
    if edges is None:
        count = f"{len(lights)} regions blink, and none of them" if len(lights) > 1 else "1 region blinks, but it never"
        words = f"{count} switches as a whole, as a light does"
        return Finding(name="blinking", state="look", words=words, advice=NO_LIGHT)
    words = (
        f"the busiest light ({box.w} x {box.h} px at ({box.x}, {box.y})) rises about every "
        f"{edges.bit_us:.0f} us; 80 % of the events of an edge come within {edges.on_width_us:.0f} us (ON) and "
        f"{edges.off_width_us:.0f} us (OFF), {edges.per_pixel:.1f} for each pixel"
    )
    if edges.bit_us > 4_000:
        advice = "that is no marker at 1 kHz, but a slow light"
        return Finding(name="blinking", state="look", words=words, advice=advice)
    slow = [name for name, us in (("ON", edges.on_width_us), ("OFF", edges.off_width_us)) if us > WIDE * edges.bit_us]
    if slow:
        advice = (
            f"{' and '.join(slow)} edges are too wide for half a bit: raise the bandwidth (bias_fo), open the "
            "aperture, or choose a lower bit rate"
        )
        return Finding(name="blinking", state="bad", words=words, advice=advice)
    if edges.per_pixel < 0.5:
        advice = "few pixels answer: make the thresholds more sensitive (bias_diff_on, bias_diff_off), or come nearer"
        return Finding(name="blinking", state="look", words=words, advice=advice)
    if edges.per_pixel > 5:
        advice = "many events for each edge fill the readout: make the thresholds less sensitive, or lengthen bias_refr"
        return Finding(name="blinking", state="look", words=words, advice=advice)
    return Finding(name="blinking", state="ok", words=words, advice="")
