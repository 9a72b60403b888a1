"""IV-A: the free constants, fitted to Fig. 8 and to nothing else.   candidates -> Fig. 8's cells -> misfit

What is free: how bright the LED is, how sharp the lens, how fast a pixel, which pattern the plate has. Every
candidate is tried on the cells that Fig. 8's claims are about, and on the two next to where a range must end. Its
misfit is what each claim lacks, ranges with a margin, so that the choice is in the middle of what agrees and not
at its edge. Other figures are not looked at.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.constants import constant
from bicode_lab.evaluation.accuracy import Periods, score
from bicode_lab.evaluation.claim_statistics import half_distances
from bicode_lab.evaluation.read_with import with_pattern
from bicode_lab.evaluation.setups import Condition, scene_of
from bicode_lab.evaluation.trials import receiver_settings
from bicode_lab.recognition import recognise

MARGIN = 0.2  # how far an accuracy should stay from the one half at which a range ends
STEP_M = 0.3  # by how much the 2D ranges of neighbouring currents should differ
LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
PLATE_CELLS = (
    (LOW_MA, 2.5), (LOW_MA, 5.0),
    (STANDARD_MA, 1.0), (STANDARD_MA, 2.5), (STANDARD_MA, 5.0), (STANDARD_MA, 7.5),
    (HIGH_MA, 1.0), (HIGH_MA, 2.5), (HIGH_MA, 5.0),
)  # fmt: skip
ID_CELLS = ((LOW_MA, 15.0), (STANDARD_MA, 20.0), (STANDARD_MA, 25.0), (HIGH_MA, 30.0), (HIGH_MA, 35.0))
FAR_PX = (96, 72)  # sensor for the far cells; the near ones need the paper's width, which ArUco's least size goes by
NEAR_PX = (1280, 200)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Values for the constants that are fitted, see `constants.csv`."""

    led_to_ambient: float
    blur_px: float
    time_constant_us: float
    aruco_id: int


def candidates(
    led_to_ambient: Iterable[float],
    blur_px: Iterable[float],
    time_constant_us: Iterable[float],
    aruco_id: Iterable[int],
) -> Iterator[Candidate]:
    """Values of each constant in, every combination out."""
    for led, blur, tau, aruco in product(led_to_ambient, blur_px, time_constant_us, aruco_id):
        yield Candidate(led_to_ambient=led, blur_px=blur, time_constant_us=tau, aruco_id=aruco)


def candidate_scene(scene: Scene, candidate: Candidate, size_px: tuple[int, int]) -> Scene:
    """A scene and a candidate in, the scene with its constants, on a sensor of another size, out."""
    return replace(
        with_pattern(scene, candidate.aruco_id),
        light=replace(scene.light, led_to_ambient=candidate.led_to_ambient),
        optics=replace(scene.optics, blur_px=candidate.blur_px, width=size_px[0], height=size_px[1]),
        pixel_model=replace(scene.pixel_model, time_constant_us=candidate.time_constant_us),
    )


def cell_accuracy(candidate: Candidate, current_ma: float, distance_m: float, plate: bool, seeds: int) -> float:
    """A candidate and a cell of Fig. 8 in; accuracy of the 2D marker, or of the ID, over seeds and periods out."""
    periods = 2 if plate else 5
    right = 0
    for seed in range(seeds):
        condition = Condition(figure="08", distance_m=distance_m, current_ma=current_ma)
        scene = candidate_scene(scene_of(condition, seed), candidate, NEAR_PX if plate else FAR_PX)
        judged = judged_periods(scene, condition, seed, periods, plate)
        right += int(judged["marker_2d_right" if plate else "id_right"].sum())
    return right / (seeds * periods)


