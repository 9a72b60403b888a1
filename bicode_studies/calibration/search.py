"""IV-A: the free constants, fitted to Fig. 8 and to nothing else.   ranges of constants -> candidates -> misfit

What is free: how bright the LED is, how sharp the lens and how wide its halo, how fast a pixel is, which pattern the
plate has, and how small a region may be. The search is laid down here, before anything is looked at:

    1. `DRAWS` candidates, each constant drawn evenly from its range in `constants.csv`, and `EARLIER`, the best of each
       pattern that a search before this one came to.
    2. Round each of the `BEST` of them, `NEIGHBOURS` more, a tenth of the range away; `ROUNDS` times.
    3. The `LAST` best are tried again, with other seeds and four times as many. The one that lacks least is taken.

A candidate is tried on the cells that Fig. 8's claims are about, and on the two next to where a range must end, over
the experiments' own time and with seeds that no figure uses. Its misfit is what each claim lacks. While searching,
ranges get a margin, so that the search stays in the middle of what agrees; the last round is judged by the claims'
own bounds, as `claims` does. One that lacks more than `GIVE_UP` is not tried on.

Other searches came before. Without a least region none of 90 candidates lacked less than 0.6: an LED so faint that its
ID ends at 20 m left holes in the near plate at half of the current, where the paper reads it best. With a larger
opening in its place (3 .. 5 px) the best of 1,300 lacked 0.6, nearly all of it in F8.4: it takes small regions rather
than faint ones, so at 30 m it lost the brighter marker. A margin of 0.2 let the ID's range hang on the seeds. With the
margin in the last round as well, three patterns came out alike, and first the one whose plate was lost most often at
2.5 m, where the paper says 100 %: a margin nobody stated had outweighed a number that was.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab import paper
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.constants import all_constants, constant
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_studies.claims.statistics import half_distances
from bicode_studies.paper_experiments.scenes import Condition, scene_of
from bicode_studies.paper_experiments.trial_rows import receiver_settings
from bicode_studies.paper_experiments.variants import with_pattern
from bicode_studies.score import Periods, score
from bicode_studies.sweep.sweep import sweep

DRAWS, BEST, NEIGHBOURS, ROUNDS = 500, 8, 5, 2
SEEDS = {"ID": 8, "2D": 4}  # of a cell, each time that a candidate is tried; far away no two seeds are alike
FIRST_SEED = 1000  # figures use those below
LAST, AGAIN = 8, (1, 2, 3, 4)  # how many are tried again, with these blocks of seeds
GIVE_UP = 1.0

MARGIN = 0.4  # how far an accuracy should stay from the one half at which a range ends; ten seeds scatter by 0.1
STEP_M = 0.3  # by how much the 2D ranges of neighbouring currents should differ
LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
Cell = tuple[str, float, float]
Floats = npt.NDArray[np.float64]
CELLS: dict[Cell, float] = {
    ("ID", STANDARD_MA, 20.0): 1.0, ("ID", STANDARD_MA, 25.0): 0.0,
    ("ID", HIGH_MA, 30.0): 1.0, ("ID", HIGH_MA, 35.0): 0.0, ("ID", LOW_MA, 20.0): 0.0,
    ("2D", STANDARD_MA, 2.5): 1.0, ("2D", STANDARD_MA, 5.0): 0.0, ("2D", HIGH_MA, 2.5): 0.0,
    ("2D", LOW_MA, 2.5): 1.0, ("2D", LOW_MA, 5.0): 0.4, ("2D", STANDARD_MA, 1.0): 1.0,
    ("2D", HIGH_MA, 1.0): 1.0, ("2D", HIGH_MA, 5.0): 0.0, ("2D", STANDARD_MA, 7.5): 0.0,
}  # fmt: skip
"""What a candidate is tried on, in this order: kind, current and distance, with an accuracy that lacks nothing."""
PERIODS = {"ID": 10, "2D": 20}
FAR_PX = (96, 72)  # sensor for the ID's cells; the 2D ones need the paper's width, which ArUco's least size goes by
NEAR_PX = (1280, 200)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Values for the constants that are fitted, see `constants.csv`."""

    led_to_ambient: float
    blur_px: float
    halo_fraction: float
    time_constant_us: float
    aruco_id: int
    min_region_pixels: int


WHOLE = ("aruco_id", "min_region_pixels")
NAMES = tuple(field.name for field in fields(Candidate))
EARLIER = tuple(
    Candidate(**dict(zip(NAMES, values, strict=True)))  # type: ignore[arg-type]
    for values in (
        (1.45, 0.87, 0.02, 314.0, 17, 15), (1.34, 0.584, 0.05, 361.0, 12, 11),
        (1.39, 0.649, 0.0344, 375.0, 19, 11), (1.21, 0.716, 0.05, 202.0, 24, 11),
    )
)  # fmt: skip


