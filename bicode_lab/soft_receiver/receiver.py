"""The soft receiver beside the paper's: the same periods, boxes and tracks, another judgement.

    events of one period --+--> the paper's regions ----+
                           |                            +--> tracks -> marks of each -> folded -> ID
    events of a second ----+--> faint regions ----------+

A track's evidence is the marks of its box in the last `evidence_periods` periods: 1 asks
what one period can say, 30 combine about a second. A new track gets the evidence of its box from the
events still held.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events
from bicode_lab.recognition.decode import Packet
from bicode_lab.recognition.led_state import Counts, LedCounter
from bicode_lab.recognition.receiver import Box
from bicode_lab.recognition.regions import RegionFinder
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.recognition.sighting import Sighting
from bicode_lab.recognition.track import Tracker
from bicode_lab.soft_receiver.clock import lead_marks
from bicode_lab.soft_receiver.faint_regions import find_faint_regions
from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.line_code import BicodeLine
from bicode_lab.soft_receiver.repeated_packets import Limits, Reading, read_repeated_packets

GATE = 0.1  # share of a usual lead below which a bin says nothing
FIND_EVERY = 4  # periods from one search for faint regions to the next
MOST_EVENTS = 4_000_000  # held for faint regions: 64 MB


@dataclass(frozen=True, kw_only=True)
class SoftSettings:
    """One soft receiver.

    Parameters
    ----------
    receiver : ReceiverSettings
        Packet, sensor, period, regions and tracks, shared with the paper's receiver; 2D markers are not looked for.
    evidence_periods : int
        Periods whose marks are laid over each other for an ID.
    region_periods : int
        Periods whose events are searched for faint regions; 0 takes the paper's regions only.
    limits : Limits
        What is asked of a reading.
    read_every : int
        Read every n-th period only (n - 1, 2 n - 1, ... counted from the first); there is no sighting of the others.
        Most of the evidence is the same from one period to the next, and reading it takes most of the time.
    read_from : int
        Number of the first period that is read; 0 is the recording's first.
    search_every : int
        Make every n-th of the searches for faint regions only; in between, the regions found last stay.
    """

    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    evidence_periods: int = 30
    region_periods: int = 30
    limits: Limits = field(default_factory=Limits)
    read_every: int = 1
    read_from: int = 0
    search_every: int = 1

    def __post_init__(self) -> None:
        if self.evidence_periods < 1:
            raise ValueError(f"evidence_periods={self.evidence_periods} holds nothing to read; choose 1 or more")
        if self.region_periods < 0:
            raise ValueError(f"region_periods={self.region_periods} is negative; choose 0 or more")
        for name, least in (("read_every", 1), ("read_from", 0), ("search_every", 1)):
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} is too small; choose {least} or more")
        if self.receiver.packet_format.chip_us < PHASES:
            raise ValueError(
                f"f_id_hz={self.receiver.packet_format.f_id_hz:g} makes chips shorter than {PHASES} us, "
                "the soft receiver's bins a chip; choose a lower rate"
            )

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""
        return self.receiver.delta_t_whole_us

    def reads(self, period: int) -> bool:
        """Return whether the period with this number is read."""
        return period >= self.read_from and period % self.read_every == self.read_every - 1

    def start(self, t0_us: int) -> SoftReceiver:
        """Make a soft receiver whose first period starts at `t0_us` [us]."""
        return SoftReceiver(self, t0_us)


@dataclass
class _Evidence:
    """ON and OFF counts of a track, period by period."""

    rows: deque[tuple[int, Counts, Counts]]


class SoftReceiver:
    """Feed it period after period, as `recognition.Receiver`.

    Parameters
    ----------
    settings : SoftSettings
    t0_us : int
        Start of the first period [us].
    """

    def __init__(self, settings: SoftSettings, t0_us: int = 0) -> None:
        s = settings.receiver
        self.settings = settings
        self.t0_us = t0_us
        self.line = BicodeLine(packet_format=s.packet_format, conventions=s.conventions)
        self.bin_us = int(self.line.chip_us / PHASES)
        self._finder = RegionFinder(s)
        self._counter = LedCounter(s.width, s.height)
        self._tracker = Tracker(s.max_age, s.min_iou)
        self._evidence: dict[int, _Evidence] = {}
        self._held: deque[tuple[int, Events]] = deque()
        self._faint: list[Box] = []
        self._n_searches = 0
        self._next_period = 0

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """One period's start [us] and its events in, a sighting for each track out."""
        period = (start_us - self.t0_us) // self.settings.receiver.delta_t_whole_us
        self._tracker.skip(period - self._next_period)
        searched = self._next_period // FIND_EVERY == (period + 1) // FIND_EVERY and period > FIND_EVERY
        self._next_period = period + 1
        self._hold(period, events)
        regions = self._finder(events, start_us)
        if not searched:
            if self._n_searches % self.settings.search_every == 0:
                self._faint = self._find_faint()
            self._n_searches += 1
        boxes = join_boxes([(r.x, r.y, r.w, r.h) for r in regions], self._faint)
        tracks = self._tracker.update(boxes)
        alive = {track.number for track in self._tracker.tracks}
        self._evidence = {number: e for number, e in self._evidence.items() if number in alive}
        rows = self._count(period, events, boxes)
        sightings = []
        for box, track, n_on, n_off in zip(boxes, tracks, *rows, strict=True):
            if track.number not in self._evidence:
                self._evidence[track.number] = self._look_back(period, box)
            evidence = self._evidence[track.number]
            evidence.rows.append((period, n_on, n_off))
            if self.settings.reads(period):
                sightings.append(self._sighting(period, track.number, box, evidence))
        return sightings

    def _hold(self, period: int, events: Events) -> None:
        """Keep the period's events, and drop what is too old or too much."""
        longest = max(self.settings.region_periods, self.settings.evidence_periods)
        self._held.append((period, events))
        while self._held and self._held[0][0] <= period - longest:
            self._held.popleft()
        while len(self._held) > 1 and sum(part.size for _, part in self._held) > MOST_EVENTS:
            self._held.popleft()

    def _find_faint(self) -> list[Box]:
        """Boxes in which the events held keep a marker's clock."""
        s = self.settings.receiver
        if not self.settings.region_periods:
            return []
        newest = self._held[-1][0]
        parts = [part for period, part in self._held if period > newest - self.settings.region_periods]
        return find_faint_regions(np.concatenate(parts), self.line.chip_us, s.width, s.height)

    def _first_bin(self, period: int) -> int:
        """Number of the bin, counted from t0, in which a period starts."""
        return period * self.settings.receiver.delta_t_whole_us // self.bin_us

    def _count(self, period: int, events: Events, boxes: list[Box]) -> tuple[Counts, Counts]:
        """ON and OFF events of each box in the bins, counted from t0, that the period touches."""
        first = self._first_bin(period)
        end_us = (period + 1) * self.settings.receiver.delta_t_whole_us
        n_bins = -(-end_us // self.bin_us) - first
        return self._counter(events, boxes, self.t0_us + first * self.bin_us, n_bins, self.bin_us, "events")

    def _look_back(self, period: int, box: Box) -> _Evidence:
        """A new track's box in, its evidence of the periods before out."""
        evidence = _Evidence(deque(maxlen=self.settings.evidence_periods))
        for earlier, events in self._held:
            if period - self.settings.evidence_periods < earlier < period:
                n_on, n_off = self._count(earlier, events, [box])
                evidence.rows.append((earlier, n_on[0], n_off[0]))
        return evidence

    def _marks(self, period: int, evidence: _Evidence) -> tuple[int, npt.NDArray[np.int8]]:
        """A track's evidence in; number of its first bin and the marks from there on out."""
        rows = [row for row in evidence.rows if row[0] > period - self.settings.evidence_periods]
        first = self._first_bin(rows[0][0])
        last_row = rows[-1]
        both = np.zeros((2, self._first_bin(last_row[0]) - first + last_row[1].size), np.int64)
        for earlier, n_on, n_off in rows:
            place = self._first_bin(earlier) - first
            both[0, place : place + n_on.size] += n_on
            both[1, place : place + n_off.size] += n_off
        return first, lead_marks(both[0], both[1], GATE)

    def _sighting(self, period: int, track: int, box: Box, evidence: _Evidence) -> Sighting:
        """One track's evidence in, its row out."""
        first, marks = self._marks(period, evidence)
        reading = read_repeated_packets(marks, self.bin_us, self.line)
        doubt = self.settings.limits.doubt(reading)
        period_us = self.t0_us + period * self.settings.receiver.delta_t_whole_us
        packets = () if doubt else self._packets(reading, self.t0_us + first * self.bin_us, period_us)
        return Sighting(
            t_us=period_us, track=track, x=box[0], y=box[1], w=box[2], h=box[3],
            id=None if doubt else reading.value,
            reason=doubt, n_packets=len(packets), packets=packets,
        )  # fmt: skip

    def _packets(self, reading: Reading, first_us: int, period_us: int) -> tuple[Packet, ...]:
        """A reading in; its packets that are whole inside the period, where the tracked clock puts them, out."""
        f = self.settings.receiver.packet_format
        length_us = f.packet_us * (1 + reading.error_ppm * 1e-6)
        start_us = first_us + reading.start_us
        start_us += np.ceil((period_us - start_us) / length_us) * length_us
        packets = []
        while start_us + length_us <= period_us + self.settings.receiver.delta_t_whole_us:
            edge_us = start_us + 2 * f.start_bits * f.chip_us
            packets.append(
                Packet(round(start_us), round(start_us + length_us), reading.value, True, None, None, round(edge_us))
            )
            start_us += length_us
        return tuple(packets)


def join_boxes(regions: list[Box], faint: list[Box]) -> list[Box]:
    """The paper's regions and faint ones in; boxes to read out. Of two that overlap, the larger is read.

    Examples
    --------
    >>> join_boxes([(10, 10, 3, 3), (50, 50, 90, 90)], [(9, 9, 6, 6), (60, 60, 5, 5), (200, 9, 5, 5)])
    [(50, 50, 90, 90), (9, 9, 6, 6), (200, 9, 5, 5)]
    """

    def covers(a: Box, b: Box) -> bool:
        """Whether they overlap and the first is no smaller."""
        apart = a[0] >= b[0] + b[2] or b[0] >= a[0] + a[2] or a[1] >= b[1] + b[3] or b[1] >= a[1] + a[3]
        return not apart and a[2] * a[3] >= b[2] * b[3]

    kept = [region for region in regions if not any(covers(box, region) for box in faint)]
    return kept + [box for box in faint if not any(covers(region, box) for region in kept)]
