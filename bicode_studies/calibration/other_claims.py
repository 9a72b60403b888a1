"""What claims beyond Fig. 8 fix a constant, and how it is read off.   a constant's values -> what the claim would see

Fig. 8 cannot see these constants. Each was set to one claim, which counts as calibrated on from then:

    edge_glow                F9.3   the ID at 80 degrees, read to 10 m and no farther
    infrared_share_office    F11.2  the ID by infrared light at 20 m in the office, half of the time
    infrared_share_evening   F11.2  the same in the evening
    processing_mev_per_s     F14.5  the ID of a marker that turns fast, right in 70 % of periods wherever it is

`fitted` sets the first three so that the accuracies in their claim's conditions sum to `WANTED`, the last so that it
is `MORE_THAN_70` where there are most events. The other constants are those of the file.
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
from bicode_studies.calibration.search import FAR_PX, FIRST_SEED, judged_periods
from bicode_studies.paper_experiments.processing_limit import HITS, delay_periods
from bicode_studies.paper_experiments.scenes import Condition, scene_of
from bicode_studies.paper_experiments.trial_rows import receiver_settings
from bicode_studies.statistics import over_seeds

PERIODS = 5  # of each seed
WANTED = {"edge_glow": 1.0, "infrared_share_office": 0.5, "infrared_share_evening": 0.5}  # 10 m read, 15 m not; half
MORE_THAN_70 = 0.725  # "more than 70 %": the middle of 70 and 75 %, of which one would say so
FASTEST_RPM = paper.FIG_14_SPEEDS_RPM[-1]
HALVINGS = 7  # of the range that a constant is looked for in
RATE_S = 0.02  # of a recording, enough to count events a second of a near marker


def with_value(scene: Scene, name: str, value: float) -> Scene:
    """A scene and a constant's name and value in, the scene with it, on a sensor just large enough, out.

    Raises
    ------
    ValueError
        A name that is not one of `edge_glow` and the two `infrared_share_...`.
    """
    scene = replace(scene, optics=replace(scene.optics, width=FAR_PX[0], height=FAR_PX[1]))
    if name == "edge_glow":
        return replace(scene, edge_glow=value)
    if name in ("infrared_share_office", "infrared_share_evening"):
        return replace(scene, light=replace(scene.light, infrared_share=value))
    raise ValueError(f"name={name!r} is not read here; choose edge_glow or infrared_share_office, ..._evening")


def conditions_of(name: str) -> list[Condition]:
    """A constant's name in, the conditions that its claim is about out."""
    if name == "edge_glow":
        return [Condition(figure="09", distance_m=distance_m, yaw_deg=80.0) for distance_m in (10.0, 15.0)]
    lux = paper.OFFICE_LUX if name == "infrared_share_office" else paper.EVENING_LUX
    current_ma = paper.FIG_11_CURRENT_MA
    return [Condition(figure="11", distance_m=20.0, current_ma=current_ma, band="infrared", illuminance_lux=lux)]


def fitted(name: str, seeds: int = 20) -> float:
    """A constant's name in; its value as its claim fixes it, with seeds that no figure uses, out.

    A range is halved in the logarithm: more glow of the edges never reads less far, more background never farther.

    Raises
    ------
    ValueError
        A name that is not one of the four above.
    """
    if name == "processing_mev_per_s":
        rate = turning_rate_mev_per_s(0.5, FASTEST_RPM, FIRST_SEED)
        periods = 30 / FASTEST_RPM / (paper.DELTA_T_WHOLE_US * 1e-6)
        return _rounded(rate / ((1 - MORE_THAN_70) * periods - (HITS - 1)))
    if name not in WANTED:
        raise ValueError(f"name={name!r} is not fitted here; choose one of {', '.join(WANTED)}, processing_mev_per_s")
    low, high = np.log([all_constants()[name].low, all_constants()[name].high])
    for _ in range(HALVINGS):
        middle = float(low + high) / 2
        read = accuracy_over(name, [float(np.exp(middle))], range(FIRST_SEED, FIRST_SEED + seeds))
        is_too_much = (read["accuracy"].sum() > WANTED[name]) == (name == "edge_glow")
        low, high = (low, middle) if is_too_much else (middle, high)
    return _rounded(float(np.exp((low + high) / 2)))


def _rounded(value: float) -> float:
    """A number in, its first three digits out."""
    return float(f"{value:.3g}")


def accuracy_over(name: str, values: Iterable[float], seeds: Iterable[int]) -> pd.DataFrame:
    """A constant's name, values and seeds in; accuracy of the ID in its claim's conditions out, with its interval.

    Returns
    -------
    DataFrame
        ``name``, ``value``, ``distance_m``, then as `over_seeds` has it.
    """
    seeds = list(seeds)
    cells = [(value, condition, seed) for value in values for condition in conditions_of(name) for seed in seeds]
    rows: list[dict[str, Any]] = []
    for value, condition, seed in tqdm(cells, desc=name, unit=" trials", disable=None):
        scene = with_value(scene_of(condition, seed), name, value)
        right = int(judged_periods(scene, receiver_settings(condition), seed, PERIODS, False)["id_right"].sum())
        rows.append({"name": name, "value": value, "distance_m": condition.distance_m,
                     "periods": PERIODS, "id_right": right})  # fmt: skip
    return over_seeds(pd.DataFrame(rows), ["name", "value", "distance_m"])


def turning_rate_mev_per_s(distance_m: float, rpm: float, seed: int = 0) -> float:
    """A distance and a rate of turning in; events of the marker a second out [Mev/s]."""
    scene = scene_of(Condition(figure="14", distance_m=distance_m, rpm=rpm), seed)
    return float(record(scene, RATE_S, np.random.default_rng([seed, 2])).size / (RATE_S * 1e6))


def accuracy_in_time(mev_per_s: float, limit_mev_per_s: float, rpm: float) -> float:
    """A rate of events, a limit and a rate of turning in; mean share of the periods of half a turn not lost out.

    That is what IV-F would see of a receiver that reads every period it comes to, see `processing_limit`.

    Examples
    --------
    >>> accuracy_in_time(20.0, 20.0, rpm=16) > accuracy_in_time(20.0, 20.0, rpm=64)
    True
    """
    periods = 30 / rpm / (paper.DELTA_T_WHOLE_US * 1e-6)
    return max(0.0, 1 - (HITS - 1 + delay_periods(mev_per_s, limit_mev_per_s)) / periods)
