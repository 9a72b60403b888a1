"""Fig. 2 as a whole: one period of events, then a stream of them.   events -> sightings

    events of one period --+-- delta_t_2D ------> frame -> ArUco ---------+   a, b, c
                           |                                              v
                           +-- delta_t_blinker -> frames -> regions -> boxes -> tracks   d, e, f
                           |                                              v
                           +-- delta_t_ID ------> ON/OFF counts in each box -> packets   g

Periods are [t0 + k delta_t_whole, ...), t0 the first event. A period's ID uses only packets
that are whole inside it, as the paper buffers per period; the counts of the period before are
kept, so that packets across the border are read as well, and each once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bicode_lab.events import Events, windows
from bicode_lab.marker.board import aruco_dictionary
from bicode_lab.marker.manchester import Convention
from bicode_lab.recognition.decode import REASONS, Packet, Reason, decode_packets
from bicode_lab.recognition.event_codes import CodedEvents, EventCoder
from bicode_lab.recognition.led_state import Counts, LedCounter
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, frame_2d
from bicode_lab.recognition.regions import RegionFinder
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.recognition.sighting import Sighting
from bicode_lab.recognition.track import Tracker

Box = tuple[int, int, int, int]
LENT_AREA = 3.0  # a region up to so many times larger than a 2D marker's box is that marker's, else clutter


@dataclass
class _Memory:
    """What is kept of a track from one period to the next."""

    period: int = -2  # number of the period the counts end with
    n_on: Counts = field(default_factory=lambda: np.zeros(0, np.int32))
    n_off: Counts = field(default_factory=lambda: np.zeros(0, np.int32))
    convention: Convention | None = None
    read_until_us: int = -(2**62)  # first ON edge of the last packet that was given out


class Receiver:
    """The paper's recognition unit (III-B) with its memory: feed it period after period.

    Parameters
    ----------
    settings : ReceiverSettings
    t0_us : int
        Start of the first period [us].
    """

    def __init__(self, settings: ReceiverSettings, t0_us: int = 0) -> None:
        self.settings = settings
        self.t0_us = t0_us
        self._coder = EventCoder(settings.width, settings.height)
        self._beside = ThreadPoolExecutor(1)  # one thread, which ends with the receiver
        self._finder = RegionFinder(settings)
        self._counter = LedCounter(settings.width, settings.height)
        self._tracker = Tracker(settings.max_age, settings.min_iou)
        self._memories: dict[int, _Memory] = {}
        self._next_period = 0
        self._n_cells = aruco_dictionary(settings.dictionary).markerSize + 2

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """One period's start [us] and its events in, a sighting for each region that blinks out.

        Raises
        ------
        ValueError
            Where events lie outside the sensor.
        """
        s = self.settings
        period = (start_us - self.t0_us) // s.delta_t_whole_us
        self._tracker.skip(period - self._next_period)
        self._next_period = period + 1
        coded = self._coder(events)
        looking = self._beside.submit(self._find_markers, coded, start_us) if s.detect_2d else None
        regions = self._finder(coded, start_us)  # meanwhile: OpenCV and the kernels do not hold Python's lock
        markers = looking.result() if looking else []
        boxes = lend_boxes(
            [(r.x, r.y, r.w, r.h) for r in regions],
            [marker.box(s.glow, self._n_cells) for marker in markers],
            s.width, s.height,
        )  # fmt: skip
        tracks = self._tracker.update([box for box, _ in boxes])
        alive = {track.number for track in self._tracker.tracks}
        self._memories = {number: memory for number, memory in self._memories.items() if number in alive}
        counts = self._count(coded, [box for box, _ in boxes], start_us)
        sightings = []
        for (box, which), track, n_on, n_off in zip(boxes, tracks, *counts, strict=True):
            memory = self._memories.setdefault(track.number, _Memory())
            marker = markers[which] if which is not None else None
            sightings.append(self._sighting(period, track.number, box, marker, memory, n_on, n_off))
        return sightings

    def _find_markers(self, events: CodedEvents, start_us: int) -> list[Marker2d]:
        """Boxes a, b and c."""
        s = self.settings
        return find_marker_2d(frame_2d(events.between(start_us, start_us + s.delta_t_2d_us), s), s)

    def _first_bin(self, period: int) -> int:
        """Number of the delta_t_ID bin, counted from t0, in which a period starts."""
        return period * self.settings.delta_t_whole_us // self.settings.delta_t_id_us

    def _count(self, events: CodedEvents, boxes: list[Box], start_us: int) -> tuple[Counts, Counts]:
        """ON and OFF counts of each box in the bins, counted from t0, that the period touches."""
        s = self.settings
        period = (start_us - self.t0_us) // s.delta_t_whole_us
        first = self._first_bin(period)
        n_bins = -(-(period + 1) * s.delta_t_whole_us // s.delta_t_id_us) - first
        if not boxes:
            return np.zeros((0, n_bins), np.int32), np.zeros((0, n_bins), np.int32)
        return self._counter(events, boxes, self.t0_us + first * s.delta_t_id_us, n_bins, s.delta_t_id_us, s.led_count)

    def _sighting(
        self, period: int, track: int, box: Box, marker: Marker2d | None, memory: _Memory, n_on: Counts, n_off: Counts
    ) -> Sighting:
        """Box g: one track's counts in, its row out."""
        s = self.settings
        period_us = self.t0_us + period * s.delta_t_whole_us
        inside, border, reason = self._decode(period, memory, n_on, n_off)
        good = [packet for packet in inside if packet.checksum_ok]
        ids = {packet.payload for packet in good}
        if len(ids) > 1:
            reason = "conflict"
        return Sighting(
            t_us=period_us, track=track, x=box[0], y=box[1], w=box[2], h=box[3],
            id=good[0].payload if len(ids) == 1 else None,
            reason=None if len(ids) == 1 else reason,
            n_packets=len(good),
            packets=tuple(packet for packet in inside if packet.payload is not None),
            border_packets=tuple(packet for packet in border if packet.payload is not None),
            marker_2d_id=marker.id if marker else None,
            corners=marker.corners if marker else None,
            rvec=marker.rvec if marker else None,
            tvec=marker.tvec if marker else None,
        )  # fmt: skip

    def _decode(
        self, period: int, memory: _Memory, n_on: Counts, n_off: Counts
    ) -> tuple[list[Packet], list[Packet], Reason]:
        """Packets whole inside the period, packets across its start, and the period's reason."""
        s = self.settings
        first = self._first_bin(period)
        if memory.period == period - 1:
            n_on, n_off, first = _joined(memory, n_on, n_off, first, first * s.delta_t_id_us
                                         < period * s.delta_t_whole_us)  # fmt: skip
        conventions = (memory.convention,) if memory.convention else s.conventions
        packets, why = decode_packets(
            n_on, n_off, self.t0_us + first * s.delta_t_id_us, s.delta_t_id_us, s.packet_format,
            conventions=conventions, gate=s.led_gate, latency_us=s.latency_us,
        )  # fmt: skip
        period_us = self.t0_us + period * s.delta_t_whole_us
        new = [p for p in packets if p.edge_us > memory.read_until_us and p.reason != "cut"]
        inside = [p for p in new if p.start_us >= period_us]
        border = [p for p in new if p.start_us < period_us]
        reasons: list[Reason] = [p.reason for p in inside if p.reason is not None]
        if any(p.reason == "cut" or p.start_us < period_us for p in packets):
            reasons.append("cut")
        reasons.append(why or "no_start")
        if new:
            memory.read_until_us = max(p.edge_us for p in new) + int(s.packet_format.chip_us)
        self._remember(memory, period, n_on, n_off, new)
        return inside, border, max(reasons, key=REASONS.index)

    def _remember(self, memory: _Memory, period: int, n_on: Counts, n_off: Counts, new: list[Packet]) -> None:
        """Keep the counts that a packet across the border needs, and the convention once one is known."""
        s = self.settings
        f = s.packet_format
        keep = int((f.packet_us + (f.start_bits + 2) * 2 * f.chip_us) / s.delta_t_id_us) + 2
        memory.period, memory.n_on, memory.n_off = period, n_on[-keep:], n_off[-keep:]
        read = {p.manchester for p in new if p.checksum_ok}
        # Bits that are all alike say nothing of the convention.
        if len(read) == 1 and memory.convention is None and any(p.payload != 0 for p in new if p.checksum_ok):
            memory.convention = read.pop()


