"""Arithmetic of packets in periods (II-B, III-B): whole packets, bounds on the bit rate, and waiting times.

Packets follow each other without pause, and the receiver buffers one period at a time: an ID counts if its packet
begins and ends inside one period. From the start of a period at a random time, the next packet begins after 0 to one
packet length, all delays equally likely. So a period

- shorter than one packet never holds a whole packet,
- of two packets or more always holds one,
- between these holds one with probability delta_t_whole / packet - 1.
"""

from __future__ import annotations

import numpy as np

MOMENTS = 400  # positions within a period, and within a packet, that the waiting time is averaged over


def whole_packet_probability(delta_t_whole_us: float, packet_us: float) -> float:
    """Return the share of periods that hold a whole packet.

    Parameters
    ----------
    delta_t_whole_us, packet_us : float
        Lengths of a period and of a packet [us], more than 0.

    Returns
    -------
    float
        0 .. 1.

    Raises
    ------
    ValueError
        If a length is not positive.

    Examples
    --------
    >>> [whole_packet_probability(us, 14_000) for us in (33_000, 21_000, 13_000)]
    [1.0, 0.5, 0.0]
    """
    _check(delta_t_whole_us, packet_us)
    return float(np.clip(delta_t_whole_us / packet_us - 1, 0.0, 1.0))


def rate_bounds_hz(delta_t_whole_us: float, packet_bits: int) -> tuple[float, float]:
    """Return the bit rates from which some periods, and all periods, hold a whole packet.

    A packet of n bits lasts n / f_ID. It fits once into delta_t_whole at the first bound, and twice at the second.

    Parameters
    ----------
    delta_t_whole_us : float
        Length of a period [us], more than 0.
    packet_bits : int
        Number of bits of a packet, more than 0.

    Returns
    -------
    some_hz, all_hz : float
        Bit rates [Hz].

    Raises
    ------
    ValueError
        If an argument is not positive.

    Examples
    --------
    >>> [round(f) for f in rate_bounds_hz(33_000, 14)]
    [424, 848]
    """
    _check(delta_t_whole_us, packet_bits)
    some_hz = packet_bits / (delta_t_whole_us * 1e-6)
    return some_hz, 2 * some_hz


def waiting_us(delta_t_whole_us: float, packet_us: float) -> tuple[float, float]:
    """Return the mean and the longest time until an ID is known.

    The time runs from the moment at which a marker comes into view, at a random position in a period and in its packet,
    to the end of the first period that holds a whole packet sent since then. Every such packet is taken as read, so
    this is the limit that the times alone set.

    Parameters
    ----------
    delta_t_whole_us, packet_us : float
        Lengths of a period and of a packet [us], more than 0.

    Returns
    -------
    mean_us, longest_us : float
        Times [us]; infinite if no period ever holds a whole packet.

    Raises
    ------
    ValueError
        If a length is not positive.

    Examples
    --------
    >>> mean_us, longest_us = waiting_us(33_000, 14_000)
    >>> round(mean_us), round(longest_us / 1000)
    (37500, 61)
    """
    if whole_packet_probability(delta_t_whole_us, packet_us) == 0:
        return np.inf, np.inf
    room_us = delta_t_whole_us - packet_us  # a packet that begins by then in its period fits
    middles = (np.arange(MOMENTS) + 0.5) / MOMENTS
    appears_us = middles[:, None] * delta_t_whole_us  # since the period began
    next_us = appears_us + middles[None, :] * packet_us  # start of the first packet that is in view as a whole
    # From one period to the next, its first packet begins earlier by the room, until it fits.
    first_us = (next_us - delta_t_whole_us) % packet_us
    later = 1 + np.ceil(np.maximum(first_us - room_us, 0) / room_us)
    periods = np.where(next_us <= room_us, 0, later)
    waited_us = (periods + 1) * delta_t_whole_us - appears_us
    return float(waited_us.mean()), float(waited_us.max())


def _check(length: float, packet: float) -> None:
    """Raise ValueError unless both lengths are positive."""
    if not (length > 0 and packet > 0):
        raise ValueError(f"lengths {length} and {packet} are not both above 0; give a period and a packet")
