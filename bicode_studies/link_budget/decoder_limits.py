"""Number of events that the decoder needs: bits and packets that are read in a trial without a camera.

A `Channel` makes a Poisson number of events at every edge of the LED, each with a short delay, and stray events at any
time. So the trial measures the decoder alone. `decoder_theory` predicts what it finds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.marker import PacketFormat, encode_packet, manchester_decode
from bicode_lab.recognition.decode import decode_packets
from bicode_lab.recognition.led_state import edge_gates, led_state
from bicode_studies.statistics import wilson

Numbers = npt.NDArray[np.int64]

PACKETS_PER_STREAM = 5


@dataclass(frozen=True, kw_only=True)
class Channel:
    """Model of the events that reach the decoder.

    Parameters
    ----------
    events_per_edge : float
        Mean number of events of an edge of the LED, 0 or more.
    spread_us : float
        Mean of their exponentially distributed delay [us], more than 0.
    stray_hz : float
        Rate of stray events of each polarity, all pixels of the region together [1/s], 0 or more.
    """

    events_per_edge: float
    spread_us: float = 60.0
    stray_hz: float = 0.0

    def __post_init__(self) -> None:
        if not self.spread_us > 0:
            raise ValueError(f"spread_us={self.spread_us} is not a positive time; choose more than 0")
        for name in ("events_per_edge", "stray_hz"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")


@dataclass(frozen=True, eq=False)
class Stream:
    """Counts of the events of successive packets that went through a channel.

    Attributes
    ----------
    n_on, n_off : ndarray of int, shape (bins,)
        Events in each bin.
    chips : ndarray of uint8, shape (chips,)
        State of the LED in each chip: 0 off, 1 on.
    payloads : ndarray of int, shape (packets,)
        Payloads that were sent.
    phase_us : float
        Time from the start of the first bin to the start of the first packet [us].
    """

    n_on: Numbers
    n_off: Numbers
    chips: npt.NDArray[np.uint8]
    payloads: Numbers
    phase_us: float


def send(packets: int, packet_format: PacketFormat, channel: Channel, delta_t_id_us: int, seed: int) -> Stream:
    """Send packets with random payloads through a channel; the LED is off before and after them.

    Parameters
    ----------
    packets : int
        Number of packets.
    packet_format : PacketFormat
    channel : Channel
    delta_t_id_us : int
        Length of a bin [us].
    seed : int
        Seed of payloads, phase and events.

    Returns
    -------
    Stream
    """
    rng = np.random.default_rng(seed)
    payloads = rng.integers(2**packet_format.payload_bits, size=packets)
    chips = np.concatenate([encode_packet(int(payload), packet_format) for payload in payloads])
    change = np.diff(np.concatenate([[0], chips, [0]]).astype(int))
    places = np.flatnonzero(change)
    phase_us = float(rng.uniform(0, delta_t_id_us))
    end_us = (chips.size + 2 * packet_format.start_bits) * packet_format.chip_us
    n_bins = int(np.ceil((end_us + delta_t_id_us) / delta_t_id_us))
    counts = []
    for side in (1, -1):
        edges_us = places[change[places] == side] * packet_format.chip_us
        t_us = np.repeat(edges_us, rng.poisson(channel.events_per_edge, edges_us.size))
        t_us = t_us + rng.exponential(channel.spread_us, t_us.size)
        strays_us = rng.uniform(0, end_us, rng.poisson(channel.stray_hz * end_us * 1e-6))
        at = ((np.concatenate([t_us, strays_us]) + phase_us) // delta_t_id_us).astype(np.int64)
        counts.append(np.bincount(at[at < n_bins], minlength=n_bins))
    return Stream(counts[0], counts[1], chips, payloads, phase_us)


def read_bits(stream: Stream, packet_format: PacketFormat, delta_t_id_us: int, gate: float) -> dict[str, int]:
    """Count the data bits of a stream that are read right, unread (both chips equal) and wrong.

    The times of the chips are known to this reader, so that only the counts can mislead it. It takes the LED's state
    in the last whole bin of every chip.

    Parameters
    ----------
    stream : Stream
    packet_format : PacketFormat
    delta_t_id_us : int
        Length of a bin [us].
    gate : float
        Share of a usual count that a count must exceed, 0 .. 1; 0 lets any event count.

    Returns
    -------
    dict of str to int
        Counts ``right``, ``unread`` and ``wrong``.
    """
    gate_on, gate_off = edge_gates(stream.n_on, stream.n_off, gate)
    state = led_state(stream.n_on, stream.n_off, gate_on=gate_on, gate_off=gate_off)
    ends_us = np.arange(1, stream.chips.size + 1) * packet_format.chip_us + stream.phase_us
    chips = state[(ends_us // delta_t_id_us).astype(np.int64) - 1]
    rows = (stream.payloads.size, 2 * packet_format.packet_bits)
    data = np.s_[:, 2 * packet_format.start_bits :]
    sent, _ = manchester_decode(stream.chips.reshape(rows)[data].ravel())
    bits, switched = manchester_decode(chips.reshape(rows)[data].ravel())
    right = int((switched & (bits == sent)).sum())
    return {"right": right, "unread": int((~switched).sum()), "wrong": int(switched.sum()) - right}


def read_packets(stream: Stream, packet_format: PacketFormat, delta_t_id_us: int, gate: float) -> dict[str, int]:
    """Count the packets of a stream that are read right, wrong, not at all, or rejected by the checksum.

    The reader is `decode_packets`, as in the receiver.

    Parameters
    ----------
    stream : Stream
    packet_format : PacketFormat
    delta_t_id_us : int
        Length of a bin [us].
    gate : float
        Share of a usual count that a count must exceed, 0 .. 1; 0 lets any event count.

    Returns
    -------
    dict of str to int
        Counts ``right``; ``wrong``, IDs that pass their checksum and are not what was sent there; ``caught``, packets
        whose bits all have their transition but whose checksum is wrong; ``unread``, all others.
    """
    found, _ = decode_packets(stream.n_on, stream.n_off, 0, delta_t_id_us, packet_format, gate=gate)
    right: set[int] = set()
    wrong, caught = 0, sum(packet.reason == "checksum" for packet in found)
    for packet in found:
        if packet.checksum_ok:
            place = (packet.start_us - stream.phase_us) / packet_format.packet_us
            nearest = int(np.clip(np.round(place), 0, stream.payloads.size - 1))
            if abs(place - nearest) * packet_format.packet_us < packet_format.chip_us * packet_format.start_bits and (
                packet.payload == stream.payloads[nearest]
            ):
                right.add(nearest)
            else:
                wrong += 1
    unread = stream.payloads.size - len(right) - wrong - caught
    return {"right": len(right), "unread": unread, "wrong": wrong, "caught": caught}


def measure(
    channels: Iterable[Channel],
    packet_format: PacketFormat,
    *,
    packets: int,
    delta_t_id_us: int,
    gate: float,
    seed: int,
) -> pd.DataFrame:
    """Send packets through several channels and count the bits and packets that are read.

    Parameters
    ----------
    channels : iterable of Channel
    packet_format : PacketFormat
    packets : int
        Number of packets through each channel, rounded up to a multiple of `PACKETS_PER_STREAM`.
    delta_t_id_us : int
        Length of a bin [us].
    gate : float
        Share of a usual count that a count must exceed, 0 .. 1; 0 lets any event count.
    seed : int
        All channels get the same payloads and phases.

    Returns
    -------
    DataFrame
        One row for each channel: its values; counts ``packets``, ``packets_right``, ``packets_wrong``,
        ``packets_caught``, ``bits``, ``bits_right``, ``bits_wrong``; see `read_packets` and `read_bits`.
    """
    rows = []
    for channel in channels:
        total = {"packets": 0, "packets_right": 0, "packets_wrong": 0, "packets_caught": 0}
        total |= {"bits": 0, "bits_right": 0, "bits_wrong": 0}
        for number in range(-(-packets // PACKETS_PER_STREAM)):
            # The seed does not depend on the channel: all channels get the same payloads and phases.
            stream = send(PACKETS_PER_STREAM, packet_format, channel, delta_t_id_us, seed * 100_003 + number)
            whole = read_packets(stream, packet_format, delta_t_id_us, gate)
            bits = read_bits(stream, packet_format, delta_t_id_us, gate)
            total["packets"] += PACKETS_PER_STREAM
            total["bits"] += sum(bits.values())
            for name in ("right", "wrong", "caught"):
                total[f"packets_{name}"] += whole[name]
            for name in ("right", "wrong"):
                total[f"bits_{name}"] += bits[name]
        rows.append({**vars(channel), **total})
    return pd.DataFrame(rows)


def rate_table(counts: npt.ArrayLike, totals: npt.ArrayLike) -> pd.DataFrame:
    """Tabulate rates with their 95 % Wilson intervals.

    The results are taken as independent; packets of one stream share the place of their edges in the bins.

    Parameters
    ----------
    counts, totals : array_like, shape (n,)
        Numbers of the results that are counted and of all results.

    Returns
    -------
    DataFrame
        Columns ``rate``, ``low`` and ``high``, 0 .. 1; n rows.

    Examples
    --------
    >>> rate_table([0, 5], [10, 10]).round(2)
       rate   low  high
    0   0.0  0.00  0.28
    1   0.5  0.24  0.76
    """
    low, high = wilson(counts, totals)
    return pd.DataFrame({"rate": np.asarray(counts, float) / np.asarray(totals, float), "low": low, "high": high})
