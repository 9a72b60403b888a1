"""The cells of Fig. 8 on which a candidate is tried, and its accuracy in each.

A cell is a kind of reading ("ID" or "2D"), a current and a distance. The 2D marker needs only a frame of 13.2 ms at the
start of each period of 33 ms; here its frames follow each other without a gap. Each frame begins 0.8 ms earlier in the
packet of 14 ms than the one before, so `FRAMES` of them cover all phases of the packet once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bicode_lab import paper
from bicode_lab.camera import Scene
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.calibration.candidates import Candidate, candidate_receiver, candidate_scene
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.paper_experiments.trial_rows import Marker2dSettings
from bicode_studies.score import Periods
from bicode_studies.trial import Reading, record_and_read

LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
Cell = tuple[str, float, float]
SEEDS: dict[Cell, int] = {
    ("2D", STANDARD_MA, 2.5): 4, ("ID", STANDARD_MA, 20.0): 8, ("ID", HIGH_MA, 30.0): 8,
    ("2D", LOW_MA, 2.5): 4, ("2D", HIGH_MA, 2.5): 4,
    ("2D", LOW_MA, 5.0): 4, ("2D", STANDARD_MA, 5.0): 4, ("2D", HIGH_MA, 5.0): 4,
    ("2D", STANDARD_MA, 7.5): 2, ("2D", STANDARD_MA, 1.0): 2,
    ("ID", STANDARD_MA, 25.0): 4, ("ID", HIGH_MA, 35.0): 4, ("ID", LOW_MA, 30.0): 4,
    ("ID", LOW_MA, 40.0): 4, ("ID", HIGH_MA, 40.0): 4, ("ID", LOW_MA, 50.0): 4, ("ID", HIGH_MA, 50.0): 4,
    ("2D", STANDARD_MA, 0.5): 1,
}  # fmt: skip
"""The cells in about the order in which they are tried, each with its number of seeds: fewer where it costs much or
tells little."""
FIRST_SEED = 1000  # figures use lower seeds
MOST_SEEDS = max(SEEDS.values())
PERIODS = 10  # of each recording of an ID
FRAMES = 18  # of each recording of a 2D marker
FAR_PX = (96, 72)  # sensor for the ID's cells
NEAR_PX = (1280, 200)  # for the 2D cells; ArUco's least marker size depends on the width, which is the paper's


def cell_name(cell: Cell) -> str:
    """Return the name of a cell in tables.

    Parameters
    ----------
    cell : tuple
        Kind, current [mA] and distance [m].

    Returns
    -------
    str

    Examples
    --------
    >>> cell_name(("2D", 10.7, 2.5))
    '2D 10.7 mA 2.5 m'
    """
    kind, current_ma, distance_m = cell
    return f"{kind} {current_ma:g} mA {distance_m:g} m"


def seeds_of(cell: Cell, number: int) -> range:
    """Return the seeds of a cell for a trial of a candidate.

    Parameters
    ----------
    cell : tuple
    number : int
        Number of the trial, 0 or more; no two trials share a seed, so that no candidate is chosen for lucky seeds.

    Returns
    -------
    range
    """
    first = FIRST_SEED + number * MOST_SEEDS
    return range(first, first + SEEDS[cell])


def cell_accuracy(candidate: Candidate, cell: Cell, seeds: Iterable[int]) -> float:
    """Return the accuracy of a candidate in a cell.

    Parameters
    ----------
    candidate : Candidate
    cell : tuple
        Kind, current [mA] and distance [m].
    seeds : iterable of int
        Seeds of the recordings.

    Returns
    -------
    float
        Mean share of right periods over the seeds, 0 .. 1.
    """
    kind, current_ma, distance_m = cell
    condition = Condition(figure="08", distance_m=distance_m, current_ma=current_ma)
    settings = candidate_receiver(receiver_settings(condition), candidate)
    shares = []
    for seed in seeds:
        scene = candidate_scene(scene_of(condition, seed), candidate, NEAR_PX if kind == "2D" else FAR_PX)
        if kind == "2D":
            shares.append(_share_2d(scene, settings, seed))
        else:
            scores = read_periods(scene, settings, seed, PERIODS, detect_2d=False).scores
            shares.append(float(scores["id_right"].mean()))
    return float(np.mean(shares))


def _share_2d(scene: Scene, settings: ReceiverSettings, seed: int) -> float:
    """Return the share of right 2D markers in `FRAMES` frames that follow each other."""
    settings = replace(
        settings, width=scene.optics.width, height=scene.optics.height, delta_t_whole_us=settings.delta_t_2d_us
    )
    frames = Periods(start_us=0, count=FRAMES, length_us=settings.delta_t_2d_us)
    trial = record_and_read(scene, {"ours": Marker2dSettings(receiver=settings)}, periods=frames, seed=seed)
    return float(trial.readings["ours"].scores["marker_2d_right"].mean())


def read_periods(scene: Scene, settings: ReceiverSettings, seed: int, periods: int, *, detect_2d: bool) -> Reading:
    """Record a scene and read it with a receiver for the size of the scene's sensor.

    Parameters
    ----------
    scene : Scene
    settings : ReceiverSettings
        Its sensor size is replaced by that of the scene.
    seed : int
        Seed of the camera's chance.
    periods : int
        Number of periods; all are judged.
    detect_2d : bool
        True to search for 2D markers, too.

    Returns
    -------
    Reading
    """
    settings = replace(settings, width=scene.optics.width, height=scene.optics.height, detect_2d=detect_2d)
    judged = Periods(start_us=0, count=periods)
    return record_and_read(scene, {"ours": settings}, periods=judged, seed=seed).readings["ours"]
