"""Diagnose one period of a recording: which check of the receiver fails, and by how much.

The receiver states its reason in one word. Here each of its steps is repeated with its own functions, and what was
found is put beside what is required. The checks are, in order:

    events    there are events in the period           whole       a whole packet lies in the period
    region    a region blinks often enough             manchester  every data bit switches the LED
    edges     ON and OFF counts show edges of the LED  checksum    the checksum of the payload is right
    start     the LED is off as long as a start takes  one ID      all valid packets have the same ID

The first check that fails is the one to examine; the checks after it are not reached. `plots.draw_diagnosis` draws
them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
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
FRACTIONS = (0.3, 0.2, 0.1, 0.05, 0.02)  # shares of frames that are tried if no region blinks often enough
MARGIN_PX = 12  # width of the border that is shown around a region

Counts = npt.NDArray[np.int64]


class Check(NamedTuple):
    """One check of the receiver."""

    name: str
    """One of `CHECKS`."""
    passed: bool | None
    """Whether the check passed; None where it was not reached."""
    found: str
    """What was found, and what is required."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """What was found in one period.

    Parameters
    ----------
    start_us, end_us : int
        The period [us].
    box : Box or None
        The region that was read [px].
    view : Box
        The part of the sensor to show [px].
    frame : ndarray of int8, shape (height, width)
        Polarity of the last event of each pixel in the period: -1, 0 (no event) or +1.
    events : ndarray of EVENT_DTYPE, shape (m,)
        The events in the region; all events of the period where there is no region.
    n_on, n_off : ndarray of int64, shape (n,)
        ON and OFF counts of each delta_t_ID bin, as in Fig. 6.
    gates : (float, float)
        How far ON must exceed OFF, and OFF exceed ON, to count as an edge [events].
    state : ndarray of uint8, shape (n,)
        State of the LED in each bin: 0 off, 1 on.
    delta_t_id_us : int
        Length of a bin [us].
    off_run_us : float
        Longest time without light that ends with an ON edge [us].
    start_needed_us : float
        Time without light that a start takes [us].
    packets : tuple of Packet
        All packets that were tried, each with its reason.
    chips : tuple of int
        Level in the middle of each chip of the packet that passed the most checks.
    bits : tuple of (float, float, str)
        Begin and end [us] of each data bit of that packet, and "0", "1", or "x" where the LED did not switch.
    checks : tuple of Check
        All checks, in the order of `CHECKS`.
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
        """Name of the first check that failed; empty if there is an ID."""
        return next((check.name for check in self.checks if check.passed is False), "")


def diagnose_period(
    events: Events, start_us: int, settings: ReceiverSettings, *, box: Sequence[int] | None = None
) -> Diagnosis:
    """Repeat the receiver's checks on one period, and return what each of them found.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of the recording; at least those of the period.
    start_us : int
        Start of the period [us], see `Sighting.t_us`.
    settings : ReceiverSettings
        Settings of the receiver.
    box : sequence of int, optional
        Region x, y, w, h to read [px], as in a sighting; None takes the first region of the period. If there is
        none, a region that blinks less often than the settings require is shown instead.

    Returns
    -------
    Diagnosis
    """
    s = settings
    end_us = start_us + s.delta_t_whole_us
    mine = slice_time(events, start_us, end_us)
    region, words = _region(mine, start_us, s) if box is None else (None, "given by hand")
    found = box is not None or (region is not None and not words)
    place = Box(*(int(value) for value in box)) if box is not None else region
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
    diagnosis = Diagnosis(
        start_us=start_us, end_us=end_us, box=place, view=_view(place, s),
        frame=accumulate(mine, s.width, s.height, "last"), events=seen,
        n_on=n_on.astype(np.int64), n_off=n_off.astype(np.int64), gates=gates,
        state=led_state(n_on, n_off, gate_on=gates[0], gate_off=gates[1]),
        delta_t_id_us=s.delta_t_id_us, off_run_us=_longest_off_us(n_on, n_off, gates, s.delta_t_id_us),
        start_needed_us=(s.packet_format.start_bits + 1) * s.packet_format.chip_us,
        packets=tuple(packets), chips=(), bits=(), checks=(),
    )  # fmt: skip
    diagnosis = replace(diagnosis, chips=_chips(diagnosis, s.packet_format))
    diagnosis = replace(diagnosis, bits=_bits(diagnosis, s))
    made = [*_check_region(mine, seen, place, found, words), *_check_led(diagnosis, s)]
    return replace(diagnosis, checks=_in_order(made))


