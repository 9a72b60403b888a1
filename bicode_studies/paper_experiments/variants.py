"""Why does it end there?   conditions of an experiment, scene and receivers as changed -> rows of trials, frames

The experiments' scenes with something changed, for the few trials with which a notebook explains a curve. One
recording is read by every receiver given, so that they differ in nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd
from tqdm import tqdm

from bicode_lab.camera import MarkerTruth, Scene, record, truth_at
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, frame_2d
from bicode_lab.soft_receiver import SoftSettings
from bicode_studies.paper_experiments.grids import PERIOD_S
from bicode_studies.paper_experiments.scenes import Condition, scene_of
from bicode_studies.paper_experiments.trial_rows import receiver_settings
from bicode_studies.score import AXIS_DEG, Periods, score

Reader = Callable[[Condition], ReceiverSettings | SoftSettings]
SceneChange = Callable[[Scene], Scene]


def read_with(
    conditions: Iterable[Condition],
    receivers: Mapping[str, Reader] | None = None,
    *,
    seeds: int,
    periods: int,
    changed: SceneChange = lambda scene: scene,
) -> pd.DataFrame:
    """Conditions and named receivers in; a row for each condition, seed and receiver out.

    Parameters
    ----------
    conditions : iterable of Condition
        Their duration is not used.
    receivers : mapping of str to a function from a condition to settings, optional
        None takes the experiments' own, named "ours".
    seeds : int
        How many recordings of each condition; the scenes of the experiments' first seeds.
    periods : int
        Length of each recording.
    changed : callable
        An experiment's scene in, the scene to record out.

    Returns
    -------
    DataFrame
        A condition's fields, ``seed``, ``periods``, ``receiver``; counts of periods: ``id_right``,
        ``marker_2d_right`` and ``axes_wrong``, in which the pattern was found, but its axes point elsewhere.
    """
    cv2.setNumThreads(1)
    trials = list(product(conditions, range(seeds)))
    judged = Periods(start_us=0, count=periods)
    rows: list[dict[str, Any]] = []
    for condition, seed in tqdm(trials, unit=" recordings", leave=False, disable=None):
        scene = changed(scene_of(condition, seed))
        events = record(scene, periods * PERIOD_S, np.random.default_rng([seed, 2]))
        for name, reader in (receivers or {"ours": receiver_settings}).items():
            settings = reader(condition)
            sightings = recognise(events, settings, t0_us=0)
            table = score(sightings, partial(truth_at, scene), judged)
            right = {column: int(table[column].sum()) for column in ("id_right", "marker_2d_right")}
            right["axes_wrong"] = int((table["axis_deg"] > AXIS_DEG).sum())
            rows.append({**asdict(condition), "seed": seed, "periods": len(table), "receiver": name, **right})
    return pd.DataFrame(rows)


def with_pattern(scene: Scene, aruco_id: int) -> Scene:
    """A scene of one marker and a pattern's number in, the scene with that pattern on the plate out."""
    placed = scene.markers[0]
    board = replace(placed.marker.board, aruco_id=aruco_id)
    return replace(scene, markers=(replace(placed, marker=replace(placed.marker, board=board)),))


@dataclass(frozen=True, kw_only=True, eq=False)
class Glimpse:
    """What the 2D marker's recogniser is shown of a condition, and what it makes of it.

    Parameters
    ----------
    scene : Scene
    frame : ndarray, shape (height, width)
    truth : MarkerTruth
        In the middle of the frame's time.
    found : Marker2d or None
        Of the marker's own id.
    """

    scene: Scene
    frame: npt.NDArray[Any]
    truth: MarkerTruth
    found: Marker2d | None

    def box_px(self, margin_px: float) -> tuple[float, float, float, float]:
        """A margin in, the plate's box with it around out (x, y, w, h) [px]."""
        x, y, w, h = self.truth.box_px
        return x - margin_px, y - margin_px, w + 2 * margin_px, h + 2 * margin_px

    @property
    def lit_share(self) -> float:
        """Pixels that say something, over the pixels that the glowing cells of a plate facing the camera cover."""
        board, pose = self.scene.markers[0].marker.board, self.truth.pose
        side_px = board.size_m * self.scene.optics.focal_px / float(np.linalg.norm(pose.position_m))
        x, y, w, h = (round(value) for value in self.box_px(4))
        return float(
            np.count_nonzero(self.frame[max(y, 0) : y + h, max(x, 0) : x + w]) / board.cells().mean() / side_px**2
        )


def glimpse(condition: Condition, seed: int = 0, changed: SceneChange = lambda scene: scene) -> Glimpse:
    """A condition and a seed in; the first frame of its 2D marker, and what is found in it, out."""
    settings = receiver_settings(condition)
    scene = changed(scene_of(condition, seed))
    events = record(scene, settings.delta_t_2d_us * 1e-6, np.random.default_rng([seed, 2]))
    frame = frame_2d(events, settings)
    truth = truth_at(scene, settings.delta_t_2d_us / 2)[0]
    found = [each for each in find_marker_2d(frame, settings) if each.id == truth.aruco_id]
    return Glimpse(scene=scene, frame=frame, truth=truth, found=found[0] if found else None)
