"""How often is an ID read where no marker is?   clutter -> IDs an hour, with an upper bound

Clutter is a small window of the sensor with what blinks or moves and is no marker: lamps
with mains ripple (100 and 120 Hz), a second lamp behind a 1 kHz dimmer, textured edges that
slide by. Every scene has a seed of its own, so that hours are not the same seconds twice.

Three things are counted, because none of the last says little without the first:

    looked_at    boxes that the receiver looked at, one for each period
    structures   readings that keep all rules of a packet but the checksum, which is not asked yet
    passed       those whose checksum holds; an `id` is what the receiver then says

Where nothing passed in h hours, the rate is below 3.0 / h with 95 % confidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import chi2

from bicode_lab.camera import Flicker, Lamp, Moving, Optics, Pose, Recorder, Scene, Still, textured_wall
from bicode_lab.events import Events, join, windows
from bicode_lab.marker.packet import ChecksumKind
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_lab.soft_receiver import SoftReceiver, SoftSettings

ClutterKind = Literal["mains lamps", "mains and dimmer", "moving edges"]
CLUTTER_KINDS: tuple[ClutterKind, ...] = ("mains lamps", "mains and dimmer", "moving edges")
TURNS = (0, 1, 0, 1, 0, 1, 0, 1, 0, 2)  # kinds of clutter in turn: what moves costs ten times what stands still
CHECKSUMS: tuple[ChecksumKind, ...] = ("sum", "crc3")
RECEIVERS = ("paper", "soft")
WINDOW_PX = {"mains lamps": (160, 120), "mains and dimmer": (160, 120), "moving edges": (80, 60)}
LAMP_M = 5.0  # how far lamps and wall are
SCENE_S = 10.0
SCENES_A_PIECE = 3
SOFT_EVERY = (
    4  # the soft receiver reads every 4th period (26 of 30 periods of evidence are the same), searches 4th as often
)
PICTURES = ("gravel", "brick", "camera", "coins", "text")


@dataclass(frozen=True, kw_only=True)
class Count:
    """What one receiver made of some seconds without a marker; see the top of this file.

    Parameters
    ----------
    receiver : {"paper", "soft"}
    checksum : {"sum", "crc3"}
    seconds : float
    looked_at, structures, passed, ids : int
    zeros : int
        IDs among them that are 0: a dimmer's even pulses are a row of equal bits, and the sum of no ones is 0.
    """

    receiver: str
    checksum: str
    seconds: float
    looked_at: int
    structures: int
    passed: int
    ids: int
    zeros: int


def clutter_scene(kind: ClutterKind, rng: np.random.Generator) -> Scene:
    """A kind of clutter and chance in, a scene without a marker out.

    Lamps: one or two on the mains, 2 .. 8 px wide, up to 50 times as bright as the wall, with a ripple of
    20 .. 100 %, smooth or square; the dimmer's rate is 1 kHz but for 2 %. The wall slides at 10 .. 60 px/s.
    """
    width, height = WINDOW_PX[kind]
    optics = Optics(width=width, height=height)
    dimmers = {"mains lamps": 0, "mains and dimmer": 1, "moving edges": int(rng.random() < 0.5)}[kind]
    lamps = [_lamp(_mains(rng), 50, optics, rng) for _ in range(1 + int(kind == "mains lamps" and rng.random() < 0.5))]
    lamps += [_lamp(_dimmer(rng), 5, optics, rng) for _ in range(dimmers)]
    if kind != "moving edges":
        return Scene(markers=(), optics=optics, lamps=tuple(lamps))
    speed = float(np.exp(rng.uniform(np.log(10), np.log(60)))) * LAMP_M / optics.focal_px * rng.choice([-1, 1])
    camera = Moving(velocity_m_per_s=(float(speed), 0.0, 0.0))
    wall = textured_wall(str(rng.choice(PICTURES)), contrast=float(rng.uniform(0.2, 0.6)), distance_m=LAMP_M)
    # Every other lamp goes along with the camera; the others pass.
    riding = tuple(
        replace(lamp, path=Moving(start=lamp.path.pose_at(0), velocity_m_per_s=camera.velocity_m_per_s))
        if rng.random() < 0.5 else lamp
        for lamp in lamps
    )  # fmt: skip
    return Scene(markers=(), optics=optics, lamps=riding, camera=camera, wall=wall)


def _mains(rng: np.random.Generator) -> Flicker:
    """A lamp's ripple on a mains of 50 or 60 Hz, which keeps its rate to a few parts in a thousand."""
    return Flicker(
        rate_hz=float(rng.choice([100, 120]) * rng.uniform(0.998, 1.002)),
        shape="sine" if rng.random() < 0.4 else "square",
        depth=float(np.exp(rng.uniform(np.log(0.2), 0))),
        duty=float(0.04 + 0.92 * rng.beta(0.5, 0.5)),  # short pulses, or short gaps: both edges within delta_t_blinker
        phase_us=float(rng.uniform(0, 1e4)),
    )


