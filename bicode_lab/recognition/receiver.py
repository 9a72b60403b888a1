"""The paper's receiver as a whole (Fig. 2): it reads one period of events after the other.

A period goes three ways::

    frame of delta_t_2D         ArUco markers and their poses                         boxes a, b, c
    frames of delta_t_blinker   blinking regions, merged with the 2D markers, tracks  boxes d, e, f
    bins of delta_t_ID          ON and OFF counts of each box, packets                box g

Period k spans [t0 + k delta_t_whole, t0 + (k + 1) delta_t_whole), where t0 is the time of the first event. The ID of a
period uses only packets that lie whole inside it, as the paper buffers the events per period. The last counts of each
period are kept, so that a packet across the border between two periods is read as well, and once.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bicode_lab.boxes import Box, merge_boxes
from bicode_lab.events import Events, windows
from bicode_lab.marker.board import aruco_dictionary
from bicode_lab.marker.manchester import Convention
from bicode_lab.recognition.decode import REASONS, Packet, Reason, decode_packets
from bicode_lab.recognition.event_codes import CodedEvents, EventCoder
from bicode_lab.recognition.led_state import Counts
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, frame_2d
from bicode_lab.recognition.periods import PeriodCounter, PeriodGrid, TrackMemories
from bicode_lab.recognition.regions import RegionFinder
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.recognition.sighting import Sighting


@dataclass
class _Memory:
    """What the receiver remembers of a track from one period to the next."""

    period: int = -2  # number of the period that the kept counts end with
    n_on: Counts = field(default_factory=lambda: np.zeros(0, np.int32))
    n_off: Counts = field(default_factory=lambda: np.zeros(0, np.int32))
    convention: Convention | None = None
    read_until_us: int = -(2**62)  # packets whose first ON edge is no later than this were given out already


class Receiver:
    """The paper's recognition unit (III-B), called with one period of events after the other.

    Parameters
    ----------
    settings : ReceiverSettings
    t0_us : int
        Start of the first period [us].
    """

    def __init__(self, settings: ReceiverSettings, t0_us: int = 0) -> None:
        s = settings
        self.settings = settings
        self._grid = PeriodGrid(t0_us=t0_us, period_us=s.delta_t_whole_us, bin_us=s.delta_t_id_us)
        self._coder = EventCoder(s.width, s.height)
        self._beside = ThreadPoolExecutor(1)  # one thread, which ends with the receiver
        self._finder = RegionFinder(s)
        self._counter = PeriodCounter(self._grid, s.width, s.height, s.led_count)
        self._tracks: TrackMemories[_Memory] = TrackMemories(s.max_age, s.min_iou)
        self._n_cells = aruco_dictionary(s.dictionary).markerSize + 2

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """Read one period.

        Parameters
        ----------
        start_us : int
            Start of the period [us]; periods come in the order of time, and those without events may be left out.
        events : ndarray of EVENT_DTYPE, shape (n,)
            The events of the period.

        Returns
        -------
        list of Sighting
            One for each 2D marker and each region that blinks.

        Raises
        ------
        ValueError
            If events lie outside the sensor.
        """
        s = self.settings
        period = self._grid.period_at(start_us)
        self._tracks.start_period(period)
        coded = self._coder(events)
        search = self._beside.submit(self._find_markers, coded, start_us) if s.detect_2d else None
        regions = self._finder(coded, start_us)  # at the same time: OpenCV and the kernels release Python's lock
        markers = search.result() if search else []
        merged = merge_boxes(
            [region.box for region in regions],
            [marker.box(s.glow, self._n_cells) for marker in markers],
            s.width,
            s.height,
        )
        boxes = [box for box, _ in merged]
        tracks = self._tracks.update(boxes)
        counts = self._counter(period, coded, boxes)
        sightings = []
        for (box, which), track, n_on, n_off in zip(merged, tracks, *counts, strict=True):
            memory = self._tracks.recall(track, _Memory)
            marker = markers[which] if which is not None else None
            sightings.append(self._sighting(period, track.number, box, marker, memory, n_on, n_off))
        return sightings

    def _find_markers(self, events: CodedEvents, start_us: int) -> list[Marker2d]:
        """Find the 2D markers of the period that starts at `start_us` [us] (boxes a, b and c)."""
        s = self.settings
        return find_marker_2d(frame_2d(events.between(start_us, start_us + s.delta_t_2d_us), s), s)

    def _sighting(
        self, period: int, track: int, box: Box, marker: Marker2d | None, memory: _Memory, n_on: Counts, n_off: Counts
    ) -> Sighting:
        """Decode the counts of one track and make its sighting (box g)."""
        inside, border, reason = self._decode(period, memory, n_on, n_off)
        good = [packet for packet in inside if packet.checksum_ok]
        ids = {packet.payload for packet in good}
        if len(ids) > 1:
            reason = "conflict"
        return Sighting(
            t_us=self._grid.start_us(period), track=track, x=box.x, y=box.y, w=box.w, h=box.h,
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
        """Return the packets inside the period, those across its start, and why there is no ID if there is none."""
        s = self.settings
        first, period_us = self._grid.first_bin(period), self._grid.start_us(period)
        if memory.period == period - 1:
            shares_bin = self._grid.bin_start_us(first) < period_us
            n_on, n_off, first = _joined(memory, n_on, n_off, first, shares_bin)
        conventions = (memory.convention,) if memory.convention else s.conventions
        packets, why = decode_packets(
            n_on, n_off, self._grid.bin_start_us(first), s.delta_t_id_us, s.packet_format,
            conventions=conventions, gate=s.led_gate, latency_us=s.latency_us,
        )  # fmt: skip
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
        # A payload of 0 does not tell the convention: its bits are all alike, so that a shift by one chip turns the
        # chips of one convention into those of the other.
        if len(read) == 1 and memory.convention is None and any(p.payload != 0 for p in new if p.checksum_ok):
            memory.convention = read.pop()


def _joined(memory: _Memory, n_on: Counts, n_off: Counts, first: int, shares_bin: bool) -> tuple[Counts, Counts, int]:
    """Put the kept counts before the new ones; add up the two counts of a bin across the border."""
    kept_on, kept_off = memory.n_on, memory.n_off
    if shares_bin and kept_on.size:
        n_on, n_off = n_on.copy(), n_off.copy()
        n_on[0] += kept_on[-1]
        n_off[0] += kept_off[-1]
        kept_on, kept_off = kept_on[:-1], kept_off[:-1]
    return np.concatenate([kept_on, n_on]), np.concatenate([kept_off, n_off]), first - kept_on.size


class PeriodReader(Protocol):
    """A receiver that is called with one period of events after the other."""

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """Read the period that starts at `start_us` [us]; return its sightings."""


class ReaderSettings(Protocol):
    """Settings of a receiver other than the paper's, such as `soft_receiver.SoftSettings`."""

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""

    def start(self, t0_us: int) -> PeriodReader:
        """Make a receiver whose first period starts at `t0_us` [us]."""


def start_receiver(settings: ReceiverSettings | ReaderSettings, t0_us: int) -> PeriodReader:
    """Make the receiver that the settings describe.

    Parameters
    ----------
    settings : ReceiverSettings or SoftSettings
        Settings of the paper's receiver, or other settings with a method ``start``.
    t0_us : int
        Start of the first period [us].

    Returns
    -------
    PeriodReader
        It is called with the start [us] and the events of each period in turn, and returns the sightings.
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
        Settings of the receiver that reads; None takes the paper's receiver with its default settings.
    t0_us : int, optional
        Start of the first period [us]; None takes the time of the first event.

    Yields
    ------
    Sighting
        In the order of the periods.

    Raises
    ------
    ValueError
        If events lie outside the sensor, or time runs backwards.
    """
    settings = settings or ReceiverSettings()
    receiver: PeriodReader | None = None
    for start_us, events in windows(chunks, settings.delta_t_whole_us, t0_us=t0_us):
        if receiver is None:
            receiver = start_receiver(settings, start_us if t0_us is None else t0_us)
        yield from receiver(start_us, events)
