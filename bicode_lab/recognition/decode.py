"""Fig. 2 g, second half: what does the LED say?   ON and OFF counts -> edges -> chips -> packets

"This process begins with the 3 ms consecutive turning off of the LED" (III-B). The steps:

1. Edges: the LED state of `led_state` turns. An edge is known to a bin of delta_t_ID; where
   its events spill into the next bin, the centre of mass says more.
2. Start: an off run longer than data can hold. Data hold runs of two chips at most, the start
   is 2 start_bits chips and one or two more where its neighbours are off: the line is drawn
   in the middle. The ON edge that ends it is the first of the data: chip 0 or chip 1.
3. Clock: the grid of chips that fits the packet's edges best, over a range of chip lengths and
   phases. ON and OFF edges have a phase each, because a pixel's latency differs between them,
   and a transmitter's clock may be some percent off.
4. Chips -> Manchester -> checksum, for both places of the first ON edge that the off run
   allows. Chips that hold under both, with two payloads that pass, are a `conflict`.

A packet fails with a reason; of several, the one of the step that was got furthest:

    no_events   nothing switched
    no_start    edges, but no off run of the start's length ends in an ON edge
    cut         the data end behind the span looked at, or the start begins ahead of it
    manchester  the chips make no whole packet: a bit without its switch, or no quiet behind it
    checksum    all bits read, but the checksum is another
    conflict    two readings pass that differ (in one packet, or two packets in one period)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.marker.manchester import Convention, manchester_decode
from bicode_lab.marker.packet import PacketFormat, decode_data_bits
from bicode_lab.recognition.led_state import edge_gates

Reason = Literal["no_events", "no_start", "cut", "manchester", "checksum", "conflict"]
REASONS: tuple[Reason, ...] = ("no_events", "no_start", "cut", "manchester", "checksum", "conflict")
"""Why there is no ID; each outranks those ahead of it."""

CLOCK_STEPS = 12  # chip lengths tried on either side of the nominal one
CLOCK_STEP = 0.005  # relative; 22 chips drift by a tenth of one: less than a bin
UNSEEN_BINS = 1.5  # an edge this near the end of the data may not show yet
RUN_SLACK_CHIPS = 1.25  # how much shorter the off run may look: a bin, an OFF edge's tail, 6 % of clock
PHASES = 40  # places of the grid tried within a chip
MISFIT_CHIPS = 0.2  # latency differs from edge to edge by about this much at 1 kHz
NEARNESS = 0.3  # of two grids that fit, the one whose lines are nearer, and
CLOCK_DOUBT = 3.0  # the one whose clock is less off: 0.03 points per percent
OFF_LATER_CHIPS = 0.1  # OFF edges are seen this much later than ON edges, +- half a chip


@dataclass(frozen=True)
class Packet:
    """One packet as it was read.

    Parameters
    ----------
    start_us : int
        First moment of its off time [us], the recording's own clock.
    end_us : int
        The moment behind its last chip [us].
    payload : int or None
        What was read; None where the chips are no bits.
    checksum_ok : bool
    reason : str or None
        None, or one of `REASONS`.
    manchester : str or None
        Convention it was read with.
    edge_us : int
        Its first ON edge as seen [us].
    """

    start_us: int
    end_us: int
    payload: int | None
    checksum_ok: bool
    reason: Reason | None
    manchester: Convention | None
    edge_us: int


class _Reading(NamedTuple):
    """What a packet says if its first ON edge is chip number `place` of the data."""

    place: int
    whole: bool
    payload: int | None
    convention: Convention | None
    holds: bool


def decode_packets(
    n_on: npt.ArrayLike,
    n_off: npt.ArrayLike,
    start_us: int,
    delta_t_id_us: int,
    packet_format: PacketFormat,
    *,
    conventions: Sequence[Convention] | None = None,
    gate: float = 0.2,
    latency_us: float = 0.0,
) -> tuple[list[Packet], Reason | None]:
    """ON and OFF counts of one region in, its packets and the reason where there is none out.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts per bin (Fig. 6).
    start_us : int
        Start of the first bin [us].
    delta_t_id_us : int
        Length of a bin [us].
    packet_format : PacketFormat
    conventions : sequence of {"ieee", "thomas"}, optional
        Those to try; None takes the format's.
    gate : float
        See `led_state.edge_gates`; 0 is the paper's plain rule.
    latency_us : float
        From a rise of the light to its ON events [us]; taken off the packets' times, and nothing else.

    Returns
    -------
    packets : list of Packet
        In the order of time; each has its own reason.
    reason : str or None
        None if there is a packet at all, else "no_events" or "no_start".

    Examples
    --------
    >>> from bicode_lab.marker import LedWaveform
    >>> edges_us, levels = LedWaveform(payload=0x25, phase_us=0).steps(0, 20_000)
    >>> bins = np.bincount((edges_us[levels > 0] / 250).astype(int), minlength=80)
    >>> off_bins = np.bincount((edges_us[levels == 0] / 250).astype(int), minlength=80)
    >>> packets, reason = decode_packets(bins, off_bins, 0, 250, PacketFormat())
    >>> packets[0].payload, packets[0].checksum_ok, packets[1].reason
    (37, True, 'cut')
    """
    lead = np.asarray(n_on, np.int64) - np.asarray(n_off, np.int64)
    gate_on, gate_off = edge_gates(n_on, n_off, gate)
    times, rises = _find_edges(lead, gate_on, gate_off)
    if not times.size:
        return [], "no_events"
    f = packet_format
    chip_bins = f.chip_us / delta_t_id_us
    starts = _find_starts(times, rises, (f.start_bits + 1) * chip_bins)
    late_us = round(latency_us)
    packets = [
        _read_packet(
            times, rises, int(i), lead.size, start_us, late_us, delta_t_id_us, f, conventions or (f.manchester,)
        )
        for i in starts
    ]
    return packets, None if packets else "no_start"


def _read_packet(
    times: npt.NDArray[np.float64],
    rises: npt.NDArray[np.bool_],
    first: int,
    n_bins: int,
    start_us: int,
    late_us: int,
    delta_t_id_us: int,
    f: PacketFormat,
    conventions: Sequence[Convention],
) -> Packet:
    """The edges and the number of a packet's first ON edge in, the packet out."""
    n_start, n_data = 2 * f.start_bits, 2 * f.data_bits
    nominal = f.chip_us / delta_t_id_us
    chips, chip, phase = _read_chips(times, rises, first, n_data + f.start_bits, nominal)
    run_chips = (times[first] - times[first - 1]) / nominal if first else np.inf

    def as_packet(reading: _Reading, reason: Reason | None) -> Packet:
        begin, end = span(reading.place)
        moments = (start_us + round(float(moment * delta_t_id_us)) for moment in (begin, end, times[first]))
        begin_us, end_us, edge_us = moments
        return Packet(
            begin_us - late_us, end_us - late_us, reading.payload, reason is None, reason, reading.convention, edge_us
        )

    def span(place: int) -> tuple[float, float]:
        begin = times[first] + phase - (n_start + place) * chip
        return begin, begin + (n_start + n_data) * chip

    readings: list[_Reading] = []
    reason: Reason = "manchester"
    for place in (0, 1):
        begin, end = span(place)
        whole = begin >= -0.5 and end <= n_bins + 0.5
        if not whole:
            reason = "cut"
        if run_chips < n_start + place - RUN_SLACK_CHIPS:
            continue
        shifted = np.concatenate([np.zeros(place, np.uint8), chips])
        bits, switched = manchester_decode(shifted[:n_data], "ieee")
        n_seen = int((n_bins - UNSEEN_BINS - times[first] - phase) / chip) + place  # the last edge may be yet to come
        if not switched.all() or shifted[n_data : min(n_data + f.start_bits, n_seen)].any():
            continue
        for convention in conventions:
            payload, holds = decode_data_bits(bits if convention == "ieee" else 1 - bits, f)
            readings.append(_Reading(place, whole, payload, convention, holds))
    good = [reading for reading in readings if reading.holds]
    if any(reading.whole for reading in good):
        conflict = len({reading.payload for reading in good}) > 1
        return as_packet(next(reading for reading in good if reading.whole), "conflict" if conflict else None)
    readings = [reading for reading in readings if reading.whole and not good]
    return as_packet(readings[0], "checksum") if readings else as_packet(_Reading(0, False, None, None, False), reason)