def _best_packet(packets: Sequence[Packet]) -> Packet | None:
    """Return a valid packet if there is one, otherwise the one that passed the most checks."""
    if not packets:
        return None
    return max(packets, key=lambda p: len(REASONS) if p.reason is None else REASONS.index(p.reason))


def _region(events: Events, start_us: int, s: ReceiverSettings) -> tuple[Box | None, str]:
    """Return the first region of the period; if none blinks often enough, one that blinks less, and a remark."""
    for share in (s.min_blink_fraction, *(f for f in FRACTIONS if f < s.min_blink_fraction)):
        regions = find_regions(events, start_us, replace(s, min_blink_fraction=share))
        if regions:
            r = regions[0]
            words = "" if share == s.min_blink_fraction else f"a region blinks in only {share:.0%} of the frames"
            return Box(r.x, r.y, r.w, r.h), words
    return None, f"no region blinks, not even in {FRACTIONS[-1]:.0%} of the frames"


def _check_region(mine: Events, seen: Events, box: Box | None, found: bool, words: str) -> list[Check]:
    """Return the first two checks."""
    where = f"{box.w} x {box.h} px at ({box.x}, {box.y})" if box else "none"
    region = f"{where}, with {seen.size} events" if found else words + (f"; {where}" if box else "")
    return [
        Check("events", mine.size > 0, f"{mine.size} on the whole sensor"),
        Check("region", found, region),
    ]


def _check_led(diagnosis: Diagnosis, s: ReceiverSettings) -> list[Check]:
    """Return the checks of box g in Fig. 2, one after the other."""
    f = s.packet_format
    n_edges = int(np.count_nonzero(np.diff(diagnosis.state)))
    best = _best_packet(diagnosis.packets)
    checks = [
        Check("edges", n_edges > 0, f"the LED switches {n_edges} times; an edge takes {diagnosis.gates[0]:.3g} more ON "
              f"or {diagnosis.gates[1]:.3g} more OFF events"),
        Check("start", best is not None, f"before a rise the LED is off for {diagnosis.off_run_us / 1e3:.2f} ms "
              f"at most; a start takes {diagnosis.start_needed_us / 1e3:.2f} ms or more"),
    ]  # fmt: skip
    if best is None:
        return checks
    cut = best.reason == "cut"
    span = f"{(best.start_us - diagnosis.start_us) / 1e3:.1f} to {(best.end_us - diagnosis.start_us) / 1e3:.1f} ms"
    whole = f"the packet would last from {span}" if cut else f"a packet lasts from {span}"
    checks.append(Check("whole", not cut, f"{whole}, the period has {s.delta_t_whole_us / 1e3:g} ms"))
    if cut:
        return checks
    text = "".join(text for _, _, text in diagnosis.bits)
    unlike = [str(k + 1) for k, bit in enumerate(text) if bit == "x"]
    which = f"bit {unlike[0]} does" if len(unlike) == 1 else f"bits {', '.join(unlike)} do"
    broken = f"{text}: {which} not switch" if unlike else "the LED is not off after it, or its phase does not fit"
    is_manchester = best.reason != "manchester"
    checks.append(Check("manchester", is_manchester, f"{f.data_bits} bits: {text}" if is_manchester else broken))
    if is_manchester:
        checks += _check_sum(diagnosis, best, f)
    return checks