def _dimmer(rng: np.random.Generator) -> Flicker:
    """Pulses of about 1 kHz, with whatever duty."""
    return Flicker(
        rate_hz=float(1000 * rng.uniform(0.98, 1.02)),
        shape="square",
        depth=float(rng.uniform(0.5, 1)),
        duty=float(rng.uniform(0.1, 0.9)),
        phase_us=float(rng.uniform(0, 1e3)),
    )


def _lamp(flicker: Flicker, brightest: float, optics: Optics, rng: np.random.Generator) -> Lamp:
    """A flicker and the most brightness in, a lamp of some size and brightness somewhere in the window out."""
    px = LAMP_M / optics.focal_px
    x, y = (rng.uniform(-0.42, 0.42) * side for side in (optics.width, optics.height))
    width, height = np.exp(rng.uniform(np.log(2), np.log(8), 2))
    return Lamp(
        flicker=flicker,
        path=Still(Pose.facing(LAMP_M, x_m=float(x * px), y_m=float(y * px))),
        width_m=float(width * px),
        height_m=float(height * px),
        brightness=float(np.exp(rng.uniform(0, np.log(brightest)))),
    )


def count_piece(
    number: int, receivers: Sequence[str] = RECEIVERS, scene_s: float = SCENE_S, scenes: int = SCENES_A_PIECE
) -> pd.DataFrame:
    """The number of a piece of clutter, which is its seed too, in; a row for each receiver and checksum out."""
    kind = CLUTTER_KINDS[TURNS[number % len(TURNS)]]
    counts: list[Count] = []
    n_events = 0
    for k in range(scenes):
        rng = np.random.default_rng([number, k])
        scene = clutter_scene(kind, rng)
        events = join(Recorder(scene, scene_s, rng))
        n_events += events.size
        size = scene.optics.width, scene.optics.height
        counts += count_ids(events, scene_s, *size, receivers=receivers, soft_every=SOFT_EVERY)
    table = add_up(counts)
    table.insert(0, "piece", number)
    table.insert(1, "clutter", kind)
    table["events"] = n_events
    return table


def add_up(counts: Iterable[Count]) -> pd.DataFrame:
    """Counts in, one row for each receiver and checksum with their sums out."""
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
    **changes: Any,
) -> list[Count]:
    """Events without a marker in, what the paper's rule and the soft receiver make of them with each checksum out.

    Where no structure is found, no checksum is asked, so one run serves both.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    seconds : float
        Length of the recording, events or not.
    width, height : int
        Sensor [px].
    receivers : sequence of {"paper", "soft"}
    soft_every : int
        Periods from one reading of the soft receiver's evidence to the next.
    changes
        Fields of `ReceiverSettings`.
    """
    paper = ReceiverSettings(width=width, height=height, detect_2d=False, **changes)

    def by_paper(settings: ReceiverSettings) -> Iterator[Sighting]:
        return recognise(events, settings)

    def by_soft(settings: ReceiverSettings) -> Iterator[Sighting]:
        return _read_now_and_then(events, settings, soft_every)

    runs: dict[str, Callable[[ReceiverSettings], Iterator[Sighting]]] = {"paper": by_paper, "soft": by_soft}
    counts = []
    for receiver in receivers:
        found: Count | None = None
        for checksum in CHECKSUMS:
            if found is None or found.structures:
                settings = replace(paper, packet_format=replace(paper.packet_format, checksum=checksum))
                found = _counted(receiver, checksum, seconds, runs[receiver](settings))
            counts.append(replace(found, checksum=checksum))
    return counts


