"""Tables of the errors of poses: one row for each look, and one for each case."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from bicode_lab.camera import MarkerTruth, record, truth_at
from bicode_lab.pose import PoseSettings, estimate_pose
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_studies.pose_accuracy.cases import WARM_UP_PERIODS, Case, scene_of
from bicode_studies.pose_accuracy.ruler import pose_errors
from bicode_studies.statistics import wilson

LIMIT_95 = 12.592  # of chi-squared with six degrees of freedom
MOST_WRONG_DEG = 20.0  # a pose that is said to be sure must not be farther off
QUARTER_DEG = 45.0  # a roll beyond is a wrong quarter-turn


def look_at(case: Case, seed: int) -> dict[str, Any]:
    """Record a case once, read it, estimate the pose and compare it with the truth.

    Box, packets and clock are the paper's receiver's own.

    Parameters
    ----------
    case : Case
    seed : int

    Returns
    -------
    dict
        ``case``, ``seed``, ``tilt_deg``, ``reason``; the errors of the most probable pose (see `ruler.PoseErrors`),
        nan without a pose; ``poses``, ``sure``; ``nearest_deg`` and ``nearest_distance`` of the pose that is nearest to
        the truth, and ``nearest_first``, whether that is the most probable one.
    """
    scene = scene_of(case, seed)
    receiver = ReceiverSettings(detect_2d=False)
    period_us = receiver.delta_t_whole_us
    events = record(scene, (WARM_UP_PERIODS + case.periods) * period_us * 1e-6, np.random.default_rng([seed, 2]))
    first_us = WARM_UP_PERIODS * period_us
    sightings = [sighting for sighting in recognise(events, receiver, t0_us=0) if sighting.t_us >= first_us]
    tracks = [sighting.track for sighting in sightings if sighting.id == scene.markers[0].marker.payload]
    own = [sighting for sighting in sightings if tracks and sighting.track == tracks[0]]
    settings = PoseSettings(board=scene.markers[0].marker.board, focal_px=scene.optics.focal_px)
    estimate = estimate_pose(events, own, settings, period_us=period_us)
    truth = truth_at(scene, first_us)[0]
    row = {"case": case.name, "seed": seed, "tilt_deg": _tilt_deg(truth), "reason": estimate.reason}
    errors = [pose_errors(pose, truth, settings.board.pattern_corners_m(), settings.camera) for pose in estimate.poses]
    if not errors:
        return row
    near = min(range(len(errors)), key=lambda k: errors[k].rotation_deg)
    return {
        **row, **asdict(errors[0]), "right": errors[0].is_right, "poses": len(errors), "sure": estimate.is_sure,
        "nearest_deg": errors[near].rotation_deg, "nearest_distance": errors[near].distance,
        "nearest_first": near == 0,
    }  # fmt: skip


def accuracy_rows(cases: Iterable[Case], seeds: Iterable[int]) -> pd.DataFrame:
    """Look at each case with each seed.

    Parameters
    ----------
    cases : iterable of Case
    seeds : iterable of int

    Returns
    -------
    DataFrame
        One row for each look, see `look_at`, with numbers rounded to four digits after the point.
    """
    listed = list(seeds)
    return pd.DataFrame([look_at(case, seed) for case in cases for seed in listed]).round(4)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Sum up looks, one row for each case.

    Parameters
    ----------
    rows : DataFrame
        See `accuracy_rows`.

    Returns
    -------
    DataFrame
        ``case``, ``looks``, ``found``; medians and 95 % quantiles of the errors of the most probable pose; shares with
        their 95 % intervals (Wilson): ``right``; ``first`` (the pose nearest to the truth is the most probable one);
        ``quarter`` (no wrong quarter-turn); ``inside`` (the 95 % ellipsoid of the nearest pose holds the truth);
        ``nearest_deg``, the median error of the nearest pose; ``sure``, the share said to be sure, and ``sure_wrong``,
        how many of these are off by more than `MOST_WRONG_DEG`.
    """
    return pd.DataFrame([_summed_up(str(name), part) for name, part in rows.groupby("case", sort=False)]).round(4)


def _summed_up(name: str, part: pd.DataFrame) -> dict[str, Any]:
    """Return the row of a case."""
    found = part[part["rotation_deg"].notna()]
    row: dict[str, Any] = {"case": name, "looks": len(part), "found": len(found)}
    for column in ("rotation_deg", "roll_deg", "depth_percent", "lateral_mm", "corner_px"):
        size = found[column].abs()
        row[f"{column}_median"], row[f"{column}_95"] = size.median(), size.quantile(0.95)
    row["nearest_deg"] = found["nearest_deg"].median()
    hits = {
        "right": int(found["right"].sum()),
        "first": int(found["nearest_first"].sum()),
        "quarter": int((found["roll_deg"].abs() < QUARTER_DEG).sum()),
        "inside": int((found["nearest_distance"] < LIMIT_95).sum()),
    }
    for column, count in hits.items():
        low, high = wilson(count, len(part))
        row[column], row[f"{column}_low"], row[f"{column}_high"] = count / len(part), low, high
    sure = found[found["sure"].astype(bool)]
    row["sure"], row["sure_wrong"] = len(sure) / len(part), int((sure["rotation_deg"] > MOST_WRONG_DEG).sum())
    return row


def _tilt_deg(truth: MarkerTruth) -> float:
    """Return the angle between the plate's normal and the line of sight [deg]."""
    sight = truth.pose.position_m / np.linalg.norm(truth.pose.position_m)
    return float(np.degrees(np.arccos(np.clip(-truth.pose.rotation[:, 2] @ sight, -1, 1))))
