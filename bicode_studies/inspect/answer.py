"""Say in words what a receiver made of a recording: which markers, where and how long, or why there is none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from bicode_lab.events import Events
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_studies.inspect.time_unit import remark_on_times

BEGIN_US, MOST_BEGIN_EVENTS = 2_000_000, 4_000_000  # what is kept of the beginning: 64 MB at most
MOST_IDS = 20  # lines of the answer
FEW_PERIODS = 10  # an ID that is read in one of so many periods may be read by chance
CAUSES = {
    "no_events": "the light of these regions never switches as a whole; the marker may be too far or too dim, or it is "
    "texture that moves",
    "no_start": "their light is never off as long as a start takes: it may blink at another rate or with another "
    "start, or be a lamp",
    "cut": "no whole packet lies in a period; choose a longer --delta-t-whole-us, or check rate and width",
    "manchester": "after the start not every bit switches the light: check rate, start and width, or there is too much "
    "noise",
    "checksum": "bits are read, but the checksum is wrong: check its kind, the convention, the width and the bit order",
    "conflict": "a period holds two different IDs: two markers may lie in one region, or the width is wrong",
}


@dataclass
class Seen:
    """Where and when one ID, or one 2D marker without an ID, was seen."""

    n_periods: int = 0
    first_us: int = 0
    last_us: int = 0
    tracks: set[int] = field(default_factory=set)
    latest: Sighting | None = None
    patterns: Counter[int] = field(default_factory=Counter)
    latest_pose: Sighting | None = None

    def add(self, sighting: Sighting) -> None:
        """Add a sighting; two of the same period count once."""
        if not self.n_periods or sighting.t_us != self.last_us:
            self.n_periods += 1
        self.first_us = self.first_us if self.tracks else sighting.t_us
        self.last_us, self.latest = sighting.t_us, sighting
        self.tracks.add(sighting.track)
        if sighting.marker_2d_id is not None:
            self.patterns[sighting.marker_2d_id] += 1
        if sighting.tvec is not None:
            self.latest_pose = sighting


class Answer:
    """Listener to a receiver: events and sightings pass through it, and it knows the answer afterwards.

    Parameters
    ----------
    settings : ReceiverSettings
        Settings that were tried.

    Attributes
    ----------
    ids : dict of int to Seen
        All IDs that were read.
    patterns : dict of int to Seen
        2D markers in periods without an ID.
    reasons : Counter
        Why regions had no ID, and how often.
    n_events, first_us, last_us : int
        Number of events, and times of the first and the last one [us].
    begin : list of ndarray of EVENT_DTYPE
        The events of the first seconds, to try other settings on.
    """

    def __init__(self, settings: ReceiverSettings) -> None:
        self.settings = settings
        self.ids: dict[int, Seen] = {}
        self.patterns: dict[int, Seen] = {}
        self.reasons: Counter[str] = Counter()
        self.n_events = self.first_us = self.last_us = 0
        self.step_us = 0  # greatest common divisor of the times since the first event
        self.begin: list[Events] = []
        self._periods: set[int] = set()

    def events(self, chunks: Iterable[Events]) -> Iterator[Events]:
        """Pass chunks of events on.

        Parameters
        ----------
        chunks : iterable of ndarray of EVENT_DTYPE

        Yields
        ------
        ndarray of EVENT_DTYPE
        """
        for chunk in chunks:
            if chunk.size:
                self.first_us = self.first_us if self.n_events else int(chunk["t"][0])
                self.last_us = int(chunk["t"][-1])
                if self.last_us - self.first_us <= BEGIN_US and self.n_events <= MOST_BEGIN_EVENTS:
                    self.begin.append(chunk)
                self.n_events += chunk.size
                if self.step_us != 1:
                    self.step_us = int(np.gcd(self.step_us, np.gcd.reduce(chunk["t"] - self.first_us)))
            yield chunk

    def sightings(self, sightings: Iterable[Sighting]) -> Iterator[Sighting]:
        """Pass sightings on.

        Parameters
        ----------
        sightings : iterable of Sighting
            In the order of time.

        Yields
        ------
        Sighting
        """
        for one in sightings:
            self._periods.add(one.t_us)
            if one.id is not None:
                self.ids.setdefault(one.id, Seen()).add(one)
            else:
                self.reasons[one.reason or "no_events"] += 1
                if one.marker_2d_id is not None:
                    self.patterns.setdefault(one.marker_2d_id, Seen()).add(one)
            yield one

    def explain(self) -> None:
        """Count why the regions of the first seconds have no ID, by the paper's receiver, which names each region."""
        for one in recognise(self.begin, self.settings):
            self.reasons[one.reason or "no_events"] += 1

    @property
    def n_periods(self) -> int:
        """Number of periods from the first event to the last one."""
        return (self.last_us - self.first_us) // self.settings.delta_t_whole_us + 1 if self.n_events else 0

    def remark_on_times(self) -> str | None:
        """Return a remark if the times are hardly in microseconds."""
        return remark_on_times(self.n_events, self.last_us - self.first_us, self.step_us)

    def lines(self, times_are_told: bool = False) -> list[str]:
        """Return the answer, line by line.

        Parameters
        ----------
        times_are_told : bool
            Whether the user knows already what is odd about the times.

        Returns
        -------
        list of str
        """
        if not self.n_events:
            return ["no marker: the recording holds no events"]
        seconds, period_ms = (self.last_us - self.first_us) * 1e-6, self.settings.delta_t_whole_us / 1e3
        head = f"{self.n_events:,} events in {seconds:.3f} s: {self.n_periods:,} x {period_ms:g} ms"
        if not self.ids:
            return [head, *self._none(times_are_told)]
        found = sorted(self.ids.items(), key=lambda item: -item[1].n_periods)
        lines = [head, *(self._found(f"ID {number}", seen) for number, seen in found[:MOST_IDS])]
        if len(found) > MOST_IDS:
            lines.append(f"and {len(found) - MOST_IDS} more IDs, each in fewer periods")
        return lines + self._patterns_alone()

    def _found(self, name: str, seen: Seen) -> str:
        """Return the line on one marker."""
        begin, end = ((t - self.first_us) * 1e-6 for t in (seen.first_us, seen.last_us))
        end += self.settings.delta_t_whole_us * 1e-6
        line = f"{name}: in {seen.n_periods:,} of {self.n_periods:,} periods, from {begin:.3f} s to {end:.3f} s"
        one = seen.latest
        if one is not None:
            tracks = f"track {one.track}" if len(seen.tracks) == 1 else f"{len(seen.tracks)} tracks"
            line += f"; {tracks}, at last {one.w} x {one.h} px at ({one.x}, {one.y})"
        for number, count in seen.patterns.most_common(1):
            line += f"; 2D marker {number} in {count:,}"
        if seen.latest_pose is not None and seen.latest_pose.tvec is not None:
            x, y, z = seen.latest_pose.tvec
            line += f", at last {z:.2f} m away ({x:+.2f} m right, {y:+.2f} m down)"
        if seen.n_periods == 1 and self.n_periods >= FEW_PERIODS:
            line += "; one period only: it may be read by chance"
        return line

    def _patterns_alone(self) -> list[str]:
        """Return a line for each 2D marker that was seen and never together with an ID."""
        known = {number for seen in self.ids.values() for number in seen.patterns}
        alone = {number: seen for number, seen in self.patterns.items() if number not in known}
        return [self._found(f"2D marker {number} without an ID", seen) for number, seen in sorted(alone.items())]

    def _none(self, times_are_told: bool) -> list[str]:
        """Return the lines that say what was tried where there is no ID, and why that may be."""
        line = f"no marker: tried {in_words(self.settings)}"
        times = None if times_are_told else self.remark_on_times()
        if not self.reasons:
            quiet = "nothing blinks anywhere, and no 2D marker is seen"
            return [f"{line}; {quiet}", *([times] if times else [])]
        n = sum(self.reasons.values())
        ((most, count),) = self.reasons.most_common(1)
        which = f"{n:,} regions blinked" if n > 1 else "1 region blinked"
        line += f"; {which} in {len(self._periods):,} periods, {count:,} of them with reason {most}: {CAUSES[most]}"
        return [line, *self._patterns_alone(), *([times] if times else [])]


