"""Your own camera, measured with one blinking LED: how late, how slow, how sensitive?   events -> constants

The LED sends a packet again and again, and what it sends is known once it is decoded. So the
moments of its edges are known up to one shift, and the events of the pixels that see it can be
laid over each other edge by edge (`edge_response`): the camera's answer to a step of light.

Two kinds of numbers come out of that. Some are only counted: events an edge, the shortest time
between two events of a pixel. Others are constants of a model, this package's own pixel
(`camera.sensor`), chosen so that its answer looks like the one measured (`pixel_fit`):

    time constant   of the low-pass, at the light of the dark LED
    threshold       as a part of the LED's log contrast, which you have to know; a model with twice
                    the contrast and twice the threshold gives nearly the same events
    rest, noise     dead time after an event; noise of the log level
    OFF later       how much longer OFF's pure delay is than ON's

What one LED without a wire to the camera cannot say, however long it is recorded: the pure delay
that ON and OFF have in common. It looks just like an LED that was switched on that much later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.marker import PacketFormat, encode_packet
from bicode_lab.recognition import Packet

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

BIN_US = 10
AHEAD_US = 100  # the window of an edge opens this long before it and lasts one chip
GOOD_SHARE = 0.8  # of a usual good pixel's events: fewer have it half covered
GROUPS = 4  # pixels are dealt into so many groups, each fitted alone, for the uncertainty
LEAST_PIXELS = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeResponse:
    """What the pixels that see an LED answer to its edges.

    Parameters
    ----------
    levels : ndarray of uint8, shape (chips,)
        One packet, LED off 0 or on 1.
    chip_us : float
        Its chip by the camera's clock [us].
    start_us : float
        Start of the first packet, as well as the events tell it: its ON edges' mean [us].
    on, off : ndarray of int64, shape (pixels, bins)
        ON events behind rises and OFF events behind falls, by their delay in bins of `BIN_US` from
        `-AHEAD_US` on, all packets together.
    n_packets : int
    shortest_rest_us : float
        Time between two events of a pixel that only 1 in 1000 undercuts [us].
    """

    levels: npt.NDArray[np.uint8]
    chip_us: float
    start_us: float
    on: Ints
    off: Ints
    n_packets: int
    shortest_rest_us: float

    @property
    def n_pixels(self) -> int:
        """How many pixels take part."""
        return int(self.on.shape[0])

    @property
    def delays_us(self) -> Floats:
        """Middle of each bin [us]."""
        middles: Floats = np.arange(self.on.shape[1], dtype=np.float64) * BIN_US - AHEAD_US + BIN_US / 2
        return middles

    @property
    def n_rises(self) -> int:
        """Rises of one packet; as many falls, because it repeats."""
        return int((np.diff(self.levels.astype(int), append=int(self.levels[0])) > 0).sum())

    def per_edge(self, side: str) -> Floats:
        """Polarity "on" or "off" in, the mean number of events of a pixel and edge in each bin out, shape (bins,)."""
        counts: Ints = getattr(self, side)
        shares: Floats = counts.mean(axis=0) / (self.n_packets * self.n_rises)
        return shares


def edge_response(
    events: Events, box: Sequence[int], packets: Sequence[Packet], packet_format: PacketFormat
) -> EdgeResponse:
    """Events, the box of an LED that stands still and its packets in, its pixels' answer to an edge out.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    box : (x, y, w, h)
        Region [px].
    packets : sequence of Packet
        As decoded; those whose checksum holds are used, and all must say the same.
    packet_format : PacketFormat
    """
    good = sorted((p for p in packets if p.checksum_ok and p.payload is not None), key=lambda p: p.start_us)
    payloads = {p.payload for p in good}
    if len(payloads) != 1 or len(good) < 2:
        raise ValueError(
            f"{len(good)} packets with {len(payloads)} IDs; give two or more packets of one LED that sends one ID"
        )
    levels = encode_packet(int(payloads.pop() or 0), packet_format)
    number, t_us, p = _good_pixels(events, box)
    starts, chip_us = _fit_starts(np.array([g.start_us for g in good], float), packet_format.packet_us, levels.size)
    for _ in range(3):  # the ON edges' own mean says when the packets began
        delay, edge, packet = delays(t_us, starts, chip_us, levels)
        hits = (edge > 0) & (p > 0) & (delay >= -AHEAD_US) & (delay < chip_us - AHEAD_US)
        late = np.array([delay[hits & (packet == k)].mean() for k in range(starts.size)])
        starts, chip_us = _fit_starts(starts + late - AHEAD_US, chip_us * levels.size, levels.size)
    delay, edge, packet = delays(t_us, starts, chip_us, levels)
    n_bins, n_pixels = int(packet_format.chip_us // BIN_US), int(number.max()) + 1
    bins = np.floor((delay + AHEAD_US) / BIN_US).astype(np.int64)
    inside = (packet >= 0) & (bins >= 0) & (bins < n_bins)
    counts = []
    for sign in (1, -1):
        mine = inside & (edge == sign) & ((p > 0) == (sign > 0))
        flat = np.bincount(number[mine] * n_bins + bins[mine], minlength=n_pixels * n_bins)
        counts.append(flat.reshape(n_pixels, n_bins))
    return EdgeResponse(
        levels=levels, chip_us=chip_us, start_us=float(starts[0]), on=counts[0], off=counts[1],
        n_packets=starts.size, shortest_rest_us=_shortest_rest(number, t_us),
    )  # fmt: skip


def split(response: EdgeResponse, n_groups: int = GROUPS) -> list[EdgeResponse]:
    """An answer in, those of groups of its pixels out: their fits differ by as much as chance makes them."""
    return [replace(response, on=response.on[k::n_groups], off=response.off[k::n_groups]) for k in range(n_groups)]


def _good_pixels(events: Events, box: Sequence[int]) -> tuple[Ints, Floats, npt.NDArray[np.int64]]:
    """Events and a box in; for each event of pixels that see the LED well: the pixel's number, time, polarity."""
    x, y, w, h = box
    column, row = events["x"].astype(np.int64) - x, events["y"].astype(np.int64) - y
    inside = (column >= 0) & (column < w) & (row >= 0) & (row < h)
    place = (row * w + column)[inside]
    counts = np.bincount(place, minlength=w * h)
    usual = np.median(counts[counts > 0.5 * np.percentile(counts, 99)])
    good = np.flatnonzero(counts > GOOD_SHARE * usual)
    if good.size < LEAST_PIXELS:
        raise ValueError(
            f"{good.size} pixels in box {tuple(box)} see the LED well, {LEAST_PIXELS} are needed; go nearer, "
            "so that it covers more of them"
        )
    number = np.full(w * h, -1)
    number[good] = np.arange(good.size)
    mine = number[place] >= 0
    t_us, p = np.asarray(events["t"], np.float64)[inside][mine], np.asarray(events["p"], np.int64)[inside][mine]
    return number[place][mine], t_us, p


