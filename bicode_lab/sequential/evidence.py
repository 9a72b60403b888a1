"""The evidence of one track: counts of its periods, and what is read from them.

A packet that is repeated is read from all counts of the track so far, up to a limit. The reading is given as soon as it
is believed: after one period near by, after many far away. Once there is a reading, it is compared with the counts of
each new period, and made anew from time to time. It is given up if a frame contradicts it, or if its value is not there
any more. Where all evidence together gives no reading, the last period alone is tried, and then each frame for itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bicode_lab.boxes import Box
from bicode_lab.recognition.decode import Reason, decode_packets
from bicode_lab.recognition.led_state import Counts
from bicode_lab.recognition.periods import PeriodGrid
from bicode_lab.sequential.fold import PHASES, Bins, line_power
from bicode_lab.sequential.frames import agreement, read_frames
from bicode_lab.sequential.reading import NOTHING, Agreement, FrameReading, Reading
from bicode_lab.sequential.repeated import QUIET_CHIPS, read_repeated
from bicode_lab.soft_receiver.line_code import BicodeLine

ESTABLISHED = 3
MIN_FRAMES = 2  # that must be sure before frames that are read for themselves are given: a lamp may look like one
MIN_UNREAD = 2  # periods in a row after which frames that cannot be read make a sighting
MAX_WAIT = 8  # periods until an established reading is made anew
PATIENCE = 4  # periods without a reading after which only each so-many-th period is read with all evidence
MAX_CONTRADICTION = 12.0  # [nat]
MAX_ABSENCE = 8.0  # [nat]
MIN_POWER = 12.0  # of the lines at the chip rate, which noise reaches once in 60 periods ...
MIN_RATIO = 3.0  # ... and over the power beside them
FEW_EVENTS, FEW_POWER = 200, 6.0  # fewer events are read with less power, as there are few such boxes in clutter
SAME_SIZE = 2.0  # boxes whose areas differ by more than this factor do not show the same light

Row = tuple[int, Counts, Counts, Box]
"""Number of a period, the ON and OFF counts of the track in its bins, and its box."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What the evidence of a track says in one period.

    Parameters
    ----------
    reading : Reading
        The reading of a packet that is repeated, or of the frames as a whole.
    frames : tuple of FrameReading, or None
        Frames that were read for themselves and are sure; None if the packet is repeated.
    reason : str or None
        Why there is no ID, one of `decode.REASONS`; None if there is one.
    n_periods : int
        Number of periods that were weighed.
    seen : tuple of 2 floats
        In which time of the period the light was in view [nominal chips].
    """

    reading: Reading
    frames: tuple[FrameReading, ...] | None
    reason: Reason | None
    n_periods: int
    seen: tuple[float, float]


class Evidence:
    """What the receiver remembers of a track.

    Parameters
    ----------
    line : BicodeLine
    grid : PeriodGrid
    longest : int
        Number of periods that are weighed together.
    """

    def __init__(self, line: BicodeLine, grid: PeriodGrid, longest: int) -> None:
        self._line, self._grid, self._longest = line, grid, longest
        self._rows: deque[Row] = deque(maxlen=longest)
        self._now: Bins  # counts of the last period
        self._frames_now: tuple[Reading, list[FrameReading]] | None = None  # its frames, once they have been read
        self._reading, self._n_weighed = NOTHING, 0
        self._agreed = 0  # times that the value was read anew
        self._waited = 0  # periods since it was read anew
        self._failed = 0  # periods without a reading
        self._unread = 0  # periods in a row with frames of the code that cannot be read
        self._absence = 0.0
        self._changes = False  # whether frames of the last period were read for themselves

    @property
    def is_read(self) -> bool:
        """Whether a repeated packet was read in the last period."""
        return self._agreed > 0

    def add(self, period: int, n_on: Counts, n_off: Counts, box: Box) -> None:
        """Add the counts of a period.

        Parameters
        ----------
        period : int
            Number of the period, larger than those before.
        n_on, n_off : ndarray of int32, shape (grid.n_bins(period),)
            Counts of its bins.
        box : Box
            Where they were counted [px].
        """
        self._rows.append((period, n_on, n_off, box))
        self._now, self._frames_now = self._bins([self._rows[-1]]), None
        while self._rows[0][0] <= period - self._longest:
            self._rows.popleft()

    def blinks(self) -> bool:
        """Return whether the last period has a line at the chip rate."""
        power, ratio = line_power(self._now, self._line.frame_chips)
        if self._now.counts.sum() < FEW_EVENTS:
            return power >= FEW_POWER
        return power >= MIN_POWER and ratio >= MIN_RATIO

    def read(self) -> Outcome | None:
        """Read the evidence.

        Returns
        -------
        Outcome or None
            None where nothing is there that sends frames of the code.
        """
        if self._failed > PATIENCE and (self._failed + 1) % PATIENCE and not self._changes and not self.blinks():
            self._failed += 1
            return None
        known = self._known()
        reading, agrees = known or self._repeated() or (None, None)
        if reading is not None and agrees is not None:
            self._absence = max(0.0, self._absence - agrees.presence)
            if self._absence > MAX_ABSENCE:
                self._rows.clear()
                self._reading, self._agreed, self._waited, self._absence = NOTHING, 0, 0, 0.0
                return None
            n_periods = len(self._rows) if known else self._n_weighed
            return Outcome(reading=reading, frames=None, reason=None, n_periods=n_periods, seen=self._seen())
        if not self._changes and self._failed > PATIENCE and self._failed % PATIENCE:
            return None
        whole, frames = self._frames()
        sure = tuple(frame for frame in frames if frame.is_sure) if whole.doubt is None else ()
        is_enough = len(sure) >= MIN_FRAMES or (self._changes and len(sure) > 0)
        self._changes = is_enough
        if is_enough:
            return Outcome(reading=whole, frames=sure, reason=None, n_periods=1, seen=self._seen())
        self._unread = self._unread + 1 if self._reading.is_structured else 0
        if self._unread < MIN_UNREAD:
            return None
        return Outcome(
            reading=self._reading, frames=None, reason=self._reading.doubt or "conflict", n_periods=self._n_weighed,
            seen=self._seen(),
        )  # fmt: skip

    def _known(self) -> tuple[Reading, Agreement] | None:
        """Return the reading of the periods before if it need not be made anew and agrees with the last period."""
        if not self._agreed or self._waited >= min(len(self._rows) // 2, MAX_WAIT):
            return None
        self._waited += 1
        agrees = agreement(self._reading, self._now, self._line)
        return (self._reading, agrees) if agrees.contradiction <= MAX_CONTRADICTION else None

    def _repeated(self) -> tuple[Reading, Agreement] | None:
        """Read the counts as a packet that is repeated; None if that is not believed."""
        self._failed += 1
        rows = list(self._rows)
        is_due = self._failed <= PATIENCE or self._failed % PATIENCE == 0
        everything = NOTHING
        for used in [rows, rows[-1:]] if len(rows) > 1 and is_due else [rows[-1:]]:
            reading = read_repeated(self._bins(used), self._line)
            if reading.is_misfit and replace(reading, is_seconded=True).doubt is None:
                reading = replace(reading, is_seconded=self._read_by_paper() == {reading.value})
            self._reading = reading
            self._n_weighed = len(used)
            if used is rows:
                everything = reading
            elif everything.doubt == "checksum" and everything.gain > reading.gain:
                continue  # all evidence together shows frames of the code, but not what they say
            if reading.doubt is not None or (used is not rows and len(rows) > 1 and not reading.is_beyond_chance):
                continue
            agrees = agreement(reading, self._now, self._line)
            if agrees.contradiction <= MAX_CONTRADICTION and not self._frames_differ(reading):
                if used is not rows:
                    self._rows = deque(used, self._longest)
                self._agreed, self._waited, self._failed = self._agreed + 1, 0, 0
                return reading, agrees
        self._agreed = 0
        return None

    def _frames_differ(self, reading: Reading) -> bool:
        """Return whether a frame of the last period, read for itself, says something else."""
        if self._agreed >= ESTABLISHED:
            return False
        whole, frames = self._frames()
        return whole.doubt is None and any(frame.is_sure and frame.value != reading.value for frame in frames)

    def _frames(self) -> tuple[Reading, list[FrameReading]]:
        """Read each frame of the last period, and the one across its start, for itself."""
        if self._frames_now is not None:
            return self._frames_now
        last, _, _, box = self._rows[-1]
        recent = self._bins([row for row in list(self._rows)[-2:] if row[0] > last - 2 and _alike(row[3], box)])
        whole, frames = read_frames(recent, self._line)
        if whole.doubt is None and whole.rival < read_repeated(recent, self._line).rival:
            whole, frames = NOTHING, []  # free frames explain more than equal ones do, if the levels are right
        self._frames_now = whole, frames
        return self._frames_now

    def _read_by_paper(self) -> set[int | None]:
        """Return the values that the paper's rule reads in the last period."""
        _, n_on, n_off, _ = self._rows[-1]
        half = PHASES // 2
        size = n_on.size // half * half
        on, off = (counts[:size].reshape(-1, half).sum(axis=1) for counts in (n_on, n_off))
        line = self._line
        packets, _ = decode_packets(
            on, off, 0, half * self._grid.bin_us, line.packet_format, conventions=line.conventions
        )
        return {packet.payload for packet in packets if packet.checksum_ok}

    def _seen(self) -> tuple[float, float]:
        """Return from when to when the light was in view in the last period: its events, and a start on either side."""
        at = np.flatnonzero(self._now.counts.any(axis=1))
        quiet = len(self._line.start_chips) + QUIET_CHIPS
        return (
            (float(self._now.chips[at[0]]) - quiet, float(self._now.chips[at[-1]]) + quiet) if at.size else (0.0, 0.0)
        )

    def _bins(self, rows: Sequence[Row]) -> Bins:
        """Return the counts of some periods."""
        numbers = [self._grid.first_bin(period) + np.arange(n_on.size) for period, n_on, _, _ in rows]
        counts = [np.stack([n_on, n_off], axis=1) for _, n_on, n_off, _ in rows]
        chips = (np.concatenate(numbers) + 0.5) * (self._grid.bin_us / self._line.chip_us)
        return Bins(np.asarray(chips, np.float64), np.concatenate(counts).astype(np.float64))


def _alike(first: Box, second: Box) -> bool:
    """Return whether two boxes are of about the same size, so that they can show the same light."""
    return max(first.area, second.area) <= SAME_SIZE * min(first.area, second.area)
