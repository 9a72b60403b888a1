"""When a reading that is known is given up, with agreements that are given."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.boxes import Box
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition.periods import PeriodGrid
from bicode_lab.sequential import evidence as module
from bicode_lab.sequential.evidence import MAX_WAIT, Evidence
from bicode_lab.sequential.fold import PHASES, Clock
from bicode_lab.sequential.reading import Agreement, Reading
from bicode_lab.soft_receiver.line_code import BicodeLine

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
