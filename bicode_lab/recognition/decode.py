"""Read packets from the ON and OFF counts of a region (Fig. 2, second half of box g).

"This process begins with the 3 ms consecutive turning off of the LED" (III-B). The steps are:

1. Edges: the state of the LED (`led_state`) changes. The time of an edge is known to within one bin (delta_t_ID); if
   its events spill into the next bin, their centre of mass gives it more exactly.
2. Start: a run in which the LED is off for longer than it can be in data. Data are off for two chips at most. The start
   lasts 2 * start_bits chips, and one or two chips more if its neighbours are off. The limit lies in the middle between
   the two. The ON edge that ends the run is the first edge of the data: that of chip 0 or of chip 1.
3. Clock: the grid of chips that fits the edges of the packet best, over a range of chip lengths and phases. ON and OFF
   edges have a phase each, because the latency of a pixel differs between them, and the clock of a transmitter may be
   wrong by some percent.
4. Chips, Manchester code, checksum: for both places of the first ON edge that the length of the off run allows. If both
   give a payload that passes the checksum, and the two payloads differ, the reason is `conflict`.

Steps 1 to 3 are in `chips`. A packet that cannot be read has a reason. If several apply, it is that of the latest step:

    no_events   nothing switches
    no_start    there are edges, but no off run as long as the start ends in an ON edge
    cut         the data end after the counts, or the start begins before them
    manchester  the chips make no whole packet: a bit without its edge, or no quiet after the data
    checksum    all bits can be read, but the checksum differs
    conflict    two readings that pass differ (in one packet, or two packets in one period)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.manchester import Convention, manchester_decode
from bicode_lab.marker.packet import PacketFormat, decode_data_bits
from bicode_lab.recognition.chips import find_edges, find_starts, read_chips
from bicode_lab.recognition.led_state import edge_gates

Reason = Literal["no_events", "no_start", "cut", "manchester", "checksum", "conflict"]
REASONS: tuple[Reason, ...] = ("no_events", "no_start", "cut", "manchester", "checksum", "conflict")
"""Why there is no ID. Of several reasons, the one that is listed last is given."""

UNSEEN_BINS = 1.5  # an edge this near the end of the counts may not show yet
RUN_SLACK_CHIPS = 1.25  # how much shorter the off run may look: a bin, the tail of an OFF edge, 6 % of the clock


@dataclass(frozen=True)
class Packet:
    """One packet as it was read.

    Parameters
    ----------
    start_us : int
        Start of its off time, in the time of the recording [us].
    end_us : int
        End of its last chip [us].
    payload : int or None
        Payload that was read; None if the chips are no bits.
    checksum_ok : bool
        Whether the checksum holds and no other payload passes it, too.
    reason : str or None
        Why it cannot be read, one of `REASONS`; None if it can.
    manchester : {"ieee", "thomas"} or None
        Convention it was read with.
    edge_us : int
        Its first ON edge as the sensor sees it, latency included [us].
    """

    start_us: int
    end_us: int
    payload: int | None
    checksum_ok: bool
    reason: Reason | None
    manchester: Convention | None
    edge_us: int


class _Reading(NamedTuple):
    """One reading of a packet: its first ON edge is taken as that of chip number `place` of the data."""

    place: int
    whole: bool
    payload: int | None
    convention: Convention | None
    checksum_ok: bool


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
    """Read the packets in the ON and OFF counts of one region.

    Parameters
    ----------
    n_on, n_off : array_like, shape (n,)
        Counts in each bin (Fig. 6).
    start_us : int
        Start of the first bin [us].
    delta_t_id_us : int
        Length of a bin [us].
    packet_format : PacketFormat
    conventions : sequence of {"ieee", "thomas"}, optional
        Manchester conventions to try; None takes that of the format.
    gate : float
        Fraction of the lead of a usual edge that a bin needs, 0 .. 1, see `led_state.edge_gates`; 0 is the paper's
        plain rule.
    latency_us : float
        Time from a rise of the light to its ON events [us]. It is subtracted from the start and the end of each packet
        and has no other effect.

    Returns
    -------
    packets : list of Packet
        In the order of time. Packets that cannot be read are included, each with its reason.
    reason : str or None
        None if there is a packet, readable or not, else "no_events" or "no_start".

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
    times, rises = find_edges(lead, gate_on, gate_off)
    if not times.size:
        return [], "no_events"
    f = packet_format
    chip_bins = f.chip_us / delta_t_id_us
    starts = find_starts(times, rises, (f.start_bits + 1) * chip_bins)
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
    """Read the packet whose first ON edge is edge number `first`."""
    n_start, n_data = 2 * f.start_bits, 2 * f.data_bits
    nominal = f.chip_us / delta_t_id_us
    chips, chip, phase = read_chips(times, rises, first, n_data + f.start_bits, nominal)
    run_chips = (times[first] - times[first - 1]) / nominal if first else np.inf

    def as_packet(reading: _Reading, reason: Reason | None) -> Packet:
        """Make the packet of a reading."""
        begin, end = span(reading.place)
        moments = (start_us + round(float(moment * delta_t_id_us)) for moment in (begin, end, times[first]))
        begin_us, end_us, edge_us = moments
        return Packet(
            begin_us - late_us, end_us - late_us, reading.payload, reason is None, reason, reading.convention, edge_us
        )

    def span(place: int) -> tuple[float, float]:
        """Return start and end of the packet if its first ON edge is that of chip number `place` [bins]."""
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
        bits, has_edge = manchester_decode(shifted[:n_data], "ieee")
        n_seen = int((n_bins - UNSEEN_BINS - times[first] - phase) / chip) + place  # the last edge may still be missing
        if not has_edge.all() or shifted[n_data : min(n_data + f.start_bits, n_seen)].any():
            continue
        for convention in conventions:
            payload, checksum_ok = decode_data_bits(bits if convention == "ieee" else 1 - bits, f)
            readings.append(_Reading(place, whole, payload, convention, checksum_ok))
    good = [reading for reading in readings if reading.checksum_ok]
    if any(reading.whole for reading in good):
        conflict = len({reading.payload for reading in good}) > 1
        return as_packet(next(reading for reading in good if reading.whole), "conflict" if conflict else None)
    readings = [reading for reading in readings if reading.whole and not good]
    return as_packet(readings[0], "checksum") if readings else as_packet(_Reading(0, False, None, None, False), reason)