def in_the_file() -> Candidate:
    """Nothing in, the values that `constants.csv` has out."""
    return _of({name: constant(name) for name in NAMES})


def drawn_candidates(n: int, rng: np.random.Generator) -> list[Candidate]:
    """So many candidates, each constant drawn evenly from its range."""
    return [_candidate(rng.random(len(NAMES))) for _ in range(n)]


def neighbours(candidate: Candidate, n: int, rng: np.random.Generator) -> list[Candidate]:
    """A candidate in; so many with its pattern and least region, all else a tenth of its range away or so, out."""
    low, high = _ranges()
    held = (np.array([getattr(candidate, name) for name in NAMES], float) - low) / (high - low)
    moved = np.clip(held + 0.1 * rng.standard_normal((n, held.size)), 0, 1)
    kept = {name: getattr(candidate, name) for name in WHOLE}
    return [replace(_candidate(shares), **kept) for shares in moved]


def _ranges() -> tuple[Floats, Floats]:
    """The least and the most of each constant, whole ones with half a step around, shape (constants,)."""
    half = np.array([0.5 if name in WHOLE else 0.0 for name in NAMES])
    low, high = np.array([(all_constants()[name].low, all_constants()[name].high) for name in NAMES]).T
    return low - half, high + half


def _candidate(shares: Floats) -> Candidate:
    """Where each constant lies in its range, 0 .. 1, in; the candidate, three digits each, out."""
    low, high = _ranges()
    return _of(dict(zip(NAMES, (low + shares * (high - low)).tolist(), strict=True)))


def _of(values: Mapping[str, float]) -> Candidate:
    """Constants by name in, the candidate out."""
    kept = {name: round(values[name]) if name in WHOLE else float(f"{values[name]:.3g}") for name in NAMES}
    return Candidate(**kept)  # type: ignore[arg-type]


def candidate_scene(scene: Scene, candidate: Candidate, size_px: tuple[int, int]) -> Scene:
    """A scene and a candidate in, the scene with its constants on a sensor of another size out."""
    return replace(
        with_pattern(scene, candidate.aruco_id),
        light=replace(scene.light, led_to_ambient=candidate.led_to_ambient),
        optics=replace(
            scene.optics, blur_px=candidate.blur_px, halo_fraction=candidate.halo_fraction,
            width=size_px[0], height=size_px[1],
        ),
        pixel_model=replace(scene.pixel_model, time_constant_us=candidate.time_constant_us),
    )  # fmt: skip


def cell_accuracy(candidate: Candidate, cell: Cell, seeds: Iterable[int]) -> float:
    """A candidate, a cell of Fig. 8 and seeds in; its accuracy out."""
    kind, current_ma, distance_m = cell
    condition = Condition(figure="08", distance_m=distance_m, current_ma=current_ma)
    settings = replace(receiver_settings(condition), min_region_pixels=candidate.min_region_pixels)
    shares = []
    for seed in seeds:
        scene = candidate_scene(scene_of(condition, seed), candidate, NEAR_PX if kind == "2D" else FAR_PX)
        judged = judged_periods(scene, settings, seed, PERIODS[kind], kind == "2D")
        shares.append(float(judged["marker_2d_right" if kind == "2D" else "id_right"].mean()))
    return float(np.mean(shares))


def judged_periods(scene: Scene, settings: ReceiverSettings, seed: int, periods: int, detect_2d: bool) -> pd.DataFrame:
    """A scene, a receiver for it and a seed in; so many of its periods, read and judged, out."""
    settings = replace(settings, width=scene.optics.width, height=scene.optics.height, detect_2d=detect_2d)
    period_s = settings.delta_t_whole_us * 1e-6
    recorder = Recorder(scene, periods * period_s, np.random.default_rng([seed, 2]))
    sightings = recognise(recorder, settings, t0_us=0)
    return score(sightings, lambda t_us: truth_at(scene, t_us), Periods(start_us=0, count=periods))


def try_candidate(candidate: Candidate, seed: int) -> list[dict[str, Any]]:
    """A candidate and the number of a block of seeds in; one row, its constants and its cells by name, out.

    Cells are tried in the order of `CELLS` until what is lacking is more than `GIVE_UP`; the others are left out.
    """
    cv2.setNumThreads(1)  # candidates are tried side by side
    found: dict[Cell, float] = {}
    for cell in CELLS:
        many = SEEDS[cell[0]]
        first = FIRST_SEED + seed * many
        found[cell] = cell_accuracy(candidate, cell, range(first, first + many))
        if misfit(found)["sum"] > GIVE_UP:
            break
    return [{**vars(candidate), **{cell_name(cell): accuracy for cell, accuracy in found.items()}}]


