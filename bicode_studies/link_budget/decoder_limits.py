"""How few events does the decoder need?   events an edge -> bits, packets, IDs: by counting and by trial

No camera here: a `Channel` makes a Poisson number of events at every edge of the LED, each a little
late, and stray events at any time. So theory is a few lines, and what is measured is the decoder alone.

Theory, without stray events. With m the probability that an edge is missed,

- a chip is read right behind an edge that was seen, or that was missed when the chip before was wrong:
  states alternate, so one missed edge spoils one run. r_mid = 1 - m r_first behind the edge in the
  middle of a bit; half of the bits begin with an edge, so r_first = (r_mid + 1 - m r_mid) / 2.
- a bit is read where its first chip is right and the edge in its middle is seen: (1 - m) r_first.
  Otherwise its chips are alike and it is unread; without stray events no bit is ever inverted.
- a packet is read where none of its n rises and n falls is missed, nor the fall ahead of its start:
  (1 - m)^(2 n + 1), averaged over the payloads.

An edge is seen where a bin of delta_t_ID holds more of its events than the gate (`led_state.edge_gates`), which
is taken from the counts and so has a scatter of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.stats import norm, poisson

from bicode_lab.marker import PacketFormat, encode_packet, manchester_decode
from bicode_lab.marker.packet import checksum
from bicode_lab.recognition.decode import decode_packets
from bicode_lab.recognition.led_state import edge_gates, led_state
from bicode_studies.link_budget.budget import rises_of

Floats = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

PACKETS_A_STREAM = 5
PHASES = 16  # places of an edge within a bin, for the theory
Z = 1.96  # of a 95 % interval


@dataclass(frozen=True, kw_only=True)
class Channel:
    """What arrives from the LED's edges.

    Parameters
    ----------
    events_per_edge : float
        Mean number of events that an edge makes, and so of every chip that begins with one.
    spread_us : float
        Their delay is exponential with this mean [us].
    stray_hz : float
        Events of each polarity that come at any time [1/s], all pixels of the region together.
    """

    events_per_edge: float
    spread_us: float = 60.0
    stray_hz: float = 0.0

    def __post_init__(self) -> None:
        if not self.spread_us > 0:
            raise ValueError(f"spread_us={self.spread_us} is not a time; choose more than 0")
        for name in ("events_per_edge", "stray_hz"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative; choose 0 or more")


@dataclass(frozen=True, eq=False)
class Stream:
    """Packet after packet through a channel, counted in bins.

    Parameters
    ----------
    n_on, n_off : ndarray, shape (bins,)
        Events in each bin.
    chips : ndarray, shape (chips,)
        What the LED did, 0 off, 1 on.
    payloads : ndarray, shape (packets,)
    phase_us : float
        The first packet begins so much behind the first bin [us].
    """

    n_on: Numbers
    n_off: Numbers
    chips: npt.NDArray[np.uint8]
    payloads: Numbers
    phase_us: float


def send(packets: int, packet_format: PacketFormat, channel: Channel, delta_t_id_us: int, seed: int) -> Stream:
    """A number of packets with random payloads in, what the channel makes of them out; the LED is off around them."""
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
    """A stream in; how many of its data bits are right, unread (both chips alike) and wrong out.

    The reader knows when chips begin, so that only the counts can mislead it: it looks at the LED's state in
    the last whole bin of every chip.
    """
    gate_on, gate_off = edge_gates(stream.n_on, stream.n_off, gate)
    state = led_state(stream.n_on, stream.n_off, gate_on=gate_on, gate_off=gate_off)
    ends_us = np.arange(1, stream.chips.size + 1) * packet_format.chip_us + stream.phase_us
    seen = state[(ends_us // delta_t_id_us).astype(np.int64) - 1]
    rows = (stream.payloads.size, 2 * packet_format.packet_bits)
    data = np.s_[:, 2 * packet_format.start_bits :]
    sent, _ = manchester_decode(stream.chips.reshape(rows)[data].ravel())
    bits, switched = manchester_decode(seen.reshape(rows)[data].ravel())
    right = int((switched & (bits == sent)).sum())
    return {"right": right, "unread": int((~switched).sum()), "wrong": int(switched.sum()) - right}


def read_packets(stream: Stream, packet_format: PacketFormat, delta_t_id_us: int, gate: float) -> dict[str, int]:
    """A stream in; what its packets come to out: right, caught (by the checksum), wrong, unread.

    The reader is the receiver's own. A wrong ID is any that passes its checksum without being the one of the
    packet at its place; one is caught where every bit switches, but the checksum is another.
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
    """Channels in; what becomes of so many packets through each out, a row each.

    Returns
    -------
    DataFrame
        The channel's values; ``packets``, ``packets_right``, ``packets_wrong``, ``packets_caught``; ``bits``,
        ``bits_right``, ``bits_wrong``.
    """
    rows = []
    for channel in channels:
        total = {"packets": 0, "packets_right": 0, "packets_wrong": 0, "packets_caught": 0}
        total |= {"bits": 0, "bits_right": 0, "bits_wrong": 0}
        for number in range(-(-packets // PACKETS_A_STREAM)):
            # A stream's seed does not hang on the channel: the same payloads and phases for all of them.
            stream = send(PACKETS_A_STREAM, packet_format, channel, delta_t_id_us, seed * 100_003 + number)
            whole = read_packets(stream, packet_format, delta_t_id_us, gate)
            bits = read_bits(stream, packet_format, delta_t_id_us, gate)
            total["packets"] += PACKETS_A_STREAM
            total["bits"] += sum(bits.values())
            for name in ("right", "wrong", "caught"):
                total[f"packets_{name}"] += whole[name]
            for name in ("right", "wrong"):
                total[f"bits_{name}"] += bits[name]
        rows.append({**vars(channel), **total})
    return pd.DataFrame(rows)


def edge_missed(channel: Channel, delta_t_id_us: int, gate: float, edges: int) -> tuple[Floats, Floats]:
    """A channel without stray events in; how probably an edge is missed, by the gate that holds, out.

    The gate is a share of a usual count, ``sum(N^2) / sum(N)`` over the `edges` edges of one side that were
    counted. That is itself left to chance, and a count is whole, so a gate of 0.99 and one of 1.01 differ much:
    each whole number that the gate may lie above has its weight, by a normal distribution.

    Returns
    -------
    missed, weights : ndarray, shape (gates, PHASES)
        Probability, and weight of the gate (sum 1 over gates), for `PHASES` places of an edge in a bin.

    Examples
    --------
    >>> missed, weights = edge_missed(Channel(events_per_edge=3.0), 250, gate=0.0, edges=40)
    >>> bool(np.allclose(missed, np.exp(-3.0))), weights.shape
    (True, (1, 16))
    """
    if channel.events_per_edge == 0:
        return np.ones((1, PHASES)), np.ones((1, PHASES))
    borders = np.arange(1, 64)[:, None] - (np.arange(PHASES) + 0.5) / PHASES
    reached = 1 - np.exp(-borders * delta_t_id_us / channel.spread_us)
    mean = channel.events_per_edge * np.diff(reached, axis=0, prepend=0.0)
    usual = (mean**2 + mean).sum(0) / mean.sum(0)
    # Var(N^2 - usual N) of a Poisson number, for the ratio's error.
    scatter = 4 * mean**3 + 6 * mean**2 + mean - 2 * usual * (2 * mean**2 + mean) + usual**2 * mean
    error = np.sqrt(scatter.sum(0) / edges) / mean.sum(0)
    whole = np.arange(int(np.floor((gate * (usual + 4 * error)).max())) + 1)[:, None]
    weights = norm.cdf((whole + 1 - gate * usual) / (gate * error)) if gate else np.ones((1, PHASES))
    weights = np.diff(weights, axis=0, prepend=0.0)
    missed = poisson.cdf(whole[:, None], mean).prod(1)
    return missed, weights / weights.sum(0)


def foretell(channel: Channel, packet_format: PacketFormat, delta_t_id_us: int, gate: float) -> dict[str, float]:
    """A channel without stray events in; expected share of bits and of packets that are read, 0 .. 1, out."""
    rises = rises_of(packet_format)
    missed, weights = edge_missed(channel, delta_t_id_us, gate, round(PACKETS_A_STREAM * float(rises.mean())))
    m = (missed * weights).sum(0)
    first_right = (1 - m / 2) / (1 + m * (1 - m) / 2)
    seen = (1 - missed)[:, :, None]
    on, off = ((seen**n * weights[:, :, None]).sum(0) for n in (rises, rises + 1))  # each side has its own gate
    return {"bits": float(((1 - m) * first_right).mean()), "packets": float((on * off).mean())}


def undetected(packet_format: PacketFormat, flips: int) -> float:
    """A number of flipped bits, anywhere in payload and checksum, in; the share that passes the checksum out.

    All payloads and all places are tried, nothing is drawn.

    Examples
    --------
    >>> paper, crc = PacketFormat(), PacketFormat(checksum="crc3")
    >>> [round(undetected(paper, flips), 2) for flips in (1, 2, 3)]
    [0.0, 0.33, 0.05]
    >>> [round(undetected(crc, flips), 2) for flips in (1, 2, 3)]
    [0.0, 0.07, 0.16]
    """
    return _passed(packet_format, [sum(1 << bit for bit in bits) for bits in _places(packet_format, flips)])


def undetected_swaps(packet_format: PacketFormat) -> float:
    """A format in; the share of swaps of two neighbouring, different bits that passes the checksum out.

    Examples
    --------
    >>> round(undetected_swaps(PacketFormat()), 2), undetected_swaps(PacketFormat(checksum="crc3"))
    (0.68, 0.0)
    """
    width = packet_format.data_bits
    swapped = passed = 0
    for payload in range(2**packet_format.payload_bits):
        word = payload << packet_format.checksum_bits | checksum(payload, packet_format)
        for low in range(width - 1):
            if (word >> low & 1) != (word >> low + 1 & 1):
                swapped += 1
                passed += _holds(word ^ 0b11 << low, packet_format)
    return passed / swapped


def _places(packet_format: PacketFormat, flips: int) -> Iterable[tuple[int, ...]]:
    """All choices of that many data bits."""
    if not 1 <= flips <= packet_format.data_bits:
        raise ValueError(f"flips={flips} is not in 1 .. {packet_format.data_bits}, the bits behind the start")
    return combinations(range(packet_format.data_bits), flips)


def _passed(packet_format: PacketFormat, masks: list[int]) -> float:
    """Masks of flipped bits in; the share of them that every payload's packet passes with out."""
    payloads = range(2**packet_format.payload_bits)
    words = [payload << packet_format.checksum_bits | checksum(payload, packet_format) for payload in payloads]
    return sum(_holds(word ^ mask, packet_format) for word in words for mask in masks) / (len(words) * len(masks))


def _holds(word: int, packet_format: PacketFormat) -> bool:
    """Whether the checksum of these data bits is right."""
    payload, check = word >> packet_format.checksum_bits, word & ((1 << packet_format.checksum_bits) - 1)
    return checksum(payload, packet_format) == check


def with_interval(part: npt.ArrayLike, whole: npt.ArrayLike) -> pd.DataFrame:
    """Counts in, shape (n,) each; columns ``rate``, ``low`` and ``high``, the 95 % Wilson interval, out.

    It takes what is counted as independent; packets of one stream share the place of their edges in the bins.

    Examples
    --------
    >>> with_interval([0, 5], [10, 10]).round(2)
       rate   low  high
    0   0.0  0.00  0.28
    1   0.5  0.24  0.76
    """
    k, n = np.asarray(part, float), np.asarray(whole, float)
    middle = (k + Z**2 / 2) / (n + Z**2)
    half = Z / (n + Z**2) * np.sqrt(k * (n - k) / n + Z**2 / 4)
    return pd.DataFrame({"rate": k / n, "low": np.maximum(middle - half, 0.0), "high": np.minimum(middle + half, 1.0)})
