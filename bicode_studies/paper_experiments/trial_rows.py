"""IV: one trial.   condition, seed -> rows

What a trial gives is a row for each of

    ours, any      our receiver on the paper's 3-valued frames; these count for the claims
    ours, count    the same IDs; the 2D marker on frames that count events (Figs 8, 12, 14)
    authors, any   the same, less the share of the whole pan or half turn, from entering to leaving, that the authors'
                   processing limit costs at its start (Figs 8, 12, 14); what a seed records stands for the whole
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import Any

import cv2
import numpy as np
import pandas as pd

from bicode_lab import paper
from bicode_lab.camera import Recorder, truth_at
from bicode_lab.constants import constant
from bicode_lab.events import Events, slice_time, windows
from bicode_lab.recognition import Receiver, ReceiverSettings, Sighting
from bicode_lab.recognition.marker_2d import find_marker_2d, frame_2d
from bicode_studies.paper_experiments.processing_limit import periods_lost
from bicode_studies.paper_experiments.scenes import Condition, scene_of, whole_s
from bicode_studies.score import Periods, score

PERIOD_S = paper.DELTA_T_WHOLE_US * 1e-6
BOTH_FRAMES = ("08", "12", "14")


def receiver_settings(condition: Condition) -> ReceiverSettings:
    """A condition in; the receiver of the reproduction, the paper's times, an opening, a least region, out."""
    return ReceiverSettings(
        pattern_size_m=condition.size_m,
        opening_px=round(constant("opening_px")),
        min_region_pixels=round(constant("min_region_pixels")),
    )


def run_trial(condition: Condition, seed: int) -> list[dict[str, Any]]:
    """A condition and a seed in; a row for each receiver and kind of frame out, see the top of this file."""
    cv2.setNumThreads(1)  # trials run side by side
    scene = scene_of(condition, seed)
    settings = receiver_settings(condition)
    both = condition.figure in BOTH_FRAMES
    receiver = Receiver(settings, 0)
    counting = replace(settings, frame_rule_2d="count") if both else None
    recorder = Recorder(scene, condition.duration_s, np.random.default_rng([seed, 2]))
    sightings: list[Sighting] = []
    graded: list[Sighting] = []
    n_events = 0
    for start_us, events in windows(recorder, settings.delta_t_whole_us, t0_us=0):
        n_events += events.size
        sightings += receiver(start_us, events)
        if counting is not None:
            graded += _plates(start_us, events, counting)
    periods = Periods(start_us=0, count=int(condition.duration_s / PERIOD_S + 1e-6))

    def judged(found: list[Sighting]) -> pd.DataFrame:
        return score(found, lambda t_us: truth_at(scene, t_us), periods)

    by_any = judged(sightings)
    rate_mev_per_s = n_events / (condition.duration_s * 1e6)
    shared = {
        **asdict(condition), "seed": seed, "periods": len(by_any), "events": n_events, "lost": recorder.queue.lost,
        "mev_per_s": round(rate_mev_per_s, 6), "corner_px": _mean(by_any, "corner_px"),
    }  # fmt: skip
    rows = [_row(shared, "ours", "any", by_any)]
    if counting is not None:
        rows.append(_row(shared, "ours", "count", judged(graded).assign(id_right=by_any.get("id_right"))))
        in_time = _in_time(condition, rate_mev_per_s, seed)
        rows.append(_row(shared, "authors", "any", by_any, in_time))
    return rows


def _in_time(condition: Condition, mev_per_s: float, seed: int) -> float:
    """A condition, its events a second and a seed in; the share of the whole way that is worked through in time out."""
    if not condition.moves:
        return 1.0
    lost = periods_lost(mev_per_s, np.random.default_rng([seed, 3]))
    return max(0.0, 1 - lost * PERIOD_S / whole_s(condition))


def _row(
    shared: dict[str, Any], receiver: str, rule: str, judged: pd.DataFrame, in_time: float = 1.0
) -> dict[str, Any]:
    """What all rows of a trial have, one receiver's periods and what share of them counts in; its row out."""
    right = {name: int(judged[name].sum()) if len(judged) else 0 for name in ("id_right", "marker_2d_right")}
    counted = {name: count if in_time == 1 else round(count * in_time, 4) for name, count in right.items()}
    return {**shared, "receiver": receiver, "frame_rule_2d": rule, **counted}


def _mean(judged: pd.DataFrame, name: str) -> float | None:
    """The mean of a column where it is a number; None where it never is."""
    mean = float(judged[name].mean()) if len(judged) else math.nan
    return None if math.isnan(mean) else round(mean, 4)


def _plates(start_us: int, events: Events, settings: ReceiverSettings) -> Iterator[Sighting]:
    """The 2D markers of one period, as sightings."""
    frame = frame_2d(slice_time(events, start_us, start_us + settings.delta_t_2d_us), settings)
    for found in find_marker_2d(frame, settings):
        x, y, w, h = found.box()
        yield Sighting(
            t_us=start_us, track=0, x=x, y=y, w=w, h=h,
            marker_2d_id=found.id, corners=found.corners, rvec=found.rvec, tvec=found.tvec,
        )  # fmt: skip
