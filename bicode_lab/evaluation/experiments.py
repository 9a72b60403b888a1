"""IV: the paper's experiments as declared grids.   figure -> conditions, seeds; condition, seed -> rows

Distances are those of DISTANCES_M, each figure's clipped to the paper's range. A condition has about 200 periods,
spread over at least ten seeds; a seed has its own payload, phase, pixels, sub-pixel place and, where something
moves, its own stretch of the pan or start of the turn. Everything else comes from `constants.csv`.

What a trial gives is a row for each of

    ours, any      our receiver on the paper's 3-valued frames; these count for the claims
    ours, count    the same IDs; the 2D marker on frames that count events (Figs 8, 12, 14)
    authors, any   the same readings, those taken off that the authors' processing limit costs (Figs 8, 12, 14)
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
from bicode_lab.evaluation.accuracy import Periods, score
from bicode_lab.evaluation.processing_limit import periods_lost
from bicode_lab.evaluation.setups import Condition, begins_at_s, scene_of
from bicode_lab.events import Events, slice_time
from bicode_lab.recognition import Receiver, ReceiverSettings, Sighting
from bicode_lab.recognition.accumulate import cut
from bicode_lab.recognition.marker_2d import find_marker_2d, frame_2d

DISTANCES_M = (0.5, 1.0, 2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0)
QUICK_M = (1.0, 2.5, 10.0, 20.0, 30.0)
PERIOD_S = paper.DELTA_T_WHOLE_US * 1e-6
PERIODS = 20  # of a seed; ten seeds make the paper's 200
SEEDS = 10
QUICK_PERIODS = 3
QUICK_SEEDS = 2
NOON_LUX = 20_000.0
SHORT_RANGE_M = 2.5  # Fig. 14 ends here
BOTH_FRAMES = ("08", "12", "14")


def conditions(figure: str, quick: bool = False) -> list[Condition]:
    """A figure, "08" .. "14", and a scale in; its grid out.

    Raises
    ------
    ValueError
        A figure without a grid.
    """
    if figure not in _GRIDS:
        raise ValueError(f"figure {figure!r} has no grid; choose one of {', '.join(_GRIDS)}")
    least, most, settings = _GRIDS[figure]
    distances = [d for d in (QUICK_M if quick else DISTANCES_M) if least <= d <= most]
    return [
        _timed(Condition(figure=figure, distance_m=distance, **setting), quick)
        for setting in settings
        for distance in distances
    ]


_GRIDS: dict[str, tuple[float, float, tuple[dict[str, Any], ...]]] = {
    "08": (0.5, 50.0, tuple({"current_ma": current} for current in paper.FIG_8_CURRENTS_MA)),
    "09": (0.5, 35.0, tuple({"yaw_deg": yaw} for yaw in paper.FIG_9_YAWS_DEG)),
    "10": (
        0.5, 50.0,
        tuple(
            {"size_m": size_m, "current_ma": current_ma}
            for size_m, current_ma in zip(paper.FIG_10_SIZES_M, paper.FIG_10_CURRENTS_MA, strict=True)
        ),
    ),
    "11": (
        0.5, 50.0,
        (
            {"band": "red", "illuminance_lux": paper.EVENING_LUX},
            *(
                {"band": "infrared", "current_ma": paper.FIG_11_CURRENT_MA, "illuminance_lux": lux}
                for lux in (paper.OFFICE_LUX, paper.EVENING_LUX, NOON_LUX)
            ),
        ),
    ),
    "12": (0.5, 25.0, tuple({"speed_m_per_s": speed} for speed in paper.FIG_12_SPEEDS_M_PER_S)),
    "14": (0.5, SHORT_RANGE_M, tuple({"rpm": rpm} for rpm in paper.FIG_14_SPEEDS_RPM)),
}  # fmt: skip


def _timed(condition: Condition, quick: bool) -> Condition:
    """A condition with the time that one seed of it is recorded."""
    periods = QUICK_PERIODS if quick else PERIODS
    if condition.rpm and not quick:
        return replace(condition, duration_s=30 / condition.rpm)  # half a turn
    return replace(condition, duration_s=periods * PERIOD_S)


def seeds(condition: Condition, quick: bool = False) -> range:
    """A condition in, the seeds that it is tried with out: at least ten, and about 200 periods together."""
    if quick:
        return range(QUICK_SEEDS)
    return range(max(SEEDS, round(SEEDS * PERIODS * PERIOD_S / condition.duration_s)))


def receiver_settings(condition: Condition) -> ReceiverSettings:
    """A condition in, the receiver of the reproduction out: the paper's times, an opening, nothing denoised."""
    return ReceiverSettings(pattern_size_m=condition.size_m, opening_px=round(constant("opening_px")))


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
    for start_us, events in cut(recorder, settings.delta_t_whole_us, t0_us=0):
        n_events += events.size
        sightings += receiver(start_us, events)
        if counting is not None:
            graded += _plates(start_us, events, counting)
    periods = Periods(start_us=0, count=int(condition.duration_s / PERIOD_S + 1e-6))

    def judged(found: list[Sighting]) -> pd.DataFrame:
        return score(found, lambda t_us: truth_at(scene, t_us), periods)

    by_sum = judged(sightings)
    rate_mev_per_s = n_events / (condition.duration_s * 1e6)
    shared = {
        **asdict(condition), "seed": seed, "periods": len(by_sum), "events": n_events, "lost": recorder.queue.lost,
        "mev_per_s": round(rate_mev_per_s, 6), "corner_px": _mean(by_sum, "corner_px"),
    }  # fmt: skip
    rows = [_row(shared, "ours", "any", by_sum)]
    if counting is not None:
        rows.append(_row(shared, "ours", "count", judged(graded).assign(id_right=by_sum.get("id_right"))))
        lost = periods_lost(rate_mev_per_s, np.random.default_rng([seed, 3])) if condition.moves else 0
        first = begins_at_s(condition, seed) / PERIOD_S
        in_time = by_sum["period"] + first >= lost if len(by_sum) else None
        late = by_sum if in_time is None else by_sum.assign(
            id_right=by_sum["id_right"] & in_time, marker_2d_right=by_sum["marker_2d_right"] & in_time
        )  # fmt: skip
        rows.append(_row(shared, "authors", "any", late))
    return rows


def _row(shared: dict[str, Any], receiver: str, rule: str, judged: pd.DataFrame) -> dict[str, Any]:
    """What all rows of a trial have, and one receiver's periods, in; its row out."""
    right = {name: int(judged[name].sum()) if len(judged) else 0 for name in ("id_right", "marker_2d_right")}
    return {**shared, "receiver": receiver, "frame_rule_2d": rule, **right}


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