def cell_name(cell: Cell) -> str:
    """A cell in, its name in tables ("2D 10.7 mA 2.5 m") out."""
    kind, current_ma, distance_m = cell
    return f"{kind} {current_ma:g} mA {distance_m:g} m"


def misfit(found: Mapping[Cell, float], margin: float = MARGIN) -> dict[str, float]:
    """Accuracies of cells and a margin for ranges in; what each claim of Fig. 8 lacks, and the sum, out; 0 is none.

    A cell that is not there is taken to lack nothing, so what is lacking then is the least it may be.

    Examples
    --------
    >>> flat = {("2D", current_ma, 5.0): 0.0 for current_ma in (LOW_MA, STANDARD_MA)}
    >>> {name: round(lacks, 2) for name, lacks in misfit(flat).items() if lacks}  # two 2D ranges are one
    {'F8.6': 0.3, 'sum': 0.3}
    """
    cells = {**CELLS, **found}

    def ends(kind: str, current_ma: float, last_m: float, next_m: float) -> float:
        inside, outside = cells[kind, current_ma, last_m], cells[kind, current_ma, next_m]
        return max(0.0, 0.5 + margin - inside) + max(0.0, outside - (0.5 - margin))

    ranges = []
    for current_ma in paper.FIG_8_CURRENTS_MA:
        at = sorted(d for kind, ma, d in CELLS if (kind, ma) == ("2D", current_ma))
        ranges.append(half_distances(np.array(at), np.array([[cells["2D", current_ma, d] for d in at]]))[0])
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


def calibrate(store: str | Path, jobs: int, draws: int = DRAWS) -> pd.DataFrame:
    """Where finished candidates are kept, and how many to try at a time, in; a row for each, the best first, out.

    Returns
    -------
    DataFrame
        The constants; ``blocks``, how many blocks of seeds it was tried with; its cells (nan where it was given up
        before), and what each claim lacks. Those of the last round come first.
    """
    rng = np.random.default_rng(0)
    once = _tried([*drawn_candidates(draws, rng), *EARLIER], (0,), store, jobs)
    for _ in range(ROUNDS):
        near = [one for best in _best(once, BEST) for one in neighbours(best, NEIGHBOURS, rng)]
        once = pd.concat([once, _tried(near, (0,), store, jobs)], ignore_index=True).drop_duplicates([*NAMES])
    again = _tried(_best(once, LAST), AGAIN, store, jobs, margin=0.0)
    left = once.merge(again[[*NAMES]], on=[*NAMES], how="left", indicator=True)["_merge"] == "left_only"
    return pd.concat([_sorted(again), _sorted(once[left.to_numpy()])], ignore_index=True)


def judge(candidate: Candidate, store: str | Path, jobs: int) -> pd.DataFrame:
    """One candidate in, its row as in the last round of `calibrate` out."""
    return _tried([candidate], AGAIN, store, jobs, margin=0.0)


def _tried(
    candidates: list[Candidate], blocks: tuple[int, ...], store: str | Path, jobs: int, margin: float = MARGIN
) -> pd.DataFrame:
    """Candidates, each tried with these blocks of seeds: a row for each, means over the blocks, and its misfit."""
    trials = [(candidate, block) for candidate in candidates for block in blocks]
    result = sweep(try_candidate, trials, store, jobs=jobs, data_files=("bicode_lab/constants.csv",))
    if result.failures:
        raise RuntimeError(result.failure_line())
    rows = []
    for values, group in result.table.groupby([*NAMES], sort=False):
        found = {cell: group[cell_name(cell)].mean() for cell in CELLS if cell_name(cell) in group}
        known = {cell: float(accuracy) for cell, accuracy in found.items() if not np.isnan(accuracy)}
        told = {cell_name(cell): known.get(cell, np.nan) for cell in CELLS}
        rows.append({**dict(zip(NAMES, values, strict=True)), "blocks": len(blocks), **told, **misfit(known, margin)})
    return pd.DataFrame(rows)


def _sorted(table: pd.DataFrame) -> pd.DataFrame:
    """Rows in; those that were tried on the longest first, of these the least misfit, out."""
    missing = table.isna().sum(axis=1)
    return table.assign(missing=missing).sort_values(["missing", "sum"], kind="stable").drop(columns="missing")


def _best(table: pd.DataFrame, n: int) -> list[Candidate]:
    """Rows in, the `n` best candidates out."""
    return [_of(row) for row in _sorted(table).head(n)[[*NAMES]].to_dict("records")]  # type: ignore[arg-type]