def _check_sum(diagnosis: Diagnosis, best: Packet, f: PacketFormat) -> list[Check]:
    """Return the last two checks, of a packet whose bits were read."""
    payload = int(best.payload or 0)
    read = f"payload {payload:0{f.payload_bits}b} requires checksum {checksum(payload, f):0{f.checksum_bits}b}"
    ids = sorted({p.payload for p in diagnosis.packets if p.checksum_ok and p.payload is not None})
    agree = len(ids) == 1 and best.reason != "conflict"
    return [
        Check("checksum", best.checksum_ok or best.reason == "conflict", read),
        Check("one ID", agree if ids else None, f"IDs read: {', '.join(map(str, ids)) or 'none'}"),
    ]


def _in_order(made: Sequence[Check]) -> tuple[Check, ...]:
    """Return all checks in order; those after the first failure are marked as not reached."""
    by_name = {check.name: check for check in made}
    checks: list[Check] = []
    for name in CHECKS:
        reached = name in by_name and all(before.passed for before in checks)
        checks.append(by_name[name] if reached else Check(name, None, "not reached"))
    return tuple(checks)


def _inside(events: Events, box: Box | None) -> Events:
    """Return the events in a box; all events where there is no box."""
    if box is None:
        return events
    across = (events["x"] >= box.x) & (events["x"] < box.right)
    return events[across & (events["y"] >= box.y) & (events["y"] < box.bottom)]


def _view(box: Box | None, s: ReceiverSettings) -> Box:
    """Return the part of the sensor to show: a square around the region, or the whole sensor."""
    if box is None:
        return Box(0, 0, s.width, s.height)
    side = max(box.w, box.h) + 2 * MARGIN_PX
    left, top = box.x + box.w // 2 - side // 2, box.y + box.h // 2 - side // 2
    return Box(max(0, min(left, s.width - side)), max(0, min(top, s.height - side)), side, side)


def _longest_off_us(n_on: npt.ArrayLike, n_off: npt.ArrayLike, gates: tuple[float, float], bin_us: int) -> float:
    """Return the longest time from an OFF edge, or from the start, to the next ON edge [us]."""
    state = led_state(n_on, n_off, gate_on=gates[0], gate_off=gates[1])
    rises = np.flatnonzero(np.diff(state.astype(int), prepend=0) > 0)
    falls = np.concatenate([[0], np.flatnonzero(np.diff(state.astype(int), prepend=0) < 0)])
    return float(max(((r - falls[falls <= r].max()) * bin_us for r in rises), default=0.0))


def _chips(diagnosis: Diagnosis, f: PacketFormat) -> tuple[int, ...]:
    """Return the LED's state shortly before the middle of each chip of the best packet."""
    best = _best_packet(diagnosis.packets)
    if best is None:
        return ()
    chip_us = (best.end_us - best.start_us) / (2 * f.packet_bits)
    ends = best.start_us + (np.arange(2 * f.packet_bits) + 0.4) * chip_us
    bins = np.clip(((ends - diagnosis.start_us) / diagnosis.delta_t_id_us).astype(int), 0, diagnosis.state.size - 1)
    return tuple(int(level) for level in diagnosis.state[bins])


def _bits(diagnosis: Diagnosis, s: ReceiverSettings) -> tuple[tuple[float, float, str], ...]:
    """Return begin, end [us] and value of each data bit of the best packet."""
    best, f = _best_packet(diagnosis.packets), s.packet_format
    if best is None:
        return ()
    convention = best.manchester or s.conventions[0]
    bits, switched = manchester_decode(np.array(diagnosis.chips[2 * f.start_bits :], np.uint8), convention)
    bit_us = (best.end_us - best.start_us) / f.packet_bits
    first_us = best.start_us + f.start_bits * bit_us
    texts = [str(bit) if turns else "x" for bit, turns in zip(bits, np.asarray(switched, bool), strict=True)]
    return tuple((first_us + k * bit_us, first_us + (k + 1) * bit_us, text) for k, text in enumerate(texts))
