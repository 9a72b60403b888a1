"""What sets the range of the ID: the receiver's least region, its opening, or the light (IV-A, II-A).

The paper gives the inverse-square law of light as the reason for the ranges of Fig. 8. Here the same recordings are
read by three receivers, each with several least regions. If the light set the range, all would read equally far.

    receiver of the figures   `conditions.receiver_settings`: opens by a square of 3 pixels
    default receiver          `ReceiverSettings()`: no opening
    soft receiver             `SoftSettings()`: no opening, soft decisions, and a search for faint regions
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from bicode_lab import paper
from bicode_lab.camera import Scene
from bicode_lab.constants import constant
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies import trial
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import WINDOW_RECEIVER, window_scene
from bicode_studies.statistics import range_over_seeds
from bicode_studies.sweep.sweep import CONSTANTS, sweep

OF_THE_FIGURES, DEFAULT, SOFT = RECEIVERS = ("receiver of the figures", "default receiver", "soft receiver")
LEAST_REGIONS_PX = (3, 6, 10, 15, 20)
CURRENTS_MA = paper.FIG_8_CURRENTS_MA[1:]  # those with a range in the paper ...
STATED_M = (20.0, 30.0)  # ... which is this (F8.3, F8.4)
DISTANCES_M = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 80.0, 100.0)
SEEDS, PERIODS = 10, 20
QUICK_DISTANCES_M = (15.0, 25.0, 40.0)
QUICK_SEEDS, QUICK_PERIODS = 1, 6
KEYS = ["receiver", "current_ma", "min_region_pixels"]


@dataclass(frozen=True, kw_only=True)
class FarMarker:
    """A marker that faces a camera at rest, as in Fig. 8.

    Attributes
    ----------
    distance_m : float
        Distance from camera to marker [m].
    current_ma : float
        Current of the LED [mA].
    periods : int
        Length of a recording, in periods.
    """

    distance_m: float
    current_ma: float
    periods: int


def receivers_of(least_regions_px: Iterable[int]) -> dict[str, trial.Settings]:
    """Return the three receivers with each least region, for the sensor of `scenes.window_scene`.

    Parameters
    ----------
    least_regions_px : iterable of int
        Least numbers of pixels of a region, 1 or more.

    Returns
    -------
    dict of str to ReceiverSettings or SoftSettings
        By name and least region, such as "soft receiver, 15 px"; for each least region all receivers in the order of
        `RECEIVERS`.
    """
    opening_px = receiver_settings(Condition(figure="08", distance_m=1.0)).opening_px
    found: dict[str, trial.Settings] = {}
    for least_px in least_regions_px:
        plain = replace(WINDOW_RECEIVER, min_region_pixels=least_px)
        opened, soft = replace(plain, opening_px=opening_px), SoftSettings(receiver=plain)
        settings: tuple[trial.Settings, ...] = (opened, plain, soft)
        found |= {_name(name, least_px): each for name, each in zip(RECEIVERS, settings, strict=True)}
    return found


def far_scene(marker: FarMarker, seed: int) -> Scene:
    """Place a far marker before the small sensor.

    Parameters
    ----------
    marker : FarMarker
    seed : int
        Seed of `scenes.window_scene`.

    Returns
    -------
    Scene
    """
    scene = window_scene(marker.distance_m, seed)
    placed = scene.markers[0]
    return replace(scene, markers=(replace(placed, marker=replace(placed.marker, current_ma=marker.current_ma)),))


def read_far(marker: FarMarker, seed: int) -> list[dict[str, Any]]:
    """Record a far marker once and read it with all receivers and least regions.

    Parameters
    ----------
    marker : FarMarker
    seed : int
        Seed of the scene and of the camera's chance.

    Returns
    -------
    list of dict
        One row for each receiver and least region: ``receiver``, ``min_region_pixels``, ``current_ma``,
        ``distance_m``, ``seed``, ``periods`` (count), ``id_right`` (count of periods), ``wrong_ids`` and ``events``
        (counts).
    """
    rows = trial.run(far_scene(marker, seed), receivers_of(LEAST_REGIONS_PX), periods=marker.periods, seed=seed)
    found = rows.set_index("receiver").to_dict("index")
    return [
        {
            "receiver": receiver, "min_region_pixels": least_px,
            "current_ma": marker.current_ma, "distance_m": marker.distance_m,
            **{name: int(of[name]) for name in ("seed", "periods", "id_right", "wrong_ids", "events")},
        }
        for receiver in RECEIVERS for least_px in LEAST_REGIONS_PX for of in [found[_name(receiver, least_px)]]
    ]  # fmt: skip


def far_readings(quick: bool) -> pd.DataFrame:
    """Return the readings of all far markers.

    Parameters
    ----------
    quick : bool
        True for few distances and short recordings, run at once; False for all, which are swept and kept.

    Returns
    -------
    DataFrame
        Rows of `read_far`.

    Raises
    ------
    RuntimeError
        If trials fail; the others are kept in the store.
    """
    distances_m, periods = (QUICK_DISTANCES_M, QUICK_PERIODS) if quick else (DISTANCES_M, PERIODS)
    trials = [
        (FarMarker(distance_m=distance_m, current_ma=current_ma, periods=periods), seed)
        for current_ma in CURRENTS_MA
        for distance_m in distances_m
        for seed in range(QUICK_SEEDS if quick else SEEDS)
    ]
    if quick:
        return pd.DataFrame([row for marker, seed in trials for row in read_far(marker, seed)])
    result = sweep(read_far, trials, data_files=CONSTANTS)
    if result.failures:
        raise RuntimeError(result.failure_line())
    return result.table


def id_ranges(table: pd.DataFrame) -> pd.DataFrame:
    """Return how far each receiver reads the ID, see `statistics.ranges_m`, with 95 % intervals over seeds.

    Parameters
    ----------
    table : DataFrame
        Rows of `read_far`; every receiver has the same seeds at all its distances.

    Returns
    -------
    DataFrame
        One row for each receiver, current and least region, in the order of the table: ``receiver``, ``current_ma``,
        ``min_region_pixels``, ``range_m``, ``low`` and ``high`` [m]; 0 where no distance reaches an accuracy of one
        half. ``beyond`` is True where the last distance still reaches it, so that the range is at least ``range_m``.
    """
    rows = []
    for key, group in table.groupby(KEYS, sort=False):
        range_m, low, high = range_over_seeds(group, "id_right")
        numbers = {"range_m": range_m, "low": low, "high": high, "beyond": bool(range_m == group["distance_m"].max())}
        rows.append({**dict(zip(KEYS, key, strict=True)), **numbers})
    return pd.DataFrame(rows)


def inverse_square_range_m(current_ma: float) -> float:
    """Return the range that the inverse-square law of light alone gives, anchored at the paper's 20 m for 10.7 mA.

    The peak contrast of a far marker goes as current over distance squared, so its range goes as the root of the
    current, whatever the receiver asks for.

    Parameters
    ----------
    current_ma : float
        Current of the LED [mA].

    Returns
    -------
    float
        Range [m].

    Examples
    --------
    >>> round(inverse_square_range_m(21.3), 1)
    28.2
    """
    return STATED_M[0] * math.sqrt(current_ma / CURRENTS_MA[0])


def least_in_use(receiver: str) -> int:
    """Return the least region that a receiver has where nothing else is asked for [px].

    Parameters
    ----------
    receiver : str
        One of `RECEIVERS`.

    Returns
    -------
    int
        The fitted constant for the receiver of the figures, the default of the settings for the two others.
    """
    return round(constant("min_region_pixels")) if receiver == OF_THE_FIGURES else WINDOW_RECEIVER.min_region_pixels


def _name(receiver: str, least_px: int) -> str:
    """Return the name of a receiver with a least region."""
    return f"{receiver}, {least_px} px"
