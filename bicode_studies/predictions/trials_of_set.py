"""The trials of a figure with another set of constants, at a reduced size, in the form of ``results/NN.csv``.

A set replaces the constants that were fitted to Fig. 8; the other ones are those of `constants.csv`. Reduced are

    seeds      Two for each condition, one for a pan.
    periods    `PERIODS` of each, fewer near the camera, where a period has many events.
    distances  of a pan, only those that claims are about (`PAN_M`): a moving wall costs most.
    sensor     only the rows around the marker, and so less of the wall behind a pan. Where the marker stands still and
               is too small for a 2D marker to be found, which depends on the sensor's width, a small sensor is enough,
               and no 2D marker is searched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from bicode_lab.camera import Scene
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.calibration.candidates import NAMES, Candidate, candidate_receiver, candidate_scene, other_constants
from bicode_studies.calibration.cells import FAR_PX
from bicode_studies.paper_experiments import grids
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.frames_of_fig_13 import PANELS, panel_frame
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.paper_experiments.trial_rows import rows_of
from bicode_studies.trial import PERIOD_S

FIGURES = (*grids.FIGURES, "13")
SEEDS, PAN_SEEDS = 2, 1  # of each condition: 0 and 1, which the figures have, too
PERIODS = {0.0: 3, 1.0: 5, 10.0: 10}  # of each seed, from these distances on [m]
PAN_M = (0.5, 1.0, 2.5, 20.0)
LEAST_SIDE = 0.03 / 4  # of a 2D marker, in widths of the sensor: ArUco asks for a perimeter of 0.03


@dataclass(frozen=True, kw_only=True)
class FigureOfSet:
    """A figure that is to be simulated with a set of constants.

    Attributes
    ----------
    figure : str
        One of `FIGURES`.
    candidate : Candidate
    others : str
        Values of all other constants, so that trials are kept under them.
    """

    figure: str
    candidate: Candidate
    others: str


def seeds_of(figure: str) -> range:
    """Return the seeds that a figure is run with."""
    return range(PAN_SEEDS if figure == "12" else SEEDS)


def run_figure_of_set(wanted: FigureOfSet, seed: int) -> list[dict[str, Any]]:
    """Run all conditions of a figure once.

    Parameters
    ----------
    wanted : FigureOfSet
    seed : int
        Seed of all conditions.

    Returns
    -------
    list of dict
        As `trial_rows.run_trial` has them, and for Fig. 13 as `frames_of_fig_13.PanelFrame.row`.

    Raises
    ------
    ValueError
        If `constants.csv` has other values here than where the run was started.
    """
    if wanted.others != other_constants(NAMES):
        raise ValueError("constants.csv has changed since the run was started; start it anew")
    candidate = wanted.candidate
    if wanted.figure == "13":
        frames = (panel_frame(panel, seed, changed=lambda scene: candidate_scene(scene, candidate)) for panel in PANELS)
        return [frame.row() for frame in frames]
    rows: list[dict[str, Any]] = []
    for condition in conditions_of(wanted.figure):
        scene, settings = scene_and_receiver(condition, seed, candidate)
        rows += rows_of(condition, seed, scene, settings)
    return rows


def conditions_of(figure: str) -> list[Condition]:
    """Return the conditions of a figure, each with its reduced duration.

    Parameters
    ----------
    figure : str
        One of `grids.FIGURES`.

    Returns
    -------
    list of Condition
    """
    found = []
    for condition in grids.conditions(figure):
        if condition.speed_m_per_s and condition.distance_m not in PAN_M:
            continue
        periods = PERIODS[max(least_m for least_m in PERIODS if least_m <= condition.distance_m)]
        found.append(replace(condition, duration_s=periods * PERIOD_S))
    return found


def scene_and_receiver(condition: Condition, seed: int, candidate: Candidate) -> tuple[Scene, ReceiverSettings]:
    """Return the scene of a condition with a set of constants, on a sensor as small as it may be, and its receiver.

    Parameters
    ----------
    condition : Condition
    seed : int
    candidate : Candidate

    Returns
    -------
    scene : Scene
    settings : ReceiverSettings
    """
    scene = scene_of(condition, seed)
    width, height = scene.optics.width, scene.optics.height
    side_px = condition.size_m * scene.optics.focal_px / condition.distance_m
    can_find_2d = side_px >= LEAST_SIDE * width
    if not can_find_2d and not condition.moves:
        width, height = FAR_PX
    else:
        height = min(height, math.ceil(1.6 * side_px) + FAR_PX[1])  # a square that turns is 1.42 sides high
    settings = candidate_receiver(receiver_settings(condition), candidate)
    settings = replace(settings, width=width, height=height, detect_2d=can_find_2d)
    return candidate_scene(scene, candidate, (width, height)), settings
