"""One packet of a recording, ready to draw: the light, the counts, what was read, a frame and the region."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box
from bicode_lab.events import slice_time
from bicode_lab.recognition import Sighting, accumulate, count_on_off
from bicode_lab.recognition.accumulate import Frame
from bicode_lab.recognition.decode import Packet
from bicode_studies.what_if.ask import WhatIfResult


@dataclass(frozen=True, kw_only=True, eq=False)
class PacketView:
    """What is drawn of one packet.

    Attributes
    ----------
    start_us, end_us : int
        Times from one bit before the packet's start to at least one bit after its end [us].
    led_times_us, led_levels : ndarray, shape (n,)
        The light that was sent, see `LedWaveform.steps`.
    n_on, n_off : ndarray of int32, shape (m,)
        Events in each delta_t_ID bin from `start_us` on, in the box, or in the window if there is no box.
    packet : Packet or None
        What the receiver read of the packet; None if it found none.
    reason : str or None
        Why its period has no ID; None if it has one.
    frame : ndarray of int8, shape (height, width)
        3-valued frame of delta_t_blinker after the packet's start; the last event of a pixel counts.
    box : Box or None
        The region that was found [px]; None if there is none.
    """

    start_us: int
    end_us: int
    led_times_us: npt.NDArray[np.float64]
    led_levels: npt.NDArray[np.float64]
    n_on: npt.NDArray[np.int32]
    n_off: npt.NDArray[np.int32]
    packet: Packet | None
    reason: str | None
    frame: Frame
    box: Box | None


def view_packet(result: WhatIfResult) -> PacketView:
    """Pick the first packet of a recording that was read, or else the first one that was sent.

    Parameters
    ----------
    result : WhatIfResult

    Returns
    -------
    PacketView
    """
    choice, scene = result.choice, result.scene
    f, wave = choice.packet_format, scene.markers[0].marker.waveform
    bit_us = round(2 * f.chip_us)
    sighting, packet = _first_read(result.sightings)
    sent_us = wave.packet_starts(0.0, wave.packet_us) if packet is None else np.array([packet.start_us])
    start_us = int(sent_us[0]) - bit_us
    n_bins = int(np.ceil((f.packet_us + 2 * bit_us) / choice.delta_t_id_us))
    end_us = start_us + n_bins * choice.delta_t_id_us
    box = Box(sighting.x, sighting.y, sighting.w, sighting.h) if sighting else None
    window = scene.optics
    counts = count_on_off(
        result.events, box or Box(0, 0, window.width, window.height), start_us, n_bins, choice.delta_t_id_us
    )
    data_us = start_us + bit_us * (1 + f.start_bits)
    blinks = slice_time(result.events, data_us, data_us + choice.delta_t_blinker_us)
    times_us, levels = wave.steps(start_us, end_us)
    return PacketView(
        start_us=start_us, end_us=end_us, led_times_us=times_us, led_levels=levels,
        n_on=counts[0], n_off=counts[1], packet=packet,
        reason=sighting.reason if sighting else "no region found",
        frame=accumulate(blinks, window.width, window.height, "last"), box=box,
    )  # fmt: skip


def _first_read(sightings: tuple[Sighting, ...]) -> tuple[Sighting | None, Packet | None]:
    """Return the sighting with the first packet that passes its checksum, or else with any packet, and the packet."""
    read = [(s, packet) for s in sightings for packet in (*s.border_packets, *s.packets)]
    good = [(s, packet) for s, packet in read if packet.checksum_ok]
    if good or read:
        return (good or read)[0]
    return (sightings[0], None) if sightings else (None, None)
