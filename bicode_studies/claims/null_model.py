"""A model without sensor and receiver, to compare ours with: what geometry and five anchors predict.

It is made as somebody would make it who doubts that a simulated camera adds anything. There is no chance in it: under
each condition, everything is read or nothing is, but for the periods that are lost after a motion has begun. An anchor
is a result of the paper that the model takes over, so that one of its numbers is known.

    ID      The light of a far plate falls with the square of the distance (IV-A), as current x projected area /
            distance^2. Once a plate is near enough to be resolved, coming nearer gains nothing. Anchors: Fig. 8's 20 m
            with 10.7 mA (the end lies between 20 m and the next tested distance, 25 m), no red light read outdoors
            (F11.0), and half of the infrared IDs at 20 m (F11.2).
    pose    Bright cells spread by the same angle at any distance. This angle goes with the square root of their
            brightness, as the reach of light does that falls with the square. What moves is smeared over delta_t_2D.
            The pose is read while both together take less than half a cell. Anchor: Fig. 8's 2.5 m, where all is read,
            and 7.5 m, where nothing is. A turned plate shows its side face, which must stay below half a cell, too.
    loss    After a motion has begun, ``hits - 1 + delay`` periods have no ID, as in `processing_limit`. Anchor: more
            than 70 % at 64 rpm and 0.5 m (F14.5). The delay falls with the square of the distance.
    region  The plate's image, grown by the spread and foreshortened.

`null_tables` has its answers as a table of trials, and so the rule that judges our trials judges these.
"""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np
import pandas as pd

from bicode_lab import paper
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.frames_of_fig_13 import PANELS
from bicode_studies.paper_experiments.grids import FIGURES, conditions
from bicode_studies.paper_experiments.processing_limit import HITS

SIZE_M, CURRENT_MA, THICKNESS_M = 0.05, 10.7, 0.005
FOCAL_PX = 8e-3 / 4.86e-6
FIELD = 1280 / FOCAL_PX  # width of what the camera sees, over its distance
RANGE_M = math.sqrt(20 * 25)  # of the ID with 10.7 mA on 5 cm in red light
INFRARED_RANGE_M = 20.0  # with 20.4 mA, in the office and in the evening
RESOLVED_M = 12.0  # about the middle: below 9.4 m, F11.0 would be read; above 16 m, no ID would be read at 5.5 mA
POSE_RANGE_M = math.sqrt(2.5 * 7.5)  # of the pose with 10.7 mA on 5 cm
CELLS = 6  # along a side of the plate
HALF = 0.5  # of a cell may be lost
NEAREST_M, NEAREST_DELAY = 0.5, 2.0  # periods; 2.3 would be 70 % of the 14 periods of half a turn at 64 rpm
DELTA_T_2D_S, PERIOD_S = paper.DELTA_T_2D_US * 1e-6, paper.DELTA_T_WHOLE_US * 1e-6
SEEDS, PERIODS = 400, 200  # many, since the model has no chance: each of its intervals should be narrow


def contrast(condition: Condition) -> float:
    """Return the plate's luminance over that of the room, relative to 10.7 mA on 5 cm in the office.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
    """
    if condition.band == "infrared":
        luminance = condition.current_ma / paper.FIG_11_CURRENT_MA * (INFRARED_RANGE_M / RANGE_M) ** 2
        room = max(1.0, condition.illuminance_lux / paper.EVENING_LUX)  # office and evening are alike (F11.2)
    else:
        luminance, room = condition.current_ma / CURRENT_MA, condition.illuminance_lux / paper.OFFICE_LUX
    return luminance * (SIZE_M / condition.size_m) ** 2 / room


def foreshortened(condition: Condition) -> float:
    """Return the area that a turned plate shows, its side face included, over that of its face.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
    """
    yaw = math.radians(condition.yaw_deg)
    return math.cos(yaw) + THICKNESS_M / condition.size_m * math.sin(yaw)


def id_accuracy(condition: Condition) -> float:
    """Return the share of the periods in which the ID is read, without the processing limit.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
        1 within the range, 0.5 at its very end, 0 beyond.
    """
    range_m = RANGE_M * condition.size_m / SIZE_M
    far = foreshortened(condition) * (range_m / condition.distance_m) ** 2
    light = contrast(condition) * min(far, (RANGE_M / RESOLVED_M) ** 2)
    return float(np.heaviside(round(light, 9) - 1, 0.5))


def lost_of_a_cell(condition: Condition) -> float:
    """Return by which share of a cell its bright neighbours spread and move within delta_t_2D.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
        In cells as the camera sees them; `HALF` where the pose ends.
    """
    yaw = math.radians(condition.yaw_deg)
    cell_m = condition.size_m / CELLS
    spread = HALF * condition.distance_m / POSE_RANGE_M * SIZE_M / condition.size_m * math.sqrt(contrast(condition))
    pan_m = condition.speed_m_per_s * DELTA_T_2D_S
    turn_m = 2 * math.pi * condition.rpm / 60 * DELTA_T_2D_S * condition.size_m / 2
    return spread / math.cos(yaw) + (pan_m + turn_m) / cell_m


def pose_accuracy(condition: Condition) -> float:
    """Return the share of the periods in which the pose is read.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
        1 or 0.
    """
    side_face_m = THICKNESS_M * math.sin(math.radians(condition.yaw_deg))
    cell_m = condition.size_m * foreshortened(condition) / CELLS
    is_read = lost_of_a_cell(condition) < HALF and side_face_m < HALF * cell_m
    return float(is_read and id_accuracy(condition) > 0)


def share_kept(condition: Condition) -> float:
    """Return the share of the periods that the processing limit leaves.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
        1 where nothing moves.
    """
    if not condition.moves:
        return 1.0
    if condition.rpm:
        seconds = 30 / condition.rpm  # half a turn
    else:
        seconds = FIELD * condition.distance_m / condition.speed_m_per_s
    lost = HITS - 1 + NEAREST_DELAY * (NEAREST_M / condition.distance_m) ** 2
    return max(0.0, 1 - lost * PERIOD_S / seconds)


def region_px(condition: Condition) -> float:
    """Return the number of lit pixels of the plate.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
    """
    spread_px = HALF * SIZE_M / CELLS * FOCAL_PX / POSE_RANGE_M * math.sqrt(contrast(condition))
    side_px = condition.size_m * FOCAL_PX / condition.distance_m
    return foreshortened(condition) * (side_px + spread_px) ** 2


def null_tables() -> dict[str, pd.DataFrame]:
    """Return what this model says about every condition of the figures, as tables of trials.

    Returns
    -------
    dict of str to DataFrame
        By figure, "08" .. "14", in the columns of our trials that claims are judged by. All seeds have the same
        counts; counts are whole periods of 200, as in the paper.
    """
    seeds = pd.DataFrame({"seed": range(SEEDS)})
    tables = {}
    for figure in FIGURES:
        rows = []
        for condition in conditions(figure):
            read, plates = id_accuracy(condition), round(PERIODS * pose_accuracy(condition))
            for receiver, kept in (("ours", 1.0), ("authors", share_kept(condition))):
                counts = {"periods": PERIODS, "id_right": round(PERIODS * read * kept), "marker_2d_right": plates}
                rows.append({**asdict(condition), "receiver": receiver, "frame_rule_2d": "any", **counts})
        tables[figure] = pd.DataFrame(rows).merge(seeds, how="cross")
    panels = [{"panel": name, "region_px": region_px(condition)} for name, condition in PANELS.items()]
    return {**tables, "13": pd.DataFrame(panels).merge(seeds, how="cross")}