def _joined(memory: _Memory, n_on: Counts, n_off: Counts, first: int, shares_bin: bool) -> tuple[Counts, Counts, int]:
    """Kept and new counts in, one row of both out; a bin across the border is added up."""
    kept_on, kept_off = memory.n_on, memory.n_off
    if shares_bin and kept_on.size:
        n_on, n_off = n_on.copy(), n_off.copy()
        n_on[0] += kept_on[-1]
        n_off[0] += kept_off[-1]
        kept_on, kept_off = kept_on[:-1], kept_off[:-1]
    return np.concatenate([kept_on, n_on]), np.concatenate([kept_off, n_off]), first - kept_on.size


def lend_boxes(regions: list[Box], markers: list[Box], width: int, height: int) -> list[tuple[Box, int | None]]:
    """Blinking regions and boxes of 2D markers in; boxes to read, each with its marker's number or None, out.

    A 2D marker takes over the regions that overlap it: its box is the hull of both, so that a moving
    marker is covered over the whole period. It stands alone where the region is much larger than it,
    or holds two markers. A marker without a region makes one.

    Examples
    --------
    >>> lend_boxes([(10, 10, 5, 5), (50, 50, 4, 4)], [(8, 8, 10, 10)], 100, 100)
    [((8, 8, 10, 10), 0), ((50, 50, 4, 4), None)]
    """
    overlaps = [[_overlap(region, marker) for marker in markers] for region in regions]
    lent: list[tuple[Box, int | None]] = []
    for m, marker in enumerate(markers):
        x0, y0, x1, y1 = marker[0], marker[1], marker[0] + marker[2], marker[1] + marker[3]
        for region, shared in zip(regions, overlaps, strict=True):
            x, y, w, h = region
            if shared[m] and sum(area > 0 for area in shared) == 1 and w * h <= LENT_AREA * marker[2] * marker[3]:
                x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x + w), max(y1, y + h)
        x0, y0, x1, y1 = max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)
        lent.append(((x0, y0, x1 - x0, y1 - y0), m))
    rest = [(region, None) for region, shared in zip(regions, overlaps, strict=True) if not any(shared)]
    return lent + rest


