"""What it takes to lose the ID: recordings are damaged step by step, and each receiver reads them.

Five stressors act on the events of a recording, one on the marker itself:

    loss         a share of the events never arrives, each independently of the others
    noise        background activity is added anywhere, with either polarity [Hz per pixel]
    hot pixels   some pixels fire by themselves, the fastest at 134 Hz [share of the pixels]
    jitter       times are moved, normally distributed [us]
    clock        the clock of the transmitter is wrong [ppm]
    readout      the link carries a limited number of events per second; more are lost [Mev/s]

Distance (`DISTANCE`) is the seventh condition; it damages nothing. `receiver_ranges` makes ranges of it.

A recording of a second and a half is judged over its last half second, so that a receiver that combines a second of
evidence has it. Every seed has its own payload, phase, pixels and place within a pixel; intervals are over seeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bicode_lab import paper
from bicode_lab.camera import Readout
from bicode_lab.camera.readout import ReadoutQueue
from bicode_lab.events import EVENT_DTYPE, Events, copy_events, make_events, merge
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies import statistics
from bicode_studies.paper_experiments.scenes import WINDOW, WINDOW_RECEIVER, window_scene
from bicode_studies.score import Periods
from bicode_studies.trial import Settings, record_and_read

WARM_UP = 30  # periods that are not judged
JUDGED = 15
PERIOD_US = paper.DELTA_T_WHOLE_US
DURATION_US = (WARM_UP + JUDGED) * PERIOD_US
HOT_HZ = 134.0
BUFFER_EVENTS = 2000  # events that the readout holds back; a usual buffer would not fill in so short a recording

RECEIVERS: dict[str, Settings] = {
    "paper": WINDOW_RECEIVER,
    "soft, 1 period": SoftSettings(receiver=WINDOW_RECEIVER, evidence_periods=1, read_from=WARM_UP),
    "soft, 30 periods": SoftSettings(receiver=WINDOW_RECEIVER, evidence_periods=30, read_from=WARM_UP),
}


@dataclass(frozen=True, kw_only=True)
class Stressor:
    """One way to damage a recording.

    Attributes
    ----------
    name, label : str
        Its name in tables, and the label of an axis of its levels: quantity (unit).
    levels : tuple of float
        From no damage to the worst.
    distance_m : float or None
        Distance of the marker [m]; None where the level is the distance.
    """

    name: str
    label: str
    levels: tuple[float, ...]
    distance_m: float | None

    def distance_at(self, level: float) -> float:
        """Return the distance of the marker at a level [m]."""
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
_BY_NAME = {stressor.name: stressor for stressor in (*STRESSORS, DISTANCE)}


@dataclass(frozen=True, kw_only=True)
class StressCondition:
    """A stressor and its level.

    Attributes
    ----------
    stressor : str
        Name of one of `STRESSORS`, or of `DISTANCE`.
    level : float
    """

    stressor: str
    level: float

    def __post_init__(self) -> None:
        if self.stressor not in _BY_NAME:
            raise ValueError(f"stressor {self.stressor!r} is not known; choose one of {', '.join(_BY_NAME)}")


def stress_conditions() -> list[StressCondition]:
    """Return all levels of `STRESSORS`, then those of `DISTANCE`."""
    return [StressCondition(stressor=s.name, level=float(level)) for s in (*STRESSORS, DISTANCE) for level in s.levels]


def drop_events(events: Events, probability: float, rng: np.random.Generator) -> Events:
    """Drop each event with a probability, independently of the others.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    probability : float
        0 .. 1.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE
        The events that are left.
    """
    if not 0 <= probability <= 1:
        raise ValueError(f"probability={probability} is not a probability; choose 0 .. 1")
    return events[rng.random(events.size) >= probability]


def add_noise(
    events: Events, rate_hz: float, duration_us: int, width: int, height: int, rng: np.random.Generator
) -> Events:
    """Add background activity: events of either polarity at random places and times.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    rate_hz : float
        Mean rate of a pixel [Hz], 0 or more.
    duration_us : int
        Events are added between 0 and this time [us].
    width, height : int
        Size of the sensor [px].
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE
        All events, sorted by time.
    """
    if not rate_hz >= 0:
        raise ValueError(f"rate_hz={rate_hz} is negative; choose 0 or more")
    n = rng.poisson(rate_hz * duration_us * 1e-6 * width * height)
    x, y, p = rng.integers(width, size=n), rng.integers(height, size=n), rng.integers(2, size=n)
    return merge(events, make_events(x, y, p, rng.integers(duration_us, size=n)))


def add_hot_pixels(
    events: Events, share: float, duration_us: int, width: int, height: int, rng: np.random.Generator
) -> Events:
    """Add the events of hot pixels, which fire by themselves with either polarity.

    Their rates are spread evenly in the logarithm, from a hundredth of `HOT_HZ` up to it.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    share : float
        Probability that a pixel is hot, 0 .. 1.
    duration_us : int
        Events are added between 0 and this time [us].
    width, height : int
        Size of the sensor [px].
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE
        All events, sorted by time.
    """
    if not 0 <= share <= 1:
        raise ValueError(f"share={share} is not a share of the pixels; choose 0 .. 1")
    hot = np.flatnonzero(rng.random(width * height) < share)
    rates_hz = HOT_HZ * 10 ** (-2 * rng.random(hot.size))
    where = np.repeat(hot, rng.poisson(rates_hz * duration_us * 1e-6))
    p, t_us = rng.integers(2, size=where.size), rng.integers(duration_us, size=where.size)
    return merge(events, make_events(where % width, where // width, p, t_us))


def jitter_times(events: Events, sigma_us: float, rng: np.random.Generator) -> Events:
    """Move the time of each event by a normally distributed amount; no time becomes negative.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    sigma_us : float
        Standard deviation [us], 0 or more.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        Sorted by time.
    """
    if not sigma_us >= 0:
        raise ValueError(f"sigma_us={sigma_us} is negative; choose 0 or more")
    moved = copy_events(events)
    moved["t"] = np.maximum(np.round(moved["t"] + rng.normal(0, sigma_us, moved.size)).astype(np.int64), 0)
    order = np.argsort(moved["t"], kind="stable")
    return moved.view(np.int64).reshape(-1, 2)[order].view(EVENT_DTYPE).ravel()


def saturate_readout(events: Events, sustained_mev_per_s: float, buffer_events: int = BUFFER_EVENTS) -> Events:
    """Pass events through a readout that carries a limited rate; what its buffer cannot hold is lost.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    sustained_mev_per_s : float
        Rate that the readout carries [Mev/s].
    buffer_events : int
        Events that it can hold back.

    Returns
    -------
    ndarray of EVENT_DTYPE
    """
    return ReadoutQueue(Readout(sustained_mev_per_s=sustained_mev_per_s, buffer_events=buffer_events)).pass_on(events)


def stress(condition: StressCondition, seed: int) -> list[dict[str, Any]]:
    """Record a marker, damage the events and count the periods that each receiver still reads.

    Parameters
    ----------
    condition : StressCondition
    seed : int
        Seed of the scene, of the camera's chance and of the damage.

    Returns
    -------
    list of dict
        One row for each receiver: ``stressor``, ``level``, ``distance_m``, ``seed``, ``receiver``; counts of
        ``periods`` that are judged, of those that are ``right``, and of ``wrong_ids``.
    """
    distance_m = _BY_NAME[condition.stressor].distance_at(condition.level)
    scene = window_scene(distance_m, seed, condition.level if condition.stressor == "clock" else 0.0)
    periods = Periods(start_us=WARM_UP * PERIOD_US, count=JUDGED, length_us=PERIOD_US)
    damage = _damage(condition, np.random.default_rng([seed, 3]))
    trial = record_and_read(scene, RECEIVERS, periods=periods, seed=seed, damage=damage)
    return [
        {
            "stressor": condition.stressor, "level": condition.level, "distance_m": distance_m, "seed": seed,
            "receiver": receiver, "periods": JUDGED, "right": reading.right(), "wrong_ids": reading.wrong_ids,
        }
        for receiver, reading in trial.readings.items()
    ]  # fmt: skip


def _damage(condition: StressCondition, rng: np.random.Generator) -> Callable[[Events], Events]:
    """Return the function that damages the events of a recording."""
    level, size = condition.level, (DURATION_US, WINDOW.width, WINDOW.height)
    damages: dict[str, Callable[[Events], Events]] = {
        "loss": lambda events: drop_events(events, level, rng),
        "noise": lambda events: add_noise(events, level, *size, rng),
        "hot pixels": lambda events: add_hot_pixels(events, level, *size, rng),
        "jitter": lambda events: jitter_times(events, level, rng),
        "readout": lambda events: saturate_readout(events, level),
    }
    return damages.get(condition.stressor, lambda events: events)


def stress_curves(table: pd.DataFrame) -> pd.DataFrame:
    """Return the accuracy of each receiver at each level of each stressor, with its 95 % interval over seeds.

    Parameters
    ----------
    table : DataFrame
        Rows of `stress`.

    Returns
    -------
    DataFrame
        ``stressor``, ``level``, ``distance_m``, ``receiver``; ``seeds`` (count), ``accuracy``, ``low``, ``high``;
        ``wrong_ids`` (count).
    """
    by = ["stressor", "level", "distance_m", "receiver"]
    wrong_ids = table.groupby(by, sort=False)["wrong_ids"].sum().to_numpy()
    return statistics.over_seeds(table, by, "right").drop(columns="periods").assign(wrong_ids=wrong_ids)
