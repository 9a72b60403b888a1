"""Events of lights that send given chips, of lamps and of clutter: a test double for the receiver, not a camera."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, make_events, merge, no_events, windows
from bicode_lab.marker import PacketFormat
from bicode_lab.recognition.settings import ReceiverSettings
from bicode_lab.sequential import SequentialSettings, SequentialSighting
from bicode_lab.sequential.fold import PHASES, Bins
from bicode_lab.soft_receiver.line_code import BicodeLine

WIDTH, HEIGHT = 96, 64
PERIOD_US = 33_000


def pulses(
    times_us: npt.ArrayLike,
    rises: npt.ArrayLike,
    rng: np.random.Generator,
    *,
    centre: tuple[float, float] = (40.0, 30.0),
    velocity_px_per_s: float = 0.0,
    radius_px: float = 3.0,
    on: float = 40.0,
    off: float = 30.0,
    latency_us: tuple[float, float] = (120.0, 180.0),
    jitter_us: float = 40.0,
    tail_us: float = 0.0,
) -> Events:
    """Make the events of edges: Poisson numbers, a latency of each polarity, gamma jitter, exponential tail, a disc."""
    times, is_rise = np.asarray(times_us, float), np.asarray(rises, bool)
    parts = []
    for polarity, mean, latency in ((1, on, latency_us[0]), (0, off, latency_us[1])):
        mine = times[is_rise == polarity]
        t = np.repeat(mine, rng.poisson(mean, mine.size))
        angle, radius = rng.uniform(0, 2 * np.pi, t.size), radius_px * np.sqrt(rng.random(t.size))
        x = centre[0] + velocity_px_per_s * t * 1e-6 + radius * np.cos(angle)
        y = centre[1] + radius * np.sin(angle)
        late = t + latency - jitter_us + rng.gamma(4, jitter_us / 4, t.size)
        late += tail_us * rng.exponential(size=t.size)
        inside = (late >= 0) & (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
        parts.append(make_events(x[inside], y[inside], np.full(int(inside.sum()), polarity), late[inside]))
    return merge(*parts)


def edges_of(
    chips: npt.ArrayLike, chip_us: float, *, start_us: float = 0.0, error_ppm: float = 0.0
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return the times of the edges of given levels [us] and whether they rise; the light is off before."""
    levels = np.concatenate([[0], np.asarray(chips, int)])
    at = np.flatnonzero(np.diff(levels))
    return start_us + at * chip_us * (1 + error_ppm * 1e-6), levels[at + 1] == 1


def marker(
    payloads: int | Sequence[int],
    packet_format: PacketFormat,
    end_us: float,
    rng: np.random.Generator,
    *,
    start_us: float = 0.0,
    skip_chips: int = 0,
    error_ppm: float = 0.0,
    **look: object,
) -> Events:
    """Make the events of a marker that sends one payload, or several in turn, from `start_us` until `end_us`."""
    line = BicodeLine(packet_format=packet_format)
    values = [payloads] if isinstance(payloads, int) else list(payloads)
    n_chips = int((end_us - start_us) / line.chip_us)
    n_frames = -(-(n_chips + skip_chips) // line.frame_chips)
    frames = [line.encode(values[k % len(values)]) for k in range(n_frames)]
    chips = np.concatenate(frames)[skip_chips : skip_chips + n_chips]
    times, rises = edges_of(chips, line.chip_us, start_us=start_us, error_ppm=error_ppm)
    return pulses(times, rises, rng, **look)  # type: ignore[arg-type]


def lamp(rate_hz: float, duty: float, end_us: float, rng: np.random.Generator, **look: object) -> Events:
    """Make the events of a lamp that is on for the share `duty` of each cycle."""
    begins = np.arange(0, end_us, 1e6 / rate_hz) + rng.uniform(0, 1e6 / rate_hz)
    times = np.concatenate([begins, begins + duty * 1e6 / rate_hz])
    return pulses(times, np.repeat([True, False], begins.size), rng, **look)  # type: ignore[arg-type]


def noise(n_per_s: float, end_us: float, rng: np.random.Generator) -> Events:
    """Make background activity all over the sensor."""
    n = rng.poisson(n_per_s * end_us * 1e-6)
    return make_events(
        rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.integers(0, 2, n), rng.integers(0, int(end_us), n)
    )


def settings_of(packet_format: PacketFormat | None = None, **changes: object) -> SequentialSettings:
    """Return settings for the small sensor of these tests, without 2D markers."""
    plain = {"width": WIDTH, "height": HEIGHT, "detect_2d": False, "delta_t_id_us": 1, "delta_t_whole_us": PERIOD_US}
    if packet_format is not None:
        plain["packet_format"] = packet_format  # type: ignore[assignment]
    return SequentialSettings(receiver=ReceiverSettings(**(plain | changes)))  # type: ignore[arg-type]


def receive(events: Events, settings: SequentialSettings, t0_us: int = 0) -> list[SequentialSighting]:
    """Return the sightings of all periods."""
    receiver = settings.start(t0_us)
    found = []
    for start_us, part in windows(events, settings.delta_t_whole_us, t0_us=t0_us):
        found += receiver(start_us, part)
    return found


def ids(sightings: Sequence[SequentialSighting]) -> set[int]:
    """Return all IDs that were read."""
    return {each.id for each in sightings if each.id is not None}


def bins_of(events: Events, chip_us: float, *, error: float = 1.0) -> Bins:
    """Return the counts of events in bins of an eighth of a chip, from time 0 on."""
    bin_us = int(chip_us / PHASES)
    number = events["t"] // bin_us
    n = int(number.max()) + 1
    counts = np.stack([np.bincount(number[events["p"] == p], minlength=n) for p in (1, 0)], axis=1)
    return Bins((np.arange(n) + 0.5) * bin_us / chip_us * error, counts.astype(float))


def in_a_row(values: Sequence[int]) -> list[int]:
    """Return the values without repetitions that follow each other."""
    return [value for value, _ in groupby(values)]


__all__ = [
    "HEIGHT", "PERIOD_US", "WIDTH", "bins_of", "edges_of", "ids", "in_a_row", "lamp", "marker", "merge", "no_events",
    "noise", "pulses", "receive", "settings_of",
]  # fmt: skip
