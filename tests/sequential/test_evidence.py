"""When a reading that is known is given up, with agreements that are given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.boxes import Box
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition.periods import PeriodGrid
from bicode_lab.sequential import evidence as module
from bicode_lab.sequential.evidence import MAX_WAIT, Evidence
from bicode_lab.sequential.fold import PHASES, Clock
from bicode_lab.sequential.frames import agreement
from bicode_lab.sequential.reading import Agreement, Reading
from bicode_lab.sequential.repeated import read_repeated
from bicode_lab.soft_receiver.line_code import BicodeLine

from .light import bins_of, marker, merge, noise

LINE = BicodeLine(packet_format=PacketFormat())
BIN_US = int(LINE.chip_us / PHASES)
GRID = PeriodGrid(t0_us=0, period_us=33_000, bin_us=BIN_US)
SURE = Reading(
    value=37, check=True, gain=90, rival=90, place=50, margin=40, n_frames=9, clock=Clock(1.0, np.zeros(2))
)  # fmt: skip


class Track:
    """Evidence whose readings and agreements are given, and how often it was read anew."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.evidence, self.period, self.times_read = Evidence(LINE, GRID, 30), 0, 0
        self.agrees = Agreement(presence=9.0, contradiction=0.0)
        monkeypatch.setattr(module, "read_repeated", self._read)
        monkeypatch.setattr(module, "read_frames", lambda bins, line: (module.NOTHING, []))
        monkeypatch.setattr(module, "agreement", lambda reading, bins, line: self.agrees)

    def _read(self, bins: object, line: object) -> Reading:
        self.times_read += 1
        return SURE

    def __call__(self, presence: float = 9.0, contradiction: float = 0.0) -> bool:
        """Add a period; return whether there is a reading."""
        self.agrees = Agreement(presence=presence, contradiction=contradiction)
        n_bins = GRID.n_bins(self.period)
        self.evidence.add(self.period, np.ones(n_bins, np.int32), np.ones(n_bins, np.int32), Box(0, 0, 4, 4))
        self.period += 1
        return self.evidence.read() is not None


def test_a_value_that_is_absent_by_8_nats_in_all_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    track = Track(monkeypatch)
    assert [track() for _ in range(6)] == [True] * 6
    assert [track(presence=presence) for presence in (-3.9, -3.9)] == [True, True]
    assert not track(presence=-0.3)


def test_presence_makes_up_for_absence(monkeypatch: pytest.MonkeyPatch) -> None:
    track = Track(monkeypatch)
    assert [track(presence=presence) for presence in (9, -7, 7, -7, 7, -7)] == [True] * 6


def test_a_frame_that_contradicts_by_12_nats_asks_for_a_new_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    track = Track(monkeypatch)
    for _ in range(40):
        track()
    for _ in range(MAX_WAIT + 1):
        if track.evidence._waited != 1:  # it is 1 where the last reading is that of the period before
            track()
    assert track.evidence._waited == 1
    before = track.times_read
    track(contradiction=11.9)
    assert track.times_read == before
    track(contradiction=12.1)
    assert track.times_read > before


@pytest.mark.parametrize(
    ("sent", "misfit", "n_frames", "is_read"),
    [(37, 3.9, 9, True), (37, 4.1, 9, True), (38, 3.9, 9, True), (38, 4.1, 9, False), (38, 2.1, 3, False),
     (37, 2.1, 3, True), (38, 1.9, 3, True)],
)  # fmt: skip
def test_a_misfit_does_not_count_if_the_papers_rule_reads_the_same(
    monkeypatch: pytest.MonkeyPatch, sent: int, misfit: float, n_frames: float, is_read: bool
) -> None:
    """The counts send one value or another, and the reading, which is given, says 37."""
    reading = replace(SURE, misfit=misfit, n_frames=n_frames)
    monkeypatch.setattr(module, "read_repeated", lambda bins, line: reading)
    monkeypatch.setattr(module, "read_frames", lambda bins, line: (module.NOTHING, []))
    monkeypatch.setattr(module, "agreement", lambda reading, bins, line: Agreement(presence=9.0, contradiction=0.0))
    bins = bins_of(marker(sent, PacketFormat(), GRID.period_us, np.random.default_rng(1)), LINE.chip_us)
    n_on, n_off = bins.counts.T.astype(np.int32)
    evidence = Evidence(LINE, GRID, 30)
    evidence.add(0, n_on, n_off, Box(0, 0, 4, 4))
    assert (evidence.read() is not None) == is_read


def test_a_seconded_reading_still_needs_its_margin() -> None:
    for weak in ({"margin": 7.9}, {"conflict": 8.1}, {"is_periodic": True, "n_frames": 5.9}, {"check": False}):
        assert replace(SURE, misfit=9.0, is_seconded=True, **weak).doubt is not None
    assert replace(SURE, misfit=9.0, is_seconded=True).doubt is None


@pytest.mark.parametrize(("share", "is_there"), [(2.0, True), (1.0, True), (0.3, True), (0.0, False)])
def test_a_light_that_fades_is_still_there(share: float, is_there: bool) -> None:
    """A reading of bright frames, compared with others that have a share of their events and the same noise."""
    rng = np.random.default_rng(2)
    bright = bins_of(
        merge(marker(37, PacketFormat(), 99_000, rng, on=10, off=10), noise(500, 99_000, rng)), LINE.chip_us
    )
    reading = read_repeated(bright, LINE)
    assert reading.doubt is None
    later = marker(37, PacketFormat(), 99_000, rng, on=10 * share, off=10 * share)
    agrees = agreement(reading, bins_of(merge(later, noise(500, 99_000, rng)), LINE.chip_us), LINE)
    assert (agrees.presence > 0) == is_there