@njit(cache=True)
def _find_edges(lead, gate_on, gate_off):  # type: ignore[no-untyped-def]
    """Lead of ON over OFF per bin in; times of the state's turns [bins] and whether they rise out."""
    times = np.empty(lead.size)
    rises = np.empty(lead.size, np.bool_)
    n = 0
    state = -1
    for b in range(lead.size):
        says = 1 if lead[b] > gate_on else (0 if lead[b] < -gate_off else -1)
        if says < 0 or says == state:
            continue
        sign = 1 if says else -1
        mass = 0.0
        moment = 0.0
        for k in range(max(b - 1, 0), min(b + 2, lead.size)):
            weight = max(sign * lead[k], 0)
            mass += weight
            moment += weight * (k + 0.5)
        times[n] = moment / mass
        rises[n] = says == 1
        state = says
        n += 1
    return times[:n], rises[:n]


@njit(cache=True)
def _find_starts(times, rises, least_run):  # type: ignore[no-untyped-def]
    """Edges in; numbers of the ON edges that end an off run of `least_run` bins or more out."""
    starts = np.empty(times.size, np.int64)
    n = 0
    for i in range(times.size):
        before = times[i - 1] if i else 0.0
        if rises[i] and times[i] - before >= least_run:
            starts[n] = i
            n += 1
    return starts[:n]


