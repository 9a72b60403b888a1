"""The soft receiver: the periods, regions and tracks of the paper's receiver, with soft decisions.

In each period, the blinking regions of the paper's receiver and the faint regions become tracks. The evidence of a
track is the marks of its box in the last `evidence_periods` periods: 1 asks what a single period can say, 30 combine
about one second. The most likely packet in this evidence gives the ID, if it is believed.

A new track gets the evidence of its box from the events that are still held. Faint regions are searched for in the
events of the last `region_periods` periods.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import numpy.typing as npt

from bicode_lab.boxes import Box, keep_larger
from bicode_lab.events import Events
from bicode_lab.recognition.decode import Packet
from bicode_lab.recognition.led_state import Counts
from bicode_lab.recognition.periods import PeriodCounter, PeriodGrid, TrackMemories
from bicode_lab.recognition.regions import RegionFinder
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.recognition.sighting import Sighting
from bicode_lab.soft_receiver.clock import lead_marks
from bicode_lab.soft_receiver.faint_regions import find_faint_regions
from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.line_code import BicodeLine
from bicode_lab.soft_receiver.repeated_packets import Reading, doubt, read_repeated_packets

GATE = 0.1  # fraction of the lead of a usual edge below which a bin gives no mark
SEARCH_PERIODS = 4  # from one search for faint regions to the next
MAX_HELD_EVENTS = 4_000_000  # held for faint regions: 64 MB

Evidence = deque[tuple[int, Counts, Counts]]
"""Number of a period and the ON and OFF counts of a track in its bins, period by period."""


@dataclass(frozen=True, kw_only=True)
class SoftSettings:
    """Settings of one soft receiver.

    Parameters
    ----------
    receiver : ReceiverSettings
        Packet, sensor, period, regions and tracks, as for the paper's receiver; 2D markers are not searched for.
    evidence_periods : int
        Number of periods whose marks are laid over each other for an ID, 1 or more.
    region_periods : int
        Number of periods whose events are searched for faint regions; 0 uses the paper's regions only.
    read_every : int
        Read only every n-th period: numbers n - 1, 2 n - 1, ...; the others give no sightings. Most of the evidence is
        the same from one period to the next, and reading it takes most of the time.
    read_from : int
        Number of the first period that is read; 0 is the first period of the recording.
    search_every : int
        Make only every n-th search for faint regions; in between, the regions that were found last stay.

    Raises
    ------
    ValueError
        If a number is out of range, or if a chip is too short for the bins of the soft receiver.
    """

    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    evidence_periods: int = 30
    region_periods: int = 30
    read_every: int = 1
    read_from: int = 0
    search_every: int = 1

    def __post_init__(self) -> None:
        for name, least in (
            ("evidence_periods", 1), ("region_periods", 0), ("read_every", 1), ("read_from", 0), ("search_every", 1),
        ):  # fmt: skip
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} is too small; choose {least} or more")
        if self.receiver.packet_format.chip_us < PHASES:
            raise ValueError(
                f"f_id_hz={self.receiver.packet_format.f_id_hz:g} makes a chip shorter than {PHASES} us, so that the "
                f"{PHASES} bins of a chip are shorter than 1 us; choose a lower bit rate"
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


class SoftReceiver:
    """A soft receiver, called with one period of events after the other, as `recognition.Receiver` is.

    Parameters
    ----------
    settings : SoftSettings
    t0_us : int
        Start of the first period [us].
    """

    def __init__(self, settings: SoftSettings, t0_us: int = 0) -> None:
        s = settings.receiver
        self.settings = settings
        self._line = BicodeLine(packet_format=s.packet_format, conventions=s.conventions)
        bin_us = int(self._line.chip_us / PHASES)
        self._grid = PeriodGrid(t0_us=t0_us, period_us=s.delta_t_whole_us, bin_us=bin_us)
        self._finder = RegionFinder(s)
        self._counter = PeriodCounter(self._grid, s.width, s.height, "events")
        self._tracks: TrackMemories[Evidence] = TrackMemories(s.max_age, s.min_iou)
        self._held: deque[tuple[int, Events]] = deque()
        self._faint: list[Box] = []
        self._n_searches = 0

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
            One for each track that has a region; none if the settings say that this period is not read.

        Raises
        ------
        ValueError
            If events lie outside the sensor.
        """
        period, expected = self._grid.period_at(start_us), self._tracks.next_period
        self._tracks.start_period(period)
        self._hold(period, events)
        regions = self._finder(events, start_us)
        if period <= SEARCH_PERIODS or expected // SEARCH_PERIODS != (period + 1) // SEARCH_PERIODS:
            self._search_faint()
        boxes = keep_larger([region.box for region in regions], self._faint)
        tracks = self._tracks.update(boxes)
        counts = self._counter(period, events, boxes)
        sightings = []
        for box, track, n_on, n_off in zip(boxes, tracks, *counts, strict=True):
            evidence = self._tracks.recall(track, partial(self._look_back, period, box))
            evidence.append((period, n_on, n_off))
            if self.settings.reads(period):
                sightings.append(self._sighting(period, track.number, box, evidence))
        return sightings

    def _hold(self, period: int, events: Events) -> None:
        """Keep the events of the period, and drop those that are too old or too many."""
        longest = max(self.settings.region_periods, self.settings.evidence_periods)
        self._held.append((period, events))
        while self._held and self._held[0][0] <= period - longest:
            self._held.popleft()
        while len(self._held) > 1 and sum(part.size for _, part in self._held) > MAX_HELD_EVENTS:
            self._held.popleft()

    def _search_faint(self) -> None:
        """Search the held events for boxes in which they keep a marker's clock."""
        s = self.settings.receiver
        if self.settings.region_periods and self._n_searches % self.settings.search_every == 0:
            newest = self._held[-1][0]
            parts = [part for period, part in self._held if period > newest - self.settings.region_periods]
            self._faint = find_faint_regions(np.concatenate(parts), self._line.chip_us, s.width, s.height)
        self._n_searches += 1

    def _look_back(self, period: int, box: Box) -> Evidence:
        """Collect the evidence of a new track's box from the periods before."""
        evidence: Evidence = deque(maxlen=self.settings.evidence_periods)
        for earlier, events in self._held:
            if period - self.settings.evidence_periods < earlier < period:
                n_on, n_off = self._counter(earlier, events, [box])
                evidence.append((earlier, n_on[0], n_off[0]))
        return evidence

    def _marks(self, period: int, evidence: Evidence) -> tuple[int, npt.NDArray[np.int8]]:
        """Lay the counts of all periods onto one row of bins; return the number of its first bin and the marks."""
        rows = [row for row in evidence if row[0] > period - self.settings.evidence_periods]
        first = self._grid.first_bin(rows[0][0])
        last, n_on_last, _ = rows[-1]
        both = np.zeros((2, self._grid.first_bin(last) - first + n_on_last.size), np.int64)
        for earlier, n_on, n_off in rows:
            place = self._grid.first_bin(earlier) - first
            both[0, place : place + n_on.size] += n_on
            both[1, place : place + n_off.size] += n_off
        return first, lead_marks(both[0], both[1], GATE)

    def _sighting(self, period: int, track: int, box: Box, evidence: Evidence) -> Sighting:
        """Read the evidence of one track and make its sighting."""
        first, marks = self._marks(period, evidence)
        reading = read_repeated_packets(marks, self._grid.bin_us, self._line)
        reason = doubt(reading)
        packets = () if reason else self._packets(reading, self._grid.bin_start_us(first), period)
        return Sighting(
            t_us=self._grid.start_us(period), track=track, x=box.x, y=box.y, w=box.w, h=box.h,
            id=None if reason else reading.value,
            reason=reason, n_packets=len(packets), packets=packets,
        )  # fmt: skip

    def _packets(self, reading: Reading, first_us: int, period: int) -> tuple[Packet, ...]:
        """Return the packets that lie whole inside the period, at the times that the tracked clock gives them."""
        f = self.settings.receiver.packet_format
        period_us, end_us = self._grid.start_us(period), self._grid.start_us(period + 1)
        length_us = f.packet_us * (1 + reading.error_ppm * 1e-6)
        start_us = first_us + reading.start_us
        start_us += np.ceil((period_us - start_us) / length_us) * length_us
        packets = []
        while start_us + length_us <= end_us:
            edge_us = start_us + 2 * f.start_bits * f.chip_us
            packets.append(
                Packet(round(start_us), round(start_us + length_us), reading.value, True, None, None, round(edge_us))
            )
            start_us += length_us
        return tuple(packets)
