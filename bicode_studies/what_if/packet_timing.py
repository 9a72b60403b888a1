"""II-B and III-B: does a whole packet fit in?   two lengths -> chance, bounds on the bit rate, waiting

Packets follow each other without pause, and the receiver buffers period by period: an ID
counts where a packet begins and ends inside one period. A period that starts at a random
moment waits for the next packet's beginning for anything from nothing to one packet, so

    delta_t_whole <  1 packet     never holds a whole one
    delta_t_whole >= 2 packets    surely holds one
    between                       holds one with chance delta_t_whole / packet - 1
"""

from __future__ import annotations

import numpy as np

MOMENTS = 400  # places of a period and of a packet against each other that are tried


def whole_packet_chance(delta_t_whole_us: float, packet_us: float) -> float:
    """A period's and a packet's length [us] in, the share of periods that hold a whole packet, 0 .. 1, out.

    Examples
    --------
    >>> whole_packet_chance(33_000, 14_000), whole_packet_chance(21_000, 14_000), whole_packet_chance(13_000, 14_000)
    (1.0, 0.5, 0.0)
    """
    _check(delta_t_whole_us, packet_us)
    return float(np.clip(delta_t_whole_us / packet_us - 1, 0.0, 1.0))


def rate_bounds_hz(delta_t_whole_us: float, packet_bits: int) -> tuple[float, float]:
    """A period [us] and a packet's bits in; the rates [Hz] from which one ever, and surely, holds the other out.

    A packet of n bits lasts n / f_ID: once into delta_t_whole is the first bound, twice the second.

    Examples
    --------
    >>> [round(f) for f in rate_bounds_hz(33_000, 14)]
    [424, 848]
    """
    _check(delta_t_whole_us, packet_bits)
    ever_hz = packet_bits / (delta_t_whole_us * 1e-6)
    return ever_hz, 2 * ever_hz


def waiting_us(delta_t_whole_us: float, packet_us: float) -> tuple[float, float]:
    """A period's and a packet's length in; the mean and the longest time until an ID is known out [us].

    From the moment a marker comes into view, anywhere in a period and in its packet, to the end of
    the first period with a whole packet since. That every such packet is read is taken for granted:
    this is what the times alone allow. Infinite where no period ever holds one.

    Examples
    --------
    >>> mean_us, longest_us = waiting_us(33_000, 14_000)
    >>> round(mean_us), round(longest_us / 1000)
    (37500, 61)
    """
    if whole_packet_chance(delta_t_whole_us, packet_us) == 0:
        return np.inf, np.inf
    room_us = delta_t_whole_us - packet_us  # a packet fits that begins by then in its period
    middles = (np.arange(MOMENTS) + 0.5) / MOMENTS
    seen_us = middles[:, None] * delta_t_whole_us  # since the period began
    next_us = seen_us + middles[None, :] * packet_us  # when the first packet that is seen whole begins
    # From one period to the next, the first beginning in it comes earlier by the room, until it fits.
    first_us = (next_us - delta_t_whole_us) % packet_us
    later = 1 + np.ceil(np.maximum(first_us - room_us, 0) / room_us)
    periods = np.where(next_us <= room_us, 0, later)
    waited_us = (periods + 1) * delta_t_whole_us - seen_us
    return float(waited_us.mean()), float(waited_us.max())


def _check(length: float, packet: float) -> None:
    """Refuse lengths that are none."""
    if not (length > 0 and packet > 0):
        raise ValueError(f"lengths {length} and {packet} are not both above 0; give a period and a packet")
