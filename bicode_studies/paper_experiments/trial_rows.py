"""One trial of an experiment of section IV: a condition and a seed are recorded once, and the results become rows.

The rows of a trial are, by the columns ``receiver`` and ``frame_rule_2d``:

    ours, any      The reproduction's receiver on the paper's 3-valued frames. The claims are judged by these rows.
    ours, count    The same IDs; 2D markers are found on frames that count events (Figs 8, 12 and 14 only).
    authors, any   As "ours, any", less the share of the motion that the authors' processing limit costs (Figs 8, 12
                   and 14 only). Periods are lost at the start of the whole pan or half turn, from the marker's
                   entering to its leaving; what a seed records of it stands for all of it.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from bicode_lab.camera import Scene
from bicode_lab.events import Events, slice_time
from bicode_lab.recognition import PeriodReader, ReceiverSettings, Sighting
from bicode_lab.recognition.marker_2d import find_marker_2d, frame_2d
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.processing_limit import periods_lost
from bicode_studies.paper_experiments.scenes import motion_duration_s, scene_of
from bicode_studies.score import Periods
from bicode_studies.trial import PERIOD_S, Settings, record_and_read

BOTH_FRAMES = ("08", "12", "14")  # figures with all three rows


@dataclass(frozen=True, kw_only=True)
class Marker2dSettings:
    """Settings of a receiver that finds the 2D markers of each period and reads no ID.

    Attributes
    ----------
    receiver : ReceiverSettings
        Its delta_t_2d, frame rule, pattern and sensor size are used.
    """

    receiver: ReceiverSettings

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""
        return self.receiver.delta_t_whole_us

    def start(self, t0_us: int) -> PeriodReader:
        """Make the receiver; it keeps nothing from one period to the next, so `t0_us` plays no part."""
        return self._read_period

    def _read_period(self, start_us: int, events: Events) -> list[Sighting]:
        """Return a sighting for each 2D marker in the frame of a period."""
        settings = self.receiver
        frame = frame_2d(slice_time(events, start_us, start_us + settings.delta_t_2d_us), settings)
        sightings = []
        for found in find_marker_2d(frame, settings):
            x, y, w, h = found.box()
            sighting = Sighting(
                t_us=start_us, track=0, x=x, y=y, w=w, h=h,
                marker_2d_id=found.id, corners=found.corners, rvec=found.rvec, tvec=found.tvec,
            )  # fmt: skip
            sightings.append(sighting)
        return sightings


def run_trial(condition: Condition, seed: int) -> list[dict[str, Any]]:
    """Record a condition once and return the rows that are listed at the top of this file.

    Parameters
    ----------
    condition : Condition
    seed : int
        Seed of the scene, of the camera's chance and of the authors' processing limit.

    Returns
    -------
    list of dict
        One or three rows: the fields of the condition; ``seed``; ``periods`` (count, with the marker in view);
        ``events`` and ``lost`` (counts, of the whole recording); ``mev_per_s`` (rate of events [Mev/s]);
        ``corner_px`` (mean corner error of the 2D marker on 3-valued frames [px], None where it is never found);
        ``wrong_ids`` (number of sightings, anywhere in the picture, with an ID that the marker does not send; the
        same in all rows of a trial); ``receiver``, ``frame_rule_2d``; ``id_right`` and ``marker_2d_right`` (counts of
        right periods).
    """
    return rows_of(condition, seed, scene_of(condition, seed), receiver_settings(condition))


def rows_of(condition: Condition, seed: int, scene: Scene, settings: ReceiverSettings) -> list[dict[str, Any]]:
    """Record a scene, which a condition was changed to, and return the rows of a trial.

    Parameters
    ----------
    condition : Condition
        Its figure, its motion and its duration count.
    seed : int
        Seed of the camera's chance and of the authors' processing limit.
    scene : Scene
    settings : ReceiverSettings
        Of the receiver that reads it.

    Returns
    -------
    list of dict
        See `run_trial`.
    """
    receivers: dict[str, Settings] = {"any": settings}
    if condition.figure in BOTH_FRAMES:
        receivers["count"] = Marker2dSettings(receiver=replace(settings, frame_rule_2d="count"))
    periods = Periods(start_us=0, count=int(condition.duration_s / PERIOD_S + 1e-6))
    trial = record_and_read(scene, receivers, periods=periods, seed=seed, duration_s=condition.duration_s)
    by_any = trial.readings["any"].scores
    rate_mev_per_s = trial.n_events / (condition.duration_s * 1e6)
    shared = {
        **asdict(condition), "seed": seed, "periods": len(by_any), "events": trial.n_events, "lost": trial.n_lost,
        "mev_per_s": round(rate_mev_per_s, 6), "corner_px": _mean(by_any, "corner_px"),
        "wrong_ids": trial.readings["any"].wrong_ids,
    }  # fmt: skip
    rows = [_row(shared, "ours", "any", by_any)]
    if "count" in receivers:
        by_count = trial.readings["count"].scores.assign(id_right=by_any.get("id_right"))
        rows.append(_row(shared, "ours", "count", by_count))
        rows.append(_row(shared, "authors", "any", by_any, _share_in_time(condition, rate_mev_per_s, seed)))
    return rows


def _share_in_time(condition: Condition, mev_per_s: float, seed: int) -> float:
    """Return the share of the whole motion that the authors' computer reads in time, 0 .. 1."""
    if not condition.moves:
        return 1.0
    lost = periods_lost(mev_per_s, np.random.default_rng([seed, 3]))
    return max(0.0, 1 - lost * PERIOD_S / motion_duration_s(condition))


def _row(
    shared: dict[str, Any], receiver: str, rule: str, scores: pd.DataFrame, in_time: float = 1.0
) -> dict[str, Any]:
    """Return the row of one receiver; `in_time` is the share of its right periods that counts."""
    right = {name: int(scores[name].sum()) if len(scores) else 0 for name in ("id_right", "marker_2d_right")}
    counted = {name: count if in_time == 1 else round(count * in_time, 4) for name, count in right.items()}
    return {**shared, "receiver": receiver, "frame_rule_2d": rule, **counted}


def _mean(scores: pd.DataFrame, name: str) -> float | None:
    """Return the mean of a column without its nan, to four digits; None where there is no number."""
    mean = float(scores[name].mean()) if len(scores) else math.nan
    return None if math.isnan(mean) else round(mean, 4)
