"""Numbers of edges in a packet and of whole packets in a period, for the link budget."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from bicode_lab.marker import PacketFormat, encode_packet

MOST_PAYLOADS = 256  # of a wider ID, this many evenly spread payloads stand for all


@lru_cache
def count_rises(packet_format: PacketFormat) -> npt.NDArray[np.int64]:
    """Count the ON edges of a packet for every payload; an ID of more than 8 bits is sampled evenly.

    Parameters
    ----------
    packet_format : PacketFormat

    Returns
    -------
    ndarray of int, shape (payloads,)
        At most `MOST_PAYLOADS` values.

    Examples
    --------
    >>> rises = count_rises(PacketFormat())
    >>> rises.size, int(rises.min()), int(rises.max())
    (256, 6, 11)
    """
    payloads = np.unique(np.linspace(0, 2**packet_format.payload_bits - 1, MOST_PAYLOADS).astype(np.int64))
    return np.array([int((np.diff(encode_packet(int(p), packet_format).astype(int)) > 0).sum()) for p in payloads])


def packets_per_period(length_packets: float) -> tuple[tuple[int, float], tuple[int, float]]:
    """Return how many whole packets a period may hold, and in what share of phases it holds that many.

    Parameters
    ----------
    length_packets : float
        Length of the period, in packets.

    Returns
    -------
    more, fewer : (int, float)
        A number of whole packets, and the share of phases with that number, 0 .. 1.

    Examples
    --------
    >>> (two, share_two), (one, share_one) = packets_per_period(33 / 14)
    >>> two, round(share_two, 2), one, round(share_one, 2)
    (2, 0.36, 1, 0.64)
    """
    whole = int(np.floor(length_packets))
    return (whole, length_packets - whole), (max(whole - 1, 0), 1 - (length_packets - whole))
