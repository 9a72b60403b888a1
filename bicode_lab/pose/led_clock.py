"""The times at which an LED switches, known once its packets are read.

Packets follow each other without pause (III-A). So a packet that was read gives the state of the LED ahead of it and
after it, too, and several packets give the clock of the transmitter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.packet import PacketFormat, encode_packet
from bicode_lab.recognition.decode import Packet

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class LedClock:
    """The blinking of one LED.

    Parameters
    ----------
    start_us : float
        A moment at which a packet begins [us].
    packet_us : float
        Length of a packet on the clock of the recording [us].
    chips : tuple of int
        State of the LED in each chip of a packet: 0 off, 1 on.

    Examples
    --------
    >>> LedClock(start_us=0, packet_us=40, chips=(0, 0, 1, 0)).edges(0, 50)
    (array([20., 30.]), array([ True, False]))
    """

    start_us: float
    packet_us: float
    chips: tuple[int, ...]

    def edges(self, start_us: float, end_us: float) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Return the moments at which the LED switches in a span of time.

        Parameters
        ----------
        start_us, end_us : float
            Span of time [us]; the moment `end_us` is not part of it.

        Returns
        -------
        times_us : ndarray of float64, shape (n,)
            Rising [us].
        rises : ndarray of bool, shape (n,)
            True where the LED is switched on.
        """
        n = len(self.chips)
        chip_us = self.packet_us / n
        index = np.arange(
            np.floor((start_us - self.start_us) / chip_us), np.ceil((end_us - self.start_us) / chip_us) + 1
        ).astype(np.int64)
        states = np.array(self.chips)[index % n]
        before = np.array(self.chips)[(index - 1) % n]
        times = self.start_us + index * chip_us
        used = (states != before) & (times >= start_us) & (times < end_us)
        return times[used], states[used] > 0


def fit_clock(packets: Sequence[Packet], payload: int, packet_format: PacketFormat) -> LedClock | None:
    """Fit the clock of an LED to the packets that were read.

    The starts of the packets lie on a line, whose slope is the length of a packet. With a single packet, its own length
    is taken.

    Parameters
    ----------
    packets : sequence of Packet
        Of one track, in any order; those with another payload or a wrong checksum are left out.
    payload : int
        The ID of the track.
    packet_format : PacketFormat

    Returns
    -------
    LedClock or None
        None if no packet is left.

    Examples
    --------
    >>> packets = [Packet(t, t + 14_000, 37, True, None, "ieee", t + 3000) for t in (100, 28_110)]
    >>> clock = fit_clock(packets, 37, PacketFormat())
    >>> round(clock.start_us, 3), round(clock.packet_us, 3)
    (100.0, 14005.0)
    """
    good = {p.start_us: p for p in packets if p.checksum_ok and p.payload == payload and p.manchester}
    if not good:
        return None
    first = good[min(good)]
    assert first.manchester is not None
    chips = encode_packet(payload, replace(packet_format, manchester=first.manchester))
    starts = np.array(sorted(good), float)
    length = float(np.median([p.end_us - p.start_us for p in good.values()]))
    number = np.round((starts - starts[0]) / length)
    start = float(np.median(starts - number * length))
    if number[-1] > 0:
        length, start = (float(value) for value in np.polyfit(number, starts, 1))
    return LedClock(start_us=start, packet_us=length, chips=tuple(int(chip) for chip in chips))
