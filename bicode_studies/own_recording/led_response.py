"""Measure how the pixels of a camera respond to the edges of one blinking LED.

The LED sends the same packet again and again, and what it sends is known once it is decoded. So the times of its
edges are known up to one common shift, and the events of the pixels that see the LED can be summed edge by edge
(`measure_edge_response`). The result is the camera's response to a step of light.

Two kinds of numbers follow from it. Some are counted directly: the events per edge, and the shortest time between two
events of a pixel. The others are constants of this package's pixel model (`camera.pixels`), which are fitted so that
the response of the model looks like the one measured (`pixel_fit`):

    time constant       of the low-pass, in the light of the dark LED
    threshold           relative to the LED's log contrast, which must be known; a model with twice the contrast and
                        twice the threshold makes nearly the same events
    refractory period   and the noise of the log level
    delay difference    how much longer the pure delay of OFF is than that of ON

One LED without a wire to the camera cannot tell the pure delay that ON and OFF have in common, however long it is
recorded: the delay has the same effect as an LED that is switched that much later.
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
AHEAD_US = 100  # the window of an edge begins this long before it and lasts one chip
GOOD_SHARE = 0.8  # a pixel with fewer events than this share of the usual number sees the LED only in part
GROUPS = 4  # the pixels are divided into this many groups; their separate fits show the uncertainty
MIN_PIXELS = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class EdgeResponse:
    """Response of the pixels that see an LED to its edges.

    Parameters
    ----------
    levels : ndarray of uint8, shape (chips,)
        Levels of one packet: 0 LED off, 1 LED on.
    chip_us : float
        Length of a chip by the camera's clock [us].
    start_us : float
        Start of the first packet, estimated from the mean time of the events at its rises [us].
    on, off : ndarray of int64, shape (pixels, bins)
        Counts of ON events after rises and of OFF events after falls by their delay, in bins of `BIN_US` that begin
        at `-AHEAD_US`; all packets together.
    n_packets : int
        Number of packets.
    shortest_interval_us : float
        Time between two events of a pixel; only 1 of 1000 is shorter [us].
    """

    levels: npt.NDArray[np.uint8]
    chip_us: float
    start_us: float
    on: Ints
    off: Ints
    n_packets: int
    shortest_interval_us: float

    @property
    def n_pixels(self) -> int:
        """Number of pixels."""
        return int(self.on.shape[0])

    @property
    def delays_us(self) -> Floats:
        """Delays in the middle of the bins [us], shape (bins,)."""
        middles: Floats = np.arange(self.on.shape[1], dtype=np.float64) * BIN_US - AHEAD_US + BIN_US / 2
        return middles

    @property
    def n_rises(self) -> int:
        """Number of rises per packet; there are as many falls, because the packet repeats."""
        return int((np.diff(self.levels.astype(int), append=int(self.levels[0])) > 0).sum())

    def per_edge(self, side: str) -> Floats:
        """Return the mean number of events per pixel and edge in each bin.

        Parameters
        ----------
        side : str
            "on" or "off".

        Returns
        -------
        ndarray of float, shape (bins,)
        """
        counts: Ints = getattr(self, side)
        shares: Floats = counts.mean(axis=0) / (self.n_packets * self.n_rises)
        return shares


def measure_edge_response(
    events: Events, box: Sequence[int], packets: Sequence[Packet], packet_format: PacketFormat
) -> EdgeResponse:
    """Measure the response of the pixels that see an LED which stands still.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        The recording, in the order of time.
    box : sequence of int
        Region of the LED, x, y, w, h [px].
    packets : sequence of Packet
        Packets as decoded. Those with the right checksum are used; they must all hold the same ID.
    packet_format : PacketFormat
        Format of the packets.

    Returns
    -------
    EdgeResponse

    Raises
    ------
    ValueError
        If there are not two valid packets with one ID, or too few pixels see the LED.
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
    for _ in range(3):  # the mean time of the ON events shows when the packets began
        delay, edge, packet = find_delays(t_us, starts, chip_us, levels)
        hits = (edge > 0) & (p > 0) & (delay >= -AHEAD_US) & (delay < chip_us - AHEAD_US)
        late = np.array([delay[hits & (packet == k)].mean() for k in range(starts.size)])
        starts, chip_us = _fit_starts(starts + late - AHEAD_US, chip_us * levels.size, levels.size)
    delay, edge, packet = find_delays(t_us, starts, chip_us, levels)
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
        n_packets=starts.size, shortest_interval_us=_shortest_interval(number, t_us),
    )  # fmt: skip