def in_words(settings: ReceiverSettings) -> str:
    """Return the settings of a packet in a few words.

    Parameters
    ----------
    settings : ReceiverSettings

    Returns
    -------
    str

    Examples
    --------
    >>> in_words(ReceiverSettings())
    '1000 Hz, 3 start + 8 payload + 3 checksum bits (sum), ieee, msb first'
    """
    f = settings.packet_format
    return (
        f"{f.f_id_hz:g} Hz, {f.start_bits} start + {f.payload_bits} payload + {f.checksum_bits} checksum bits "
        f"({f.checksum}), {settings.manchester or f.manchester}, {f.bit_order} first"
    )


def remark_on_long_packets(settings: ReceiverSettings) -> str | None:
    """Return a remark if not every period holds a whole packet: if it is shorter than two packets.

    Parameters
    ----------
    settings : ReceiverSettings

    Returns
    -------
    str or None

    Examples
    --------
    >>> print(remark_on_long_packets(ReceiverSettings()))
    None
    """
    packet_us, period_us = settings.packet_format.packet_us, settings.delta_t_whole_us
    if period_us >= 2 * packet_us:
        return None
    share = max(0.0, period_us / packet_us - 1)
    return (
        f"a period of {period_us / 1e3:g} ms is shorter than two packets of {packet_us / 1e3:g} ms, so only "
        f"{share:.0%} of the periods hold a whole one; choose "
        f"--delta-t-whole-us {round(33 / 14 * packet_us)}, or --receiver soft"
    )