def _fit_starts(starts: Floats, packet_us: float, n_chips: int) -> tuple[Floats, float]:
    """Starts of some packets in; those of a steady clock through them, and its chip [us], out."""
    number = np.round((starts - starts[0]) / packet_us)
    slope, first = np.polyfit(number, starts, 1)
    return first + slope * number, float(slope) / n_chips


def delays(t_us: Floats, starts: Floats, chip_us: float, levels: npt.NDArray[np.uint8]) -> tuple[Floats, Ints, Ints]:
    """Times in; for each the time since the last edge (its window opens `AHEAD_US` early), +1 rise or -1 fall, packet.

    The packet is -1 where none was read.
    """
    turns: Ints = levels.astype(np.int64) - np.roll(levels, 1)
    at = np.flatnonzero(turns)
    if not turns[0] and at.size:  # what is before a packet's first edge belongs to the last one of the packet ahead
        at = np.concatenate([[at[-1] - levels.size], at])
    packet = np.searchsorted(starts - AHEAD_US, t_us, side="right") - 1
    since = t_us - starts[np.maximum(packet, 0)]
    edge = np.searchsorted(at * chip_us - AHEAD_US, since, side="right") - 1
    inside = (packet >= 0) & (edge >= 0) & (since < levels.size * chip_us - AHEAD_US)
    return since - at[edge] * chip_us, turns[at[edge] % levels.size], np.where(inside, packet, -1)


def _shortest_rest(number: Ints, t_us: Floats) -> float:
    """Events of many pixels in, the time between two of one pixel that 1 in 1000 undercuts out [us]."""
    order = np.lexsort((t_us, number))
    rest = np.diff(t_us[order])[np.diff(number[order]) == 0]
    return float(np.quantile(rest, 0.001)) if rest.size else float("nan")