class NowAndThen(SoftReceiver):
    """The soft receiver, reading the evidence of some periods only; of the others it says nothing.

    What it would read in between is hardly new, as most of its evidence is the same, and takes most of the time.

    Parameters
    ----------
    settings : SoftSettings
    t0_us : int
        Start of the first period [us].
    reads : callable
        A period's number in, whether it is read out.
    search_every : int
        Every how many-th search for faint regions is made.
    """

    def __init__(self, settings: SoftSettings, t0_us: int, reads: Callable[[int], bool], search_every: int = 1) -> None:
        super().__init__(settings, t0_us)
        self._reads = reads
        self._search_every = search_every
        self._searches = -1

    def __call__(self, start_us: int, events: Events) -> list[Sighting]:
        """One period's start [us] and its events in, sightings out where it is read."""
        return [sighting for sighting in super().__call__(start_us, events) if sighting.t_us >= 0]

    def _find_faint(self) -> list[Any]:
        self._searches += 1
        return self._faint if self._searches % self._search_every else super()._find_faint()

    def _sighting(self, period: int, track: int, box: Any, evidence: Any) -> Sighting:
        if self._reads(period):
            return super()._sighting(period, track, box, evidence)
        return Sighting(t_us=-1, track=track, x=box[0], y=box[1], w=box[2], h=box[3])


def _read_now_and_then(events: Events, settings: ReceiverSettings, every: int) -> Iterator[Sighting]:
    """Events in, sightings of every n-th period out."""
    receiver: NowAndThen | None = None
    for start_us, part in windows(events, settings.delta_t_whole_us):
        if receiver is None:
            receiver = NowAndThen(SoftSettings(receiver=settings), start_us, lambda k: k % every == every - 1, every)
        yield from receiver(start_us, part)


def _counted(receiver: str, checksum: str, seconds: float, sightings: Iterable[Sighting]) -> Count:
    """Sightings in, their count out."""
    looked_at = structures = passed = ids = zeros = 0
    for sighting in sightings:
        looked_at += 1
        ids += sighting.id is not None
        zeros += sighting.id == 0
        if receiver == "paper":
            packets = (*sighting.packets, *sighting.border_packets)
            structures += len(packets)
            passed += sum(packet.checksum_ok for packet in packets)
        else:  # it reads its evidence as a whole, and its checksum is the last word
            structures += sighting.reason in (None, "checksum")
            passed += sighting.reason is None
    return Count(receiver=receiver, checksum=checksum, seconds=seconds, looked_at=looked_at,
                 structures=structures, passed=passed, ids=ids, zeros=zeros)  # fmt: skip


def rate_bound_hz(count: int, seconds: float, confidence: float = 0.95) -> float:
    """How often something happened in how long in; the rate it is below, with a confidence, out [1/s] (Poisson).

    Examples
    --------
    >>> round(3600 * rate_bound_hz(0, seconds=3 * 3600), 3)  # none in three hours
    0.999
    """
    if not seconds > 0:
        raise ValueError(f"seconds={seconds} is no time to count in; choose more than 0")
    return float(chi2.ppf(confidence, 2 * (count + 1)) / 2 / seconds)


def rates(table: pd.DataFrame, by: tuple[str, ...] = ("receiver", "checksum")) -> pd.DataFrame:
    """Rows of `count_piece` in; their sums, hours, IDs an hour and the 95 % upper bound of that out."""
    numbers = ["seconds", "looked_at", "structures", "passed", "ids", "zeros"]
    sums = table.groupby(list(by), sort=False)[numbers].sum().reset_index()
    sums["hours"] = sums.pop("seconds") / 3600
    sums["ids_per_hour"] = sums["ids"] / sums["hours"]
    sums["bound_per_hour"] = [
        3600 * rate_bound_hz(int(n), h * 3600) for n, h in zip(sums["ids"], sums["hours"], strict=True)
    ]
    return sums
