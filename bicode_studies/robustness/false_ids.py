"""Counts of IDs that are read where no marker is, with an upper bound of their rate.

Every scene of clutter has a seed of its own, so that hours of clutter are not the same seconds again. Three numbers
are counted, because the last alone says little when it is 0:

    looked_at    boxes that the receiver looked at, one for each period
    structures   readings that keep all rules of a packet before its checksum is tested
    passed       structures whose checksum holds; an ``id`` is what the receiver then says

Where nothing passed in h hours, the rate is below 3.0 / h with 95 % confidence.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import chi2

from bicode_lab.camera import Recorder
from bicode_lab.events import Events, join
from bicode_lab.marker.packet import ChecksumKind
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.robustness.clutter import CLUTTER_KINDS, clutter_scene

KIND_OF_PIECE = (0, 1, 0, 1, 0, 1, 0, 1, 0, 2)  # repeated; moving edges cost ten times as much time as lamps
CHECKSUMS: tuple[ChecksumKind, ...] = ("sum", "crc3")
RECEIVERS = ("paper", "soft")
SCENE_S = 10.0
SCENES_PER_PIECE = 3
SOFT_EVERY = 4  # the soft receiver reads every 4th period, since 26 of its 30 periods of evidence stay the same


@dataclass(frozen=True, kw_only=True)
class Count:
    """What one receiver reads in some seconds without a marker; see the top of this file.

    Attributes
    ----------
    receiver : {"paper", "soft"}
    checksum : {"sum", "crc3"}
    seconds : float
        Length of what was read [s].
    looked_at, structures, passed, ids : int
    zeros : int
        IDs among them that are 0: the even pulses of a dimmer are a row of equal bits, and the number of ones in
        eight zeros is 0, so the checksum holds.
    """

    receiver: str
    checksum: str
    seconds: float
    looked_at: int
    structures: int
    passed: int
    ids: int
    zeros: int


@dataclass(frozen=True, kw_only=True)
class ClutterPiece:
    """A piece of clutter and the receiver that reads it; the number of the piece is the seed of the trial.

    Attributes
    ----------
    receiver : {"paper", "soft"}
    scene_s : float
        Length of a scene [s].
    scenes : int
        Scenes in the piece.
    """

    receiver: str
    scene_s: float = SCENE_S
    scenes: int = SCENES_PER_PIECE


def clutter_trials(hours: float, receivers: Sequence[str] = RECEIVERS) -> list[tuple[ClutterPiece, int]]:
    """Return the pieces that make up some hours of clutter, each with its number, for each receiver.

    Parameters
    ----------
    hours : float
        More than 0; rounded up to whole pieces.
    receivers : sequence of {"paper", "soft"}

    Raises
    ------
    ValueError
        If `hours` is not more than 0.
    """
    if hours <= 0:
        raise ValueError(f"--hours {hours:g} is no time to count in; choose more than 0")
    n_pieces = -int(-hours * 3600 // (SCENE_S * SCENES_PER_PIECE))
    return [(ClutterPiece(receiver=receiver), number) for number in range(n_pieces) for receiver in receivers]


def count_piece(condition: ClutterPiece, seed: int) -> list[dict[str, Any]]:
    """Record a piece of clutter and count what one receiver reads in it.

    Parameters
    ----------
    condition : ClutterPiece
    seed : int
        Number of the piece: decides its kind of clutter, and is its seed.

    Returns
    -------
    list of dict
        One row for each checksum: ``piece``, ``clutter``, the fields of `Count`, and ``events`` (count).
    """
    kind = CLUTTER_KINDS[KIND_OF_PIECE[seed % len(KIND_OF_PIECE)]]
    counts: list[Count] = []
    n_events = 0
    for k in range(condition.scenes):
        rng = np.random.default_rng([seed, k])
        scene = clutter_scene(kind, rng)
        events = join(Recorder(scene, condition.scene_s, rng))
        n_events += events.size
        size = scene.optics.width, scene.optics.height
        receivers = (condition.receiver,)
        counts += count_ids(events, condition.scene_s, *size, receivers=receivers, soft_every=SOFT_EVERY)
    rows = add_up(counts).to_dict("records")
    return [
        {"piece": seed, "clutter": kind, **{str(name): value for name, value in row.items()}, "events": n_events}
        for row in rows
    ]


def add_up(counts: Iterable[Count]) -> pd.DataFrame:
    """Add up counts; one row for each receiver and checksum, with the fields of `Count`."""
    table = pd.DataFrame([asdict(count) for count in counts])
    return table.groupby(["receiver", "checksum"], sort=False).sum().reset_index()


def count_ids(
    events: Events,
    seconds: float,
    width: int,
    height: int,
    *,
    receivers: Sequence[str] = RECEIVERS,
    soft_every: int = 1,
) -> list[Count]:
    """Count what receivers read in events that hold no marker, with each kind of checksum.

    Where no structure is found, no checksum is tested, so one run serves both kinds.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    seconds : float
        Length of the recording [s], with or without events.
    width, height : int
        Size of the sensor [px].
    receivers : sequence of {"paper", "soft"}
    soft_every : int
        The soft receiver reads every n-th period, and makes every n-th of its searches for faint regions.

    Returns
    -------
    list of Count
        One for each receiver and checksum.
    """
    plain = ReceiverSettings(width=width, height=height, detect_2d=False)
    counts = []
    for receiver in receivers:
        found: Count | None = None
        for checksum in CHECKSUMS:
            if found is None or found.structures:
                settings = replace(plain, packet_format=replace(plain.packet_format, checksum=checksum))
                found = _count(receiver, checksum, seconds, _sightings(receiver, events, settings, soft_every))
            counts.append(replace(found, checksum=checksum))
    return counts


def _sightings(receiver: str, events: Events, settings: ReceiverSettings, soft_every: int) -> Iterator[Sighting]:
    """Read events with one of `RECEIVERS`."""
    if receiver == "paper":
        return recognise(events, settings)
    return recognise(events, SoftSettings(receiver=settings, read_every=soft_every, search_every=soft_every))


def _count(receiver: str, checksum: str, seconds: float, sightings: Iterable[Sighting]) -> Count:
    """Count the sightings of one receiver."""
    looked_at = structures = passed = ids = zeros = 0
    for sighting in sightings:
        looked_at += 1
        ids += sighting.id is not None
        zeros += sighting.id == 0
        if receiver == "paper":
            packets = (*sighting.packets, *sighting.border_packets)
            structures += len(packets)
            passed += sum(packet.checksum_ok for packet in packets)
        else:  # the soft receiver reads its evidence as a whole and tests the checksum last
            structures += sighting.reason in (None, "checksum")
            passed += sighting.reason is None
    return Count(receiver=receiver, checksum=checksum, seconds=seconds, looked_at=looked_at,
                 structures=structures, passed=passed, ids=ids, zeros=zeros)  # fmt: skip


def rate_bound_hz(count: int, seconds: float, confidence: float = 0.95) -> float:
    """Return the upper bound of the rate of something that happened a number of times (Poisson).

    Parameters
    ----------
    count : int
        How often it happened.
    seconds : float
        In how much time [s], more than 0.
    confidence : float
        Probability that the rate is below the bound, 0 .. 1.

    Returns
    -------
    float
        Bound [1/s]: the rate at which `count` or fewer happen with a probability of 1 - confidence.

    Raises
    ------
    ValueError
        If no time has passed.

    Examples
    --------
    >>> round(3600 * rate_bound_hz(0, seconds=3 * 3600), 3)  # none in three hours
    0.999
    """
    if not seconds > 0:
        raise ValueError(f"seconds={seconds} is no time to count in; choose more than 0")
    return float(chi2.ppf(confidence, 2 * (count + 1)) / 2 / seconds)


def rates(table: pd.DataFrame, by: tuple[str, ...] = ("receiver", "checksum")) -> pd.DataFrame:
    """Return how many IDs are read per hour.

    Parameters
    ----------
    table : DataFrame
        Rows of `count_piece`.
    by : tuple of str
        Columns that tell groups apart.

    Returns
    -------
    DataFrame
        One row for each group: the sums of the counts, ``hours``, ``ids_per_hour``, and its 95 % upper bound
        ``bound_per_hour``.
    """
    numbers = ["seconds", "looked_at", "structures", "passed", "ids", "zeros"]
    sums = table.groupby(list(by), sort=False)[numbers].sum().reset_index()
    sums["hours"] = sums.pop("seconds") / 3600
    sums["ids_per_hour"] = sums["ids"] / sums["hours"]
    sums["bound_per_hour"] = [
        3600 * rate_bound_hz(int(n), h * 3600) for n, h in zip(sums["ids"], sums["hours"], strict=True)
    ]
    return sums
