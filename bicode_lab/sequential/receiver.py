"""The sequential receiver: periods, regions that keep the clock, tracks, and the evidence of each track.

In each period it looks for regions in three ways (`lattice`, the paper's blinking regions, and `LatticeFinder.faint` in
the events of about a second that lie in none of these). Boxes become tracks (`tracks`); the evidence of a track follows
it, so that motion does not break it (`evidence`). Regions in which nothing sends frames of the code make no sighting.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bicode_lab.boxes import Box, merge_boxes
from bicode_lab.events import EVENT_DTYPE, Events, words
from bicode_lab.kernels import njit
from bicode_lab.marker.board import aruco_dictionary
from bicode_lab.recognition.decode import Packet
from bicode_lab.recognition.event_codes import CodedEvents, EventCoder
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, frame_2d
from bicode_lab.recognition.periods import PeriodCounter, PeriodGrid
from bicode_lab.recognition.regions import RegionFinder
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.recognition.sighting import Sighting
from bicode_lab.sequential.evidence import Evidence, Outcome
from bicode_lab.sequential.fold import PHASES
from bicode_lab.sequential.lattice import LatticeFinder
from bicode_lab.sequential.reading import Reading
from bicode_lab.sequential.tracks import Track, Tracks
from bicode_lab.soft_receiver.line_code import BicodeLine

EVIDENCE_COLUMNS = ("margin", "evidence_periods")
SEARCH_PERIODS = 4  # from one search for faint regions to the next
MAX_HELD_EVENTS = 1_000_000  # held for faint regions: 16 MB
GUARD_PX = 2  # events this near to a region are not held for faint regions


@dataclass(frozen=True, kw_only=True)
class SequentialSighting(Sighting):
    """What the sequential receiver says of one track in one period.

    Parameters
    ----------
    margin : float
        Logarithm of the odds of the ID against any other [nat]; 0 if there is no ID.
    evidence_periods : int
        Number of periods that were weighed for it.
    """

    margin: float = 0.0
    evidence_periods: int = 0

    def row(self) -> dict[str, Any]:
        """Return the row of the table of sightings, with how sure it is."""
        return {**super().row(), "margin": round(self.margin, 1), "evidence_periods": self.evidence_periods}


@dataclass(frozen=True, kw_only=True)
class SequentialSettings:
    """Settings of one sequential receiver.

    Parameters
    ----------
    receiver : ReceiverSettings
        Packet, sensor, period, 2D markers and how long a track lives, as for the paper's receiver.
    evidence_periods : int
        Largest number of periods that are weighed together for an ID.
    region_periods : int
        Number of periods whose events are searched for faint regions; 0 does not search for them.

    Raises
    ------
    ValueError
        If a number is out of range, or if a chip is too short for the bins.
    """

    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    evidence_periods: int = 30
    region_periods: int = 30

    def __post_init__(self) -> None:
        for name, least in (("evidence_periods", 1), ("region_periods", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} is too small; choose {least} or more")
        if self.receiver.packet_format.chip_us < PHASES:
            raise ValueError(
                f"f_id_hz={self.receiver.packet_format.f_id_hz:g} makes a chip shorter than {PHASES} us, so that its "
                f"{PHASES} bins are shorter than 1 us; choose a lower bit rate"
            )

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""
        return self.receiver.delta_t_whole_us

    def start(self, t0_us: int) -> SequentialReceiver:
        """Make a sequential receiver whose first period starts at `t0_us` [us]."""
        return SequentialReceiver(self, t0_us)


class SequentialReceiver:
    """A sequential receiver, called with one period of events after the other, as `recognition.Receiver` is.

    Parameters
    ----------
    settings : SequentialSettings
    t0_us : int
        Start of the first period [us].
    """

    def __init__(self, settings: SequentialSettings, t0_us: int = 0) -> None:
        s = settings.receiver
        self.settings = settings
        self._line = BicodeLine(packet_format=s.packet_format, conventions=s.conventions)
        bin_us = max(1, int(self._line.chip_us / PHASES))
        self._grid = PeriodGrid(t0_us=t0_us, period_us=s.delta_t_whole_us, bin_us=bin_us)
        self._lattice = LatticeFinder(self._line.chip_us, self._line.frame_chips, s.width, s.height)
        self._coder = EventCoder(s.width, s.height)
        self._beside = ThreadPoolExecutor(1)  # one thread, which ends with the receiver
        self._finder = RegionFinder(s)
        self._counter = PeriodCounter(self._grid, s.width, s.height, "events")
        self._tracks: Tracks[Evidence] = Tracks(s.max_age)
        self._next_period = 0
        self._held: deque[tuple[int, Events]] = deque()
        self._faint: list[Box] = []

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
            One for each 2D marker, and for each track that sends frames of the code.

        Raises
        ------
        ValueError
            If events lie outside the sensor.
        """
        s = self.settings.receiver
        period, expected = self._grid.period_at(start_us), self._next_period
        self._tracks.advance(period + 1 - expected)
        self._next_period = period + 1
        coded = self._coder(events)  # checks that events are on the sensor
        search = self._beside.submit(self._find_markers, start_us, coded) if s.detect_2d else None
        blinking = [region.box for region in self._finder(coded, start_us)]
        clocked = [region.box for region in self._lattice(events)]
        regions = clocked + _apart(blinking, clocked)
        self._hold(period, events, regions)
        if period <= SEARCH_PERIODS or expected // SEARCH_PERIODS != (period + 1) // SEARCH_PERIODS:
            self._search_faint()
        regions += _apart(self._faint, regions)
        markers = search.result() if search else []
        n_cells = aruco_dictionary(s.dictionary).markerSize + 2
        merged = merge_boxes(regions, [marker.box(s.glow, n_cells) for marker in markers], s.width, s.height)
        found = [box for box, _ in merged]
        tracks = self._tracks.update(found, lambda box: self._new_evidence(period, box))
        unseen = self._unseen(found)
        boxes = found + [box for box, _ in unseen]
        counts = self._counter(period, coded, boxes)
        numbers = [which for _, which in merged] + [None] * len(unseen)
        sure = {*clocked, *self._faint}
        sightings: list[Sighting] = []
        for box, track, which, n_on, n_off in zip(
            boxes, tracks + [track for _, track in unseen], numbers, *counts, strict=True
        ):
            track.memory.add(period, n_on, n_off, box)
            is_worth = box in sure or which is not None or track.memory.is_read or track.memory.blinks()
            outcome = track.memory.read() if is_worth else None
            marker = markers[which] if which is not None else None
            if marker is not None or (outcome is not None and (track.age == 0 or outcome.reason is None)):
                sightings.append(self._sighting(period, track.number, box, marker, outcome))
        return sightings

    def _find_markers(self, start_us: int, events: CodedEvents) -> list[Marker2d]:
        """Find the 2D markers of the period that starts at `start_us` [us] (boxes a, b and c of Fig. 2)."""
        s = self.settings.receiver
        return find_marker_2d(frame_2d(events.between(start_us, start_us + s.delta_t_2d_us), s), s)

    def _hold(self, period: int, events: Events, regions: Sequence[Box]) -> None:
        """Keep the events of the period that lie in no region, and drop those that are too old or too many."""
        s = self.settings.receiver
        inside = np.zeros((s.height, s.width), bool)
        for box in regions:
            inside[
                max(box.y - GUARD_PX, 0) : box.bottom + GUARD_PX, max(box.x - GUARD_PX, 0) : box.right + GUARD_PX
            ] = 1
        self._held.append((period, _outside(words(events), inside).view(EVENT_DTYPE)[:, 0]))
        while self._held and self._held[0][0] <= period - self.settings.region_periods:
            self._held.popleft()
        while len(self._held) > 1 and sum(part.size for _, part in self._held) > MAX_HELD_EVENTS:
            self._held.popleft()

    def _search_faint(self) -> None:
        """Search the held events for boxes in which they keep the clock."""
        s = self.settings.receiver
        if self._held:
            together = np.concatenate([part for _, part in self._held])
            self._faint = [_wider(region.box, 2, s.width, s.height) for region in self._lattice.faint(together)]

    def _new_evidence(self, period: int, box: Box) -> Evidence:
        """Make the evidence of a new track; that of a faint region begins with the events that are still held."""
        evidence = Evidence(self._line, self._grid, self.settings.evidence_periods)
        if box in self._faint:
            for earlier, events in self._held:
                if period - self.settings.evidence_periods < earlier < period:
                    n_on, n_off = self._counter(earlier, events, [box])
                    evidence.add(earlier, n_on[0], n_off[0], box)
        return evidence

    def _unseen(self, found: Sequence[Box]) -> list[tuple[Box, Track[Evidence]]]:
        """Return the tracks that were read before and have no region now, each with the box where it should be."""
        s = self.settings.receiver
        unseen: list[tuple[Box, Track[Evidence]]] = []
        for track in self._tracks.alive:
            box = track.predicted().clipped(s.width, s.height)
            taken = [*found, *(other for other, _ in unseen)]
            if track.age and track.memory.is_read and not box.is_empty and not any(box.overlaps(o) for o in taken):
                unseen.append((box, track))
        return unseen

    def _sighting(
        self, period: int, track: int, box: Box, marker: Marker2d | None, outcome: Outcome | None
    ) -> SequentialSighting:
        """Make the sighting of one track."""
        packets: list[Packet] = []
        border: list[Packet] = []
        start_us = self._grid.start_us(period)
        if outcome is not None and outcome.reason is None:
            every = self._packets(outcome, period)
            packets = [packet for packet in every if packet.start_us >= start_us]
            border = [packet for packet in every if packet.start_us < start_us < packet.end_us]
        values = {packet.payload for packet in packets}
        if outcome is not None and outcome.frames is None and outcome.reason is None:
            values = {outcome.reading.value}
        reason = "no_events" if outcome is None else outcome.reason
        if reason is None and len(values) != 1:
            reason = "conflict" if values else "cut"
        return SequentialSighting(
            t_us=start_us, track=track, x=box.x, y=box.y, w=box.w, h=box.h,
            id=values.pop() if reason is None else None, reason=reason,
            n_packets=len(packets), packets=tuple(packets), border_packets=tuple(border),
            marker_2d_id=marker.id if marker else None,
            corners=marker.corners if marker else None,
            rvec=marker.rvec if marker else None,
            tvec=marker.tvec if marker else None,
            margin=outcome.reading.margin if outcome and reason is None else 0.0,
            evidence_periods=outcome.n_periods if outcome else 0,
        )  # fmt: skip

    def _packets(self, outcome: Outcome, period: int) -> list[Packet]:
        """Return the packets that were read for themselves, or those of a repeated one that lie in the period."""
        reading = outcome.reading
        assert reading.clock is not None
        if outcome.frames is not None:
            return [self._packet(frame.value, frame.begin, reading) for frame in outcome.frames]
        length = self._line.frame_chips / reading.clock.rate
        low, high = ((self._grid.start_us(k) - self._grid.t0_us) / self._line.chip_us for k in (period, period + 1))
        came, went = outcome.seen
        if outcome.n_periods > 1:  # a packet may have begun in the period before
            low, came = low - length, min(came, low - length)
        first = int(np.ceil((max(low, came) - reading.begin) / length))
        numbers = range(first, int(np.floor((min(high, went) - reading.begin) / length)))
        return [self._packet(reading.value, reading.begin + k * length, reading) for k in numbers]

    def _packet(self, value: int | None, begin: float, reading: Reading) -> Packet:
        """Return the packet that begins at a moment [nominal chips]."""
        assert reading.clock is not None
        chip_us = self._line.chip_us / reading.clock.rate
        start_us = self._grid.t0_us + begin * self._line.chip_us
        end_us, edge_us = (start_us + n * chip_us for n in (self._line.frame_chips, len(self._line.start_chips)))
        return Packet(round(start_us), round(end_us), value, True, None, None, round(edge_us))


@njit(cache=True, nogil=True)
def _outside(events, inside):  # type: ignore[no-untyped-def]
    """Return the events, given as `events.words`, whose pixels lie in no region."""
    kept = np.empty_like(events)
    n = 0
    for i in range(events.shape[0]):
        word = events[i, 0]
        kept[n, 0], kept[n, 1] = word, events[i, 1]
        n += not inside[(word >> 16) & 0xFFFF, word & 0xFFFF]
    return kept[:n].copy()


def _apart(boxes: Sequence[Box], others: Sequence[Box]) -> list[Box]:
    """Return the boxes that overlap none of the others."""
    return [box for box in boxes if not any(box.overlaps(other) for other in others)]


def _wider(box: Box, by_px: int, width: int, height: int) -> Box:
    """Return a box with a border of so many pixels, as far as it lies on the sensor."""
    return Box(box.x - by_px, box.y - by_px, box.w + 2 * by_px, box.h + 2 * by_px).clipped(width, height)