@njit(cache=True)
def _fit_clock(times, rises, first, last, nominal):  # type: ignore[no-untyped-def]
    """Edges of one packet in; chip length [bins], phase of ON and of OFF edges [chips] that fit them best out.

    An edge lies anywhere in its bin: it fits a grid line no farther than half a bin, and each
    MISFIT_CHIPS more take a point off, up to one, so that a stray edge costs no more than that.
    """
    half_bin = 0.5 / nominal
    best = -1e9
    best_chip, best_on, best_off = nominal, 0.0, 0.0
    scores = np.empty((2, PHASES))
    for step in range(-CLOCK_STEPS, CLOCK_STEPS + 1):
        chip = nominal * (1 + step * CLOCK_STEP)
        scores[:] = 0.0
        for i in range(first, last):
            place = (times[i] - times[first]) / chip
            row = 1 if rises[i] else 0
            for k in range(PHASES):
                away = place - k / PHASES
                away = abs(away - np.floor(away + 0.5))
                misfit = max(away - half_bin, 0.0) / MISFIT_CHIPS
                scores[row, k] -= min(misfit, 1.0) + NEARNESS * away * away
        k_on, k_off = np.argmax(scores[1]), np.argmax(scores[0])
        score = scores[1, k_on] + scores[0, k_off] - CLOCK_DOUBT * abs(step) * CLOCK_STEP
        if score > best:
            best = score
            best_chip, best_on, best_off = chip, k_on / PHASES, k_off / PHASES
    best_on -= np.floor(best_on + 0.5)
    later = best_off - best_on - OFF_LATER_CHIPS
    return best_chip, best_on, best_on + OFF_LATER_CHIPS + later - np.floor(later + 0.5)


@njit(cache=True)
def _read_chips(times, rises, first, n_chips, nominal):  # type: ignore[no-untyped-def]
    """Edges in; the chips from the first ON edge on, the chip's length and the grid's phase at that edge [bins] out."""
    last = first
    while last < times.size and times[last] - times[first] < (n_chips - 0.5) * nominal:
        last += 1
    chip, on_phase, off_phase = _fit_clock(times, rises, first, last, nominal)
    chips = np.zeros(n_chips, np.uint8)
    for i in range(first, last):
        place = int(np.round((times[i] - times[first]) / chip - (on_phase if rises[i] else off_phase)))
        for k in range(max(place, 0), n_chips):
            chips[k] = 1 if rises[i] else 0
    return chips, chip, on_phase * chip
