"""One packet of an answer, ready to draw.   answer -> light, counts, what was read, frame, box"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import slice_time
from bicode_lab.recognition import Sighting, accumulate, count_on_off
from bicode_lab.recognition.accumulate import Frame
from bicode_lab.recognition.decode import Packet
from bicode_studies.what_if.ask import Answer

Box = tuple[int, int, int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """What there is to see of one packet.

    Parameters
    ----------
    start_us, end_us : int
        From a bit before its start to a bit behind its end [us].
    led_times_us, led_levels : ndarray, shape (n,)
        The light that was sent, see `LedWaveform.steps`.
    n_on, n_off : ndarray of int32, shape (m,)
        Counts of each delta_t_ID bin from `start_us` on, in the box, or in the window where there is none.
    packet : Packet or None
        What the receiver made of it; None where it saw no packet there.
    reason : str or None
        Why its period has no ID.
    frame : ndarray of int8, shape (height, width)
        3-valued, of delta_t_blinker behind the packet's start; the last event of a pixel counts.
    box : (x, y, w, h) or None
        The region that was found [px].
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


def view(answer: Answer) -> View:
    """An answer in, its first packet that was read out, or else the first one that was sent."""
    choice, scene = answer.choice, answer.scene
    f, wave = choice.packet_format, scene.markers[0].marker.waveform
    bit_us = round(2 * f.chip_us)
    sighting, packet = _first_read(answer.sightings)
    sent_us = wave.packet_starts(0.0, wave.packet_us) if packet is None else np.array([packet.start_us])
    start_us = int(sent_us[0]) - bit_us
    n_bins = int(np.ceil((f.packet_us + 2 * bit_us) / choice.delta_t_id_us))
    end_us = start_us + n_bins * choice.delta_t_id_us
    box = (sighting.x, sighting.y, sighting.w, sighting.h) if sighting else None
    window = scene.optics
    counts = count_on_off(
        answer.events, box or (0, 0, window.width, window.height), start_us, n_bins, choice.delta_t_id_us
    )
    data_us = start_us + bit_us * (1 + f.start_bits)
    blinks = slice_time(answer.events, data_us, data_us + choice.delta_t_blinker_us)
    times_us, levels = wave.steps(start_us, end_us)
    return View(
        start_us=start_us, end_us=end_us, led_times_us=times_us, led_levels=levels,
        n_on=counts[0], n_off=counts[1], packet=packet,
        reason=sighting.reason if sighting else "no region found",
        frame=accumulate(blinks, window.width, window.height, "last"), box=box,
    )  # fmt: skip


def _first_read(sightings: tuple[Sighting, ...]) -> tuple[Sighting | None, Packet | None]:
    """Sightings in; that with the first good packet, else the first with any, else the first, and the packet, out."""
    read = [(s, packet) for s in sightings for packet in (*s.border_packets, *s.packets)]
    good = [(s, packet) for s, packet in read if packet.checksum_ok]
    if good or read:
        return (good or read)[0]
    return (sightings[0], None) if sightings else (None, None)
