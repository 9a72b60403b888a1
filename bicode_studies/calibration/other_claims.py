"""The four constants that Fig. 8 does not determine, each fitted to one other claim of the paper.

The claim that a constant is fitted to is no longer evidence for the model:

    edge_glow                F9.3   the ID at 80 degrees is read to 10 m and no farther
    infrared_share_office    F11.2  the ID by infrared light is read at 20 m in the office, half of the time
    infrared_share_evening   F11.2  the same in the evening
    processing_mev_per_s     F14.5  the ID of a marker that turns fast is right in 70 % of periods at each distance

`fit_constant` sets the first three so that the accuracies in the conditions of their claim sum to `WANTED`, and the
last so that the accuracy is `MORE_THAN_70` where there are most events. All other constants are those of
`constants.csv`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.camera import Scene, record
from bicode_lab.constants import all_constants
from bicode_studies.calibration.cells import FAR_PX, FIRST_SEED, read_periods
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.processing_limit import HITS, delay_periods
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.statistics import over_seeds
from bicode_studies.trial import PERIOD_S

PERIODS = 5  # of each seed
SEEDS = 20  # that a constant is fitted with
WANTED = {"edge_glow": 1.0, "infrared_share_office": 0.5, "infrared_share_evening": 0.5}  # 10 m read, 15 m not; half
MORE_THAN_70 = 0.725  # "more than 70 %": the middle of 70 and 75 %, of which one would say so
FASTEST_RPM = paper.FIG_14_SPEEDS_RPM[-1]
HALVINGS = 7  # of the range in which a constant is searched
RATE_S = 0.02  # length of a recording that is enough to measure the event rate of a near marker [s]


def with_value(scene: Scene, name: str, value: float) -> Scene:
    """Return a scene with another value of a constant, on a sensor just large enough for a distant marker.

    Parameters
    ----------
    scene : Scene
    name : str
        "edge_glow", "infrared_share_office" or "infrared_share_evening".
    value : float

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If the constant is another one.
    """
    scene = replace(scene, optics=replace(scene.optics, width=FAR_PX[0], height=FAR_PX[1]))
    if name == "edge_glow":
        return replace(scene, edge_glow=value)
    if name in ("infrared_share_office", "infrared_share_evening"):
        return replace(scene, light=replace(scene.light, infrared_share=value))
    raise ValueError(f"name={name!r} is not read here; choose edge_glow or infrared_share_office, ..._evening")


def conditions_of(name: str) -> list[Condition]:
    """Return the conditions of the claim that a constant is fitted to.

    Parameters
    ----------
    name : str
        "edge_glow", "infrared_share_office" or "infrared_share_evening".

    Returns
    -------
    list of Condition
    """
    if name == "edge_glow":
        return [Condition(figure="09", distance_m=distance_m, yaw_deg=80.0) for distance_m in (10.0, 15.0)]
    lux = paper.OFFICE_LUX if name == "infrared_share_office" else paper.EVENING_LUX
    current_ma = paper.FIG_11_CURRENT_MA
    return [Condition(figure="11", distance_m=20.0, current_ma=current_ma, band="infrared", illuminance_lux=lux)]


def fit_constant(name: str) -> float:
    """Fit a constant to its claim, with seeds that no figure uses.

    The first three are found by halving their range on a logarithmic scale: with more edge glow an ID is never read
    less far, and with more background it is never read farther.

    Parameters
    ----------
    name : str
        One of the four constants at the top of this file.

    Returns
    -------
    float
        The value, to three significant digits.

    Raises
    ------
    ValueError
        If the constant is another one.
    """
    if name == "processing_mev_per_s":
        rate = turning_rate_mev_per_s(0.5, FASTEST_RPM, FIRST_SEED)
        periods = 30 / FASTEST_RPM / PERIOD_S
        return _rounded(rate / ((1 - MORE_THAN_70) * periods - (HITS - 1)))
    if name not in WANTED:
        raise ValueError(f"name={name!r} is not fitted here; choose one of {', '.join(WANTED)}, processing_mev_per_s")
    low, high = np.log([all_constants()[name].low, all_constants()[name].high])
    for _ in range(HALVINGS):
        middle = float(low + high) / 2
        read = accuracy_over(name, [float(np.exp(middle))], range(FIRST_SEED, FIRST_SEED + SEEDS))
        is_too_much = (read["accuracy"].sum() > WANTED[name]) == (name == "edge_glow")
        low, high = (low, middle) if is_too_much else (middle, high)
    return _rounded(float(np.exp((low + high) / 2)))


def _rounded(value: float) -> float:
    """Round a number to three significant digits."""
    return float(f"{value:.3g}")


def accuracy_over(name: str, values: Iterable[float], seeds: Iterable[int]) -> pd.DataFrame:
    """Return the accuracy of the ID in the conditions of a constant's claim, over values of the constant.

    Parameters
    ----------
    name : str
        "edge_glow", "infrared_share_office" or "infrared_share_evening".
    values : iterable of float
    seeds : iterable of int

    Returns
    -------
    DataFrame
        ``name``, ``value``, ``distance_m``, then the columns of `statistics.over_seeds`.
    """
    seeds = list(seeds)
    cells = [(value, condition, seed) for value in values for condition in conditions_of(name) for seed in seeds]
    rows: list[dict[str, Any]] = []
    for value, condition, seed in tqdm(cells, desc=name, unit=" trials", disable=None):
        scene = with_value(scene_of(condition, seed), name, value)
        reading = read_periods(scene, receiver_settings(condition), seed, PERIODS, detect_2d=False)
        rows.append({"name": name, "value": value, "distance_m": condition.distance_m,
                     "periods": PERIODS, "id_right": reading.right()})  # fmt: skip
    return over_seeds(pd.DataFrame(rows), ["name", "value", "distance_m"])


def turning_rate_mev_per_s(distance_m: float, rpm: float, seed: int = 0) -> float:
    """Return the event rate of a marker that turns in its plane.

    Parameters
    ----------
    distance_m : float
        Distance from camera to marker [m].
    rpm : float
        Speed of turning [revolutions per minute].
    seed : int
        Seed of the scene and of the camera's chance.

    Returns
    -------
    float
        Rate [Mev/s].
    """
    scene = scene_of(Condition(figure="14", distance_m=distance_m, rpm=rpm), seed)
    return float(record(scene, RATE_S, np.random.default_rng([seed, 2])).size / (RATE_S * 1e6))


def accuracy_in_time(mev_per_s: float, limit_mev_per_s: float, rpm: float) -> float:
    """Return the expected accuracy over half a turn of a receiver that misses only the periods it is too slow for.

    See `processing_limit` for how many periods these are.

    Parameters
    ----------
    mev_per_s : float
        Rate of events [Mev/s].
    limit_mev_per_s : float
        Rate at which the computer processes events [Mev/s].
    rpm : float
        Speed of turning [revolutions per minute].

    Returns
    -------
    float
        Share of periods, 0 .. 1.

    Examples
    --------
    >>> accuracy_in_time(20.0, 20.0, rpm=16) > accuracy_in_time(20.0, 20.0, rpm=64)
    True
    """
    periods = 30 / rpm / PERIOD_S
    return max(0.0, 1 - (HITS - 1 + delay_periods(mev_per_s, limit_mev_per_s)) / periods)
