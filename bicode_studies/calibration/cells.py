"""The cells of Fig. 8 on which a candidate is tried, its accuracy in each, and the misfit of the figure's claims.

A cell is a kind of reading ("ID" or "2D"), a current and a distance. The cells are those that the claims of Fig. 8 are
about, and the two next to where a range must end.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bicode_lab import paper
from bicode_lab.camera import Scene
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.calibration.candidates import Candidate, candidate_scene
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.score import Periods
from bicode_studies.statistics import ranges_m
from bicode_studies.trial import Reading, record_and_read

MARGIN = 0.4  # least difference between an accuracy and the one half at which a range ends; ten seeds scatter by 0.1
STEP_M = 0.3  # least difference between the 2D ranges of neighbouring currents
LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
Cell = tuple[str, float, float]
CELLS: dict[Cell, float] = {
    ("ID", STANDARD_MA, 20.0): 1.0, ("ID", STANDARD_MA, 25.0): 0.0,
    ("ID", HIGH_MA, 30.0): 1.0, ("ID", HIGH_MA, 35.0): 0.0, ("ID", LOW_MA, 20.0): 0.0,
    ("2D", STANDARD_MA, 2.5): 1.0, ("2D", STANDARD_MA, 5.0): 0.0, ("2D", HIGH_MA, 2.5): 0.0,
    ("2D", LOW_MA, 2.5): 1.0, ("2D", LOW_MA, 5.0): 0.4, ("2D", STANDARD_MA, 1.0): 1.0,
    ("2D", HIGH_MA, 1.0): 1.0, ("2D", HIGH_MA, 5.0): 0.0, ("2D", STANDARD_MA, 7.5): 0.0,
}  # fmt: skip
"""The cells in the order in which they are tried, each with an accuracy at which the claims have no misfit."""
PERIODS = {"ID": 10, "2D": 20}  # of each recording
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
    settings = replace(receiver_settings(condition), min_region_pixels=candidate.min_region_pixels)
    shares = []
    for seed in seeds:
        scene = candidate_scene(scene_of(condition, seed), candidate, NEAR_PX if kind == "2D" else FAR_PX)
        scores = read_periods(scene, settings, seed, PERIODS[kind], detect_2d=kind == "2D").scores
        shares.append(float(scores["marker_2d_right" if kind == "2D" else "id_right"].mean()))
    return float(np.mean(shares))


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


def misfit(found: Mapping[Cell, float], margin: float = MARGIN) -> dict[str, float]:
    """Return the misfit of each claim of Fig. 8 and their sum; 0 means that all claims are met.

    Parameters
    ----------
    found : mapping of cell to float
        Accuracies, 0 .. 1. A cell that is left out counts as one without misfit, so the sum is then a lower bound.
    margin : float
        Least difference between an accuracy and one half where a range must end between two distances.

    Returns
    -------
    dict of str to float
        Misfit by the number of the claim in ``data/paper_claims.csv``, and their ``"sum"``. Shares count as they are,
        and so do the metres by which 2D ranges differ too little.

    Examples
    --------
    >>> flat = {("2D", current_ma, 5.0): 0.0 for current_ma in (LOW_MA, STANDARD_MA)}
    >>> {name: round(lacks, 2) for name, lacks in misfit(flat).items() if lacks}  # two 2D ranges are the same
    {'F8.6': 0.3, 'sum': 0.3}
    """
    cells = {**CELLS, **found}

    def ends(kind: str, current_ma: float, last_m: float, next_m: float) -> float:
        inside, outside = cells[kind, current_ma, last_m], cells[kind, current_ma, next_m]
        return max(0.0, 0.5 + margin - inside) + max(0.0, outside - (0.5 - margin))

    ranges = []
    for current_ma in paper.FIG_8_CURRENTS_MA:
        at = sorted(d for kind, ma, d in CELLS if (kind, ma) == ("2D", current_ma))
        ranges.append(ranges_m(np.array(at), np.array([[cells["2D", current_ma, d] for d in at]]))[0])
    lacks = {
        "F8.1": sum(1 - cells["2D", STANDARD_MA, d] for d in (1.0, 2.5)),
        "F8.2": cells["2D", STANDARD_MA, 7.5],
        "F8.3": ends("ID", STANDARD_MA, 20.0, 25.0),
        "F8.4": ends("ID", HIGH_MA, 30.0, 35.0),
        "F8.5": max(0.0, cells["ID", LOW_MA, 20.0] - (0.5 - margin)),
        "F8.6": float(sum(max(0.0, STEP_M - (less - more)) for less, more in pairwise(ranges))),
        "A2": ends("2D", STANDARD_MA, 2.5, 5.0),
    }
    return {**lacks, "sum": sum(lacks.values())}
