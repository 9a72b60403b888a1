"""Why is there no ID in this period?   events, settings -> every check of the receiver in order, with its numbers

The receiver gives one word, its reason. Here each step is taken again, with the receiver's own
functions, and what it found and what it asked for are put side by side:

    events -> region -> edges -> start -> whole -> manchester -> checksum -> one ID

The first check that fails is the one to look into; those behind it were not reached. Draw it all
with `plots.why.draw_why`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, slice_time
from bicode_lab.marker.manchester import manchester_decode
from bicode_lab.marker.packet import PacketFormat, checksum
from bicode_lab.recognition import (
    REASONS,
    Packet,
    ReceiverSettings,
    accumulate,
    count_on_off,
    decode_packets,
    edge_gates,
    find_regions,
    led_state,
)

CHECKS = ("events", "region", "edges", "start", "whole", "manchester", "checksum", "one ID")
FRACTIONS = (0.3, 0.2, 0.1, 0.05, 0.02)  # of the frames, tried when nothing blinks enough
MARGIN_PX = 12  # shown around a region

Box = tuple[int, int, int, int]
Counts = npt.NDArray[np.int64]


class Check(NamedTuple):
    """One check: its name, whether it passed (None: not reached), and what was found and asked for."""

    name: str
    passed: bool | None
    words: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Why:
    """One period, looked into.

    Parameters
    ----------
    start_us, end_us : int
        The period [us].
    box : (x, y, w, h) or None
        The region that was read [px].
    view : (x, y, w, h)
        The part of the sensor to show [px].
    frame : ndarray of int8, shape (height, width)
        All pixels with an event in the period, by the last one.
    events : ndarray of EVENT_DTYPE
        Those of the region; of the whole view where there is no region.
    n_on, n_off : ndarray, shape (n,)
        Counts of each delta_t_ID bin, as Fig. 6.
    gates : (float, float)
        Lead of ON, and of OFF, that counts as an edge.
    state : ndarray of uint8, shape (n,)
        LED off 0 or on 1.
    delta_t_id_us : int
    off_run_us : float
        Longest run of off that ends with an ON edge [us].
    start_needed_us : float
        What the start takes [us].
    packets : tuple of Packet
        All that were tried, each with its reason.
    chips : tuple of int
        Levels in the middle of each chip of the packet that got furthest.
    bits : tuple of (from, to, text)
        Its data bits [us], "0", "1", or "x" where the LED did not switch.
    checks : tuple of Check
    """

    start_us: int
    end_us: int
    box: Box | None
    view: Box
    frame: npt.NDArray[np.int8]
    events: Events
    n_on: Counts
    n_off: Counts
    gates: tuple[float, float]
    state: npt.NDArray[np.uint8]
    delta_t_id_us: int
    off_run_us: float
    start_needed_us: float
    packets: tuple[Packet, ...]
    chips: tuple[int, ...]
    bits: tuple[tuple[float, float, str], ...]
    checks: tuple[Check, ...]

    @property
    def failed(self) -> str:
        """Name of the first check that failed; empty where there is an ID."""
        return next((check.name for check in self.checks if check.passed is False), "")


def explain_period(
    events: Events, start_us: int, settings: ReceiverSettings, *, box: Sequence[int] | None = None
) -> Why:
    """The events of a recording and a period's start in; why it gave the ID it gave, or none, out.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        At least those of the period.
    start_us : int
        See `Sighting.t_us` [us].
    settings : ReceiverSettings
    box : (x, y, w, h), optional
        The region to read, as a sighting has it; None takes the period's first region. Where there is none,
        one that blinks less than the settings ask for is shown instead.
    """
    s = settings
    end_us = start_us + s.delta_t_whole_us
    mine = slice_time(events, start_us, end_us)
    region, words = _region(mine, start_us, s) if box is None else (None, "given by hand")
    found = box is not None or (region is not None and not words)
    place: Box | None = (int(box[0]), int(box[1]), int(box[2]), int(box[3])) if box is not None else region
    seen = _inside(mine, place)
    n_bins = -(-s.delta_t_whole_us // s.delta_t_id_us)
    n_on, n_off = count_on_off(seen, place or (0, 0, s.width, s.height), start_us, n_bins, s.delta_t_id_us, s.led_count)
    gates = edge_gates(n_on, n_off, s.led_gate)
    packets: list[Packet] = []
    if place:
        packets, _ = decode_packets(
            n_on, n_off, start_us, s.delta_t_id_us, s.packet_format,
            conventions=s.conventions, gate=s.led_gate, latency_us=0.0,
        )  # fmt: skip
    why = Why(
        start_us=start_us, end_us=end_us, box=place, view=_view(place, s),
        frame=accumulate(mine, s.width, s.height, "last"), events=seen,
        n_on=n_on.astype(np.int64), n_off=n_off.astype(np.int64), gates=gates,
        state=led_state(n_on, n_off, gate_on=gates[0], gate_off=gates[1]),
        delta_t_id_us=s.delta_t_id_us, off_run_us=_longest_off_us(n_on, n_off, gates, s.delta_t_id_us),
        start_needed_us=(s.packet_format.start_bits + 1) * s.packet_format.chip_us,
        packets=tuple(packets), chips=(), bits=(), checks=(),
    )  # fmt: skip
    why = replace(why, chips=_chips(why, s.packet_format))
    why = replace(why, bits=_bits(why, s))
    return replace(why, checks=_in_order([*_check_region(mine, seen, place, found, words), *_check_led(why, s)]))


def best_packet(packets: Sequence[Packet]) -> Packet | None:
    """Packets in; one that holds, else the one that got furthest, out."""
    if not packets:
        return None
    return max(packets, key=lambda p: len(REASONS) if p.reason is None else REASONS.index(p.reason))


def _region(events: Events, start_us: int, s: ReceiverSettings) -> tuple[Box | None, str]:
    """The first region of the period and no words, or one that blinks too little and what is missing."""
    for share in (s.min_blink_fraction, *(f for f in FRACTIONS if f < s.min_blink_fraction)):
        regions = find_regions(events, start_us, replace(s, min_blink_fraction=share))
        if regions:
            r = regions[0]
            words = "" if share == s.min_blink_fraction else f"only in {share:.0%} of the frames does anything blink"
            return (r.x, r.y, r.w, r.h), words
    return None, f"nothing blinks, not even in {FRACTIONS[-1]:.0%} of the frames"


def _check_region(mine: Events, seen: Events, box: Box | None, found: bool, words: str) -> list[Check]:
    """The first two checks."""
    where = f"{box[2]} x {box[3]} px at ({box[0]}, {box[1]})" if box else "none"
    region = f"{where}, {seen.size} events in it" if found else words + (f"; {where}" if box else "")
    return [
        Check("events", mine.size > 0, f"{mine.size} on the whole sensor"),
        Check("region", found, region),
    ]


def _check_led(why: Why, s: ReceiverSettings) -> list[Check]:
    """The checks of box g, one after the other."""
    f = s.packet_format
    n_edges = int(np.count_nonzero(np.diff(why.state)))
    best = best_packet(why.packets)
    checks = [
        Check("edges", n_edges > 0, f"{n_edges} turns of the LED; an edge is a lead of {why.gates[0]:.3g} ON or "
              f"{why.gates[1]:.3g} OFF"),
        Check("start", best is not None, f"longest off run before a rise {why.off_run_us / 1e3:.2f} ms; "
              f"a start takes {why.start_needed_us / 1e3:.2f} ms or more"),
    ]  # fmt: skip
    if best is None:
        return checks
    cut = best.reason == "cut"
    span = f"{(best.start_us - why.start_us) / 1e3:.1f} to {(best.end_us - why.start_us) / 1e3:.1f} ms"
    whole = f"it would last from {span}" if cut else f"a packet lasts from {span}"
    checks.append(Check("whole", not cut, f"{whole} of a period of {s.delta_t_whole_us / 1e3:g} ms"))
    if cut:
        return checks
    text = "".join(text for _, _, text in why.bits)
    unlike = [str(k + 1) for k, bit in enumerate(text) if bit == "x"]
    which = f"bit {unlike[0]} does" if len(unlike) == 1 else f"bits {', '.join(unlike)} do"
    broken = f"{text}: {which} not switch" if unlike else "no quiet behind it, or another phase"
    is_manchester = best.reason != "manchester"
    checks.append(Check("manchester", is_manchester, f"{f.data_bits} bits: {text}" if is_manchester else broken))
    if is_manchester:
        checks += _check_sum(why, best, f)
    return checks


def _check_sum(why: Why, best: Packet, f: PacketFormat) -> list[Check]:
    """The last two checks, of a packet that made bits."""
    payload = int(best.payload or 0)
    read = f"payload {payload:0{f.payload_bits}b} asks for {checksum(payload, f):0{f.checksum_bits}b}"
    ids = sorted({p.payload for p in why.packets if p.checksum_ok and p.payload is not None})
    agree = len(ids) == 1 and best.reason != "conflict"
    return [
        Check("checksum", best.checksum_ok or best.reason == "conflict", read),
        Check("one ID", agree if ids else None, f"read: {', '.join(map(str, ids)) or 'none'}"),
    ]


def _in_order(made: Sequence[Check]) -> tuple[Check, ...]:
    """Checks that were made in; all there are, those behind the first failure as not reached, out."""
    by_name = {check.name: check for check in made}
    checks: list[Check] = []
    for name in CHECKS:
        reached = name in by_name and all(before.passed for before in checks)
        checks.append(by_name[name] if reached else Check(name, None, "not reached"))
    return tuple(checks)


def _inside(events: Events, box: Box | None) -> Events:
    """Events and a box in; those in it out, all where there is none."""
    if box is None:
        return events
    x, y, w, h = box
    return events[(events["x"] >= x) & (events["x"] < x + w) & (events["y"] >= y) & (events["y"] < y + h)]


def _view(box: Box | None, s: ReceiverSettings) -> Box:
    """The part of the sensor to show."""
    if box is None:
        return 0, 0, s.width, s.height
    side = max(box[2], box[3]) + 2 * MARGIN_PX
    left, top = box[0] + box[2] // 2 - side // 2, box[1] + box[3] // 2 - side // 2
    return max(0, min(left, s.width - side)), max(0, min(top, s.height - side)), side, side


def _longest_off_us(n_on: npt.ArrayLike, n_off: npt.ArrayLike, gates: tuple[float, float], bin_us: int) -> float:
    """Counts in, the longest time from an OFF edge (or the start) to the next ON edge out [us]."""
    state = led_state(n_on, n_off, gate_on=gates[0], gate_off=gates[1])
    rises = np.flatnonzero(np.diff(state.astype(int), prepend=0) > 0)
    falls = np.concatenate([[0], np.flatnonzero(np.diff(state.astype(int), prepend=0) < 0)])
    return float(max(((r - falls[falls <= r].max()) * bin_us for r in rises), default=0.0))


def _chips(why: Why, f: PacketFormat) -> tuple[int, ...]:
    """The LED's level in each chip of the packet that got furthest: its state ahead of the middle of the chip."""
    best = best_packet(why.packets)
    if best is None:
        return ()
    chip_us = (best.end_us - best.start_us) / (2 * f.packet_bits)
    ends = best.start_us + (np.arange(2 * f.packet_bits) + 0.4) * chip_us
    bins = np.clip(((ends - why.start_us) / why.delta_t_id_us).astype(int), 0, why.state.size - 1)
    return tuple(int(level) for level in why.state[bins])


def _bits(why: Why, s: ReceiverSettings) -> tuple[tuple[float, float, str], ...]:
    """The data bits of the packet that got furthest: from, to [us], and what each says."""
    best, f = best_packet(why.packets), s.packet_format
    if best is None:
        return ()
    convention = best.manchester or s.conventions[0]
    bits, switched = manchester_decode(np.array(why.chips[2 * f.start_bits :], np.uint8), convention)
    bit_us = (best.end_us - best.start_us) / f.packet_bits
    first_us = best.start_us + f.start_bits * bit_us
    texts = [str(bit) if turns else "x" for bit, turns in zip(bits, np.asarray(switched, bool), strict=True)]
    return tuple((first_us + k * bit_us, first_us + (k + 1) * bit_us, text) for k, text in enumerate(texts))