def judged_periods(scene: Scene, condition: Condition, seed: int, periods: int, detect_2d: bool) -> pd.DataFrame:
    """A scene, its condition and a seed in; so many of its periods, read by the receiver and judged, out."""
    settings = replace(
        receiver_settings(condition), width=scene.optics.width, height=scene.optics.height, detect_2d=detect_2d
    )
    period_s = settings.delta_t_whole_us * 1e-6
    recorder = Recorder(scene, periods * period_s, np.random.default_rng([seed, 2]))
    sightings = recognise(recorder, settings, t0_us=0)
    return score(sightings, lambda t_us: truth_at(scene, t_us), Periods(start_us=0, count=periods))


def fig_8_cells(candidate: Candidate, seeds: int = 10) -> dict[str, float]:
    """A candidate in, the accuracies of Fig. 8's telling cells out, by name ("2D 10.7 mA 2.5 m", "ID ...")."""
    found = {}
    for kind, cells in (("2D", PLATE_CELLS), ("ID", ID_CELLS)):
        for current_ma, distance_m in cells:
            name = f"{kind} {current_ma:g} mA {distance_m:g} m"
            found[name] = cell_accuracy(candidate, current_ma, distance_m, kind == "2D", seeds)
    return found


def misfit(cells: dict[str, float]) -> dict[str, float]:
    """Accuracies of `fig_8_cells` in; what each claim of Fig. 8 lacks, and the sum, out; 0 is none.

    Examples
    --------
    >>> cells = {f"2D {ma:g} mA {d:g} m": float(d < 5) for ma, d in PLATE_CELLS}
    >>> cells |= {f"ID {ma:g} mA {d:g} m": float(d in (20, 30)) for ma, d in ID_CELLS}
    >>> {name: round(lacks, 2) for name, lacks in misfit(cells).items() if lacks}  # the three 2D ranges are one
    {'F8.6': 0.6, 'sum': 0.6}
    """

    def at(kind: str, current_ma: float, distance_m: float) -> float:
        return cells[f"{kind} {current_ma:g} mA {distance_m:g} m"]

    def ends(kind: str, current_ma: float, last_m: float, next_m: float) -> float:
        inside, outside = at(kind, current_ma, last_m), at(kind, current_ma, next_m)
        return max(0.0, 0.5 + MARGIN - inside) + max(0.0, outside - (0.5 - MARGIN))

    ranges = [
        half_distances(np.array(ds), np.array([[at("2D", current_ma, d) for d in ds]]))[0]
        for current_ma in paper.FIG_8_CURRENTS_MA
        for ds in [[d for ma, d in PLATE_CELLS if ma == current_ma]]
    ]
    lacks = {
        "F8.1": sum(1 - at("2D", STANDARD_MA, d) for d in (1.0, 2.5)),
        "F8.2": at("2D", STANDARD_MA, 7.5),
        "F8.3": ends("ID", STANDARD_MA, 20.0, 25.0),
        "F8.4": ends("ID", HIGH_MA, 30.0, 35.0),
        "F8.5": at("ID", LOW_MA, 15.0) * 0.5,
        "F8.6": float(sum(max(0.0, STEP_M - (more - less)) for more, less in pairwise(ranges))),
        "A2": ends("2D", STANDARD_MA, 2.5, 5.0),
    }
    return {**lacks, "sum": sum(lacks.values())}


def calibrate(tried: Iterable[Candidate], jobs: int, seeds: int = 10) -> pd.DataFrame:
    """Candidates in; a row for each, its constants, its cells and what it lacks, the best first, out."""
    tried = list(tried)
    found = Parallel(n_jobs=jobs, return_as="generator")(delayed(fig_8_cells)(one, seeds) for one in tried)
    rows = []
    for candidate, cells in zip(tried, tqdm(found, total=len(tried), unit=" candidates", disable=None), strict=True):
        rows.append({**vars(candidate), **cells, **misfit(cells)})
    return pd.DataFrame(rows).sort_values("sum", kind="stable").reset_index(drop=True)


def in_the_file() -> Candidate:
    """Nothing in, the values that `constants.csv` has out."""
    return Candidate(
        led_to_ambient=constant("led_to_ambient"),
        blur_px=constant("blur_px"),
        time_constant_us=constant("time_constant_us"),
        aruco_id=round(constant("aruco_id")),
    )
