"""What does it take to lose the ID?   events, made worse step by step -> accuracy of both receivers

Five stressors act on the events of a recording, one on the marker itself:

    loss         share of the events that never arrive, each by itself
    noise        events of either polarity anywhere, added [Hz a pixel]
    hot pixels   pixels that fire by themselves, 134 Hz the fastest, added [share of the pixels]
    jitter       times are moved, normally distributed [us]
    clock        the transmitter's clock is off [ppm]
    readout      the link carries so many events a second; more are lost [Mev/s]

Distance (`DISTANCE`) is the seventh condition and no damage; `evaluation.receiver_ranges` makes ranges of it.

A recording of a second and a half is judged over its last half second, so that a receiver which
combines a second of evidence has it. Every seed has a payload, a phase, pixels and a sub-pixel
place of its own; intervals are taken over seeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bicode_lab.camera import Optics, PlacedMarker, Pose, Readout, Recorder, Scene, Still, truth_at
from bicode_lab.camera.readout import ReadoutQueue
from bicode_lab.events import EVENT_DTYPE, Events, copy_events, join, make_events, merge, windows
from bicode_lab.marker import Marker
from bicode_lab.recognition import ReceiverSettings, Sighting, recognise
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.robustness.clutter import NowAndThen
from bicode_studies.score import Periods, score
from bicode_studies.statistics import bootstrap

PERIOD_US = 33_000
WARM_UP = 30  # periods that are not judged
JUDGED = 15
HOT_HZ = 134.0
BUFFER_EVENTS = 2000  # what the link holds back; a usual one would not fill in so short a recording


def lose_events(events: Events, share: float, rng: np.random.Generator) -> Events:
    """Events and a share in, those that are left when each is lost with that probability out."""
    if not 0 <= share <= 1:
        raise ValueError(f"share={share} is not a share of the events; choose 0 .. 1")
    return events[rng.random(events.size) >= share]


def add_noise(
    events: Events, rate_hz: float, duration_us: int, width: int, height: int, rng: np.random.Generator
) -> Events:
    """Events and a rate a pixel in; the same with events at random places and times between 0 and `duration_us` out."""
    if not rate_hz >= 0:
        raise ValueError(f"rate_hz={rate_hz} is negative; choose 0 or more")
    n = rng.poisson(rate_hz * duration_us * 1e-6 * width * height)
    x, y, p = rng.integers(width, size=n), rng.integers(height, size=n), rng.integers(2, size=n)
    return merge(events, make_events(x, y, p, rng.integers(duration_us, size=n)))


def add_hot_pixels(
    events: Events, share: float, duration_us: int, width: int, height: int, rng: np.random.Generator
) -> Events:
    """Events and a share of the pixels in; the same with those pixels firing by themselves out.

    Rates are spread evenly in the logarithm from a hundredth of `HOT_HZ` up to it.
    """
    if not 0 <= share <= 1:
        raise ValueError(f"share={share} is not a share of the pixels; choose 0 .. 1")
    hot = np.flatnonzero(rng.random(width * height) < share)
    rates_hz = HOT_HZ * 10 ** (-2 * rng.random(hot.size))
    where = np.repeat(hot, rng.poisson(rates_hz * duration_us * 1e-6))
    p, t_us = rng.integers(2, size=where.size), rng.integers(duration_us, size=where.size)
    return merge(events, make_events(where % width, where // width, p, t_us))


def jitter_times(events: Events, sigma_us: float, rng: np.random.Generator) -> Events:
    """Events and a standard deviation [us] in; the same, each moved in time and sorted again, out; none before 0."""
    if not sigma_us >= 0:
        raise ValueError(f"sigma_us={sigma_us} is negative; choose 0 or more")
    moved = copy_events(events)
    moved["t"] = np.maximum(np.round(moved["t"] + rng.normal(0, sigma_us, moved.size)).astype(np.int64), 0)
    order = np.argsort(moved["t"], kind="stable")
    return moved.view(np.int64).reshape(-1, 2)[order].view(EVENT_DTYPE).ravel()


def saturate(events: Events, sustained_mev_per_s: float, buffer_events: int = BUFFER_EVENTS) -> Events:
    """Events and what the link carries in, what comes out of it out; see `camera.Readout`."""
    return ReadoutQueue(Readout(sustained_mev_per_s=sustained_mev_per_s, buffer_events=buffer_events)).pass_on(events)


@dataclass(frozen=True, kw_only=True)
class Stressor:
    """One way to make things worse.

    Parameters
    ----------
    name, label : str
    levels : tuple of float
        From none to the worst.
    distance_m : float, optional
        Of the marker; None where the level is the distance.
    """

    name: str
    label: str
    levels: tuple[float, ...]
    distance_m: float | None

    def distance_at(self, level: float) -> float:
        """A level in, how far the marker is then [m] out."""
        return level if self.distance_m is None else self.distance_m


FAR_M = 30.0  # the paper's rule begins to miss periods here
STRESSORS = (
    Stressor(name="loss", label="events lost (share)", levels=(0, 0.1, 0.2, 0.3, 0.4, 0.5), distance_m=FAR_M),
    Stressor(name="noise", label="added noise (Hz per pixel)", levels=(0, 0.3, 1, 3, 10), distance_m=FAR_M),
    Stressor(
        name="hot pixels", label="hot pixels (share of pixels)", levels=(0, 0.003, 0.01, 0.03, 0.1), distance_m=FAR_M
    ),
    Stressor(name="jitter", label="time jitter, one sigma (us)", levels=(0, 25, 50, 100, 150, 200), distance_m=FAR_M),
    Stressor(name="clock", label="clock error (ppm)", levels=(0, 300, 1000, 3000, 10_000, 30_000), distance_m=FAR_M),
    Stressor(name="readout", label="the link carries (Mev/s)", levels=(1, 0.1, 0.05, 0.03, 0.02, 0.01), distance_m=5.0),
)
DISTANCE = Stressor(
    name="distance",
    label="distance (m)",
    levels=(10, 15, 20, 22.5, 25, 27.5, 30, 32.5, 35, 37.5, 40, 45, 50, 55, 60, 70),
    distance_m=None,
)
RECEIVERS = ("paper", "soft, 1 period", "soft, 30 periods")
OPTICS = Optics(width=96, height=72)


def stress_scene(distance_m: float, seed: int, clock_error_ppm: float = 0.0) -> Scene:
    """A distance and a seed in, the paper's marker with a payload, a phase and a sub-pixel place of its own out."""
    rng = np.random.default_rng([seed, 1])
    x, y = rng.uniform(-0.5, 0.5, 2) * distance_m / OPTICS.focal_px
    marker = Marker(
        payload=int(rng.integers(1, 256)),
        phase_us=float(rng.uniform(0, 14_000)),
        clock_error_ppm=float(clock_error_ppm * rng.choice([-1, 1])),
    )
    path = Still(Pose.facing(distance_m, x_m=float(x), y_m=float(y)))
    return Scene(markers=(PlacedMarker(marker=marker, path=path),), optics=OPTICS)