def _overlap(a: Box, b: Box) -> int:
    """Two boxes in, the area they share out [px]."""
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(w, 0) * max(h, 0)


class PeriodReader(Protocol):
    """A receiver that is fed one period after the other."""

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """Read one period that starts at `start_us` [us]; return a sighting for each track."""


class ReaderSettings(Protocol):
    """Settings of a receiver beside the paper's, such as `soft_receiver.SoftSettings`."""

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""

    def start(self, t0_us: int) -> PeriodReader:
        """Make a receiver whose first period starts at `t0_us` [us]."""


def start_receiver(settings: ReceiverSettings | ReaderSettings, t0_us: int) -> PeriodReader:
    """Make the receiver that the settings describe.

    Parameters
    ----------
    settings : ReceiverSettings or other settings with a method ``start``
        Those of the paper's receiver, or of another one, such as `soft_receiver.SoftSettings`.
    t0_us : int
        Start of the first period [us].

    Returns
    -------
    callable
        Takes the start [us] and the events of each period in turn, and returns its sightings.
    """
    return Receiver(settings, t0_us) if isinstance(settings, ReceiverSettings) else settings.start(t0_us)


def recognise(
    chunks: Iterable[Events] | Events,
    settings: ReceiverSettings | ReaderSettings | None = None,
    *,
    t0_us: int | None = None,
) -> Iterator[Sighting]:
    """Read a stream of events and yield one sighting for each track and period.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE, or one such array
        In the order of time.
    settings : ReceiverSettings or SoftSettings, optional
        Which receiver reads, and how; None takes the paper's.
    t0_us : int, optional
        Start of the first period [us]; None takes the first event.

    Yields
    ------
    Sighting
    """
    settings = settings or ReceiverSettings()
    receiver: PeriodReader | None = None
    for start_us, events in windows(chunks, settings.delta_t_whole_us, t0_us=t0_us):
        if receiver is None:
            receiver = start_receiver(settings, start_us if t0_us is None else t0_us)
        yield from receiver(start_us, events)