def split_pixels(response: EdgeResponse) -> list[EdgeResponse]:
    """Divide the pixels into groups; the scatter of the fits of the groups shows the uncertainty by chance.

    Parameters
    ----------
    response : EdgeResponse
        Response of all pixels.

    Returns
    -------
    list of EdgeResponse
        Responses of `GROUPS` groups; each pixel is in one of them.
    """
    return [replace(response, on=response.on[k::GROUPS], off=response.off[k::GROUPS]) for k in range(GROUPS)]


def _good_pixels(events: Events, box: Sequence[int]) -> tuple[Ints, Floats, npt.NDArray[np.int64]]:
    """Return pixel number, time [us] and polarity of each event of the pixels in a box that see the LED well."""
    x, y, w, h = box
    column, row = events["x"].astype(np.int64) - x, events["y"].astype(np.int64) - y
    inside = (column >= 0) & (column < w) & (row >= 0) & (row < h)
    place = (row * w + column)[inside]
    counts = np.bincount(place, minlength=w * h)
    usual = np.median(counts[counts > 0.5 * np.percentile(counts, 99)])
    good = np.flatnonzero(counts > GOOD_SHARE * usual)
    if good.size < MIN_PIXELS:
        raise ValueError(
            f"{good.size} pixels in box {tuple(box)} see the LED well, {MIN_PIXELS} are needed; go nearer, "
            "so that it covers more pixels"
        )
    number = np.full(w * h, -1)
    number[good] = np.arange(good.size)
    mine = number[place] >= 0
    t_us, p = np.asarray(events["t"], np.float64)[inside][mine], np.asarray(events["p"], np.int64)[inside][mine]
    return number[place][mine], t_us, p


def _fit_starts(starts: Floats, packet_us: float, n_chips: int) -> tuple[Floats, float]:
    """Fit a steady clock to the starts of packets; return its starts and the length of a chip [us]."""
    number = np.round((starts - starts[0]) / packet_us)
    slope, first = np.polyfit(number, starts, 1)
    return first + slope * number, float(slope) / n_chips


def find_delays(
    t_us: Floats, starts: Floats, chip_us: float, levels: npt.NDArray[np.uint8]
) -> tuple[Floats, Ints, Ints]:
    """Find the LED edge to which each event belongs, and the delay of the event after it.

    An event belongs to the last edge whose window has begun; windows begin `AHEAD_US` before the edge.

    Parameters
    ----------
    t_us : ndarray of float, shape (n,)
        Times of the events [us].
    starts : ndarray of float, shape (packets,)
        Start of each packet [us].
    chip_us : float
        Length of a chip [us].
    levels : ndarray of uint8, shape (chips,)
        Levels of one packet: 0 LED off, 1 LED on.

    Returns
    -------
    delay_us : ndarray of float, shape (n,)
        Time since the edge [us], ``-AHEAD_US`` or more.
    edge : ndarray of int64, shape (n,)
        +1 for a rise, -1 for a fall.
    packet : ndarray of int64, shape (n,)
        Number of the packet; -1 where no packet was read.
    """
    turns: Ints = levels.astype(np.int64) - np.roll(levels, 1)
    at = np.flatnonzero(turns)
    if (
        not turns[0] and at.size
    ):  # events before the first edge of a packet belong to the last edge of the previous packet
        at = np.concatenate([[at[-1] - levels.size], at])
    packet = np.searchsorted(starts - AHEAD_US, t_us, side="right") - 1
    since = t_us - starts[np.maximum(packet, 0)]
    edge = np.searchsorted(at * chip_us - AHEAD_US, since, side="right") - 1
    inside = (packet >= 0) & (edge >= 0) & (since < levels.size * chip_us - AHEAD_US)
    return since - at[edge] * chip_us, turns[at[edge] % levels.size], np.where(inside, packet, -1)


def _shortest_interval(number: Ints, t_us: Floats) -> float:
    """Return the 0.001 quantile of the times between successive events of the same pixel [us]."""
    order = np.lexsort((t_us, number))
    intervals = np.diff(t_us[order])[np.diff(number[order]) == 0]
    return float(np.quantile(intervals, 0.001)) if intervals.size else float("nan")