def stressed(stressor: Stressor, level: float, seed: int) -> tuple[Scene, Events]:
    """A stressor, its level and a seed in, the scene and its events as they arrive out."""
    scene = stress_scene(stressor.distance_at(level), seed, level if stressor.name == "clock" else 0.0)
    duration_us = (WARM_UP + JUDGED) * PERIOD_US
    events = join(Recorder(scene, duration_us * 1e-6, np.random.default_rng([seed, 2])))
    rng = np.random.default_rng([seed, 3])
    size = (duration_us, OPTICS.width, OPTICS.height)
    worse: dict[str, Callable[[], Events]] = {
        "loss": lambda: lose_events(events, level, rng),
        "noise": lambda: add_noise(events, level, *size, rng),
        "hot pixels": lambda: add_hot_pixels(events, level, *size, rng),
        "jitter": lambda: jitter_times(events, level, rng),
        "clock": lambda: events,
        "distance": lambda: events,
        "readout": lambda: saturate(events, level),
    }
    if stressor.name not in worse:
        raise ValueError(f"stressor {stressor.name!r} is not known; there are {', '.join(worse)}")
    return scene, worse[stressor.name]()


def judge(scene: Scene, events: Events) -> list[dict[str, object]]:
    """A scene and its events in; for each receiver how many of the judged periods were right, and wrong IDs, out."""
    start_us = WARM_UP * PERIOD_US
    payload = scene.markers[0].marker.payload
    rows: list[dict[str, object]] = []
    for receiver in RECEIVERS:
        late = list(_read(receiver, events))
        scores = score(late, lambda t_us: truth_at(scene, t_us), Periods(start_us=start_us, count=JUDGED))
        wrong = sum(s.id is not None and s.id != payload for s in late)
        right = int(scores["id_right"].sum())
        rows.append({"receiver": receiver, "periods": JUDGED, "right": right, "wrong_ids": wrong})
    return rows


def _read(receiver: str, events: Events) -> Iterator[Sighting]:
    """A receiver's name and events in, its sightings of the judged periods out."""
    settings = ReceiverSettings(width=OPTICS.width, height=OPTICS.height, detect_2d=False)
    start_us = WARM_UP * PERIOD_US
    if receiver == "paper":
        return (s for s in recognise(events, settings, t0_us=0) if s.t_us >= start_us)
    soft = SoftSettings(receiver=settings, evidence_periods=1 if receiver == "soft, 1 period" else 30)
    reader = NowAndThen(soft, 0, lambda period: period >= WARM_UP)
    return (sighting for t_us, part in windows(events, PERIOD_US, t0_us=0) for sighting in reader(t_us, part))


def stress(stressor: Stressor, level: float, seed: int) -> pd.DataFrame:
    """A stressor, its level and a seed in, a row for each receiver out."""
    scene, events = stressed(stressor, level, seed)
    table = pd.DataFrame(judge(scene, events))
    return table.assign(stressor=stressor.name, level=level, distance_m=stressor.distance_at(level), seed=seed)[
        ["stressor", "level", "distance_m", "seed", *table.columns]
    ]


def over_seeds(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Rows of `stress` in; accuracy and its 95 % interval over seeds, by stressor, level and receiver, out."""
    by = ["stressor", "level", "distance_m", "receiver"]
    rows = []
    for key, group in table.groupby(by, sort=False):
        shares = (group["right"] / group["periods"]).to_numpy()
        low, high = bootstrap(shares, int(group["periods"].sum()), rng)
        rows.append(
            {
                **dict(zip(by, _as_tuple(key), strict=True)),
                "seeds": shares.size, "accuracy": shares.mean(), "low": low, "high": high,
                "wrong_ids": int(group["wrong_ids"].sum()),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def _as_tuple(key: object) -> Iterable[object]:
    """A group's key in, its parts out."""
    return key if isinstance(key, tuple) else (key,)
