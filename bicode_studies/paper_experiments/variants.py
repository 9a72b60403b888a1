"""Variants of the experiments: the scene or the receiver is changed, and the few trials that explain a curve are run.

The notebooks use these to show why a curve ends where it does. All receivers of a call read the same recording, so
that they differ in nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from tqdm import tqdm

from bicode_lab.camera import MarkerTruth, Scene, record, truth_at
from bicode_lab.recognition.marker_2d import Marker2d, find_marker_2d, frame_2d
from bicode_studies import trial
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of

SettingsOf = Callable[[Condition], trial.Settings]
SceneChange = Callable[[Scene], Scene]
COLUMNS = ["seed", "periods", "receiver", "id_right", "marker_2d_right", "axes_wrong"]


def read_with(
    conditions: Iterable[Condition],
    receivers: Mapping[str, SettingsOf] | None = None,
    *,
    seeds: int,
    periods: int,
    changed: SceneChange = lambda scene: scene,
) -> pd.DataFrame:
    """Record each condition with each seed and read it with every receiver.

    Parameters
    ----------
    conditions : iterable of Condition
        Their `duration_s` is not used.
    receivers : mapping of str to callable, optional
        By name, a function that takes a condition and returns the settings of a receiver. None takes the receiver of
        the experiments, with the name "ours".
    seeds : int
        Number of recordings of each condition; they have the scenes of the experiments' seeds 0 .. seeds - 1.
    periods : int
        Length of each recording, in periods.
    changed : callable
        Takes the scene of the experiment and returns the scene to record.

    Returns
    -------
    DataFrame
        One row for each condition, seed and receiver: the fields of the condition, ``seed``, ``periods`` (count, with
        the marker in view), ``receiver``; counts of periods ``id_right``, ``marker_2d_right`` and ``axes_wrong``, in
        which the pattern was found but an axis points elsewhere.
    """
    trials = list(product(conditions, range(seeds)))
    tables = []
    for condition, seed in tqdm(trials, unit=" recordings", leave=False, disable=None):
        settings = {name: of(condition) for name, of in (receivers or {"ours": receiver_settings}).items()}
        rows = trial.run(changed(scene_of(condition, seed)), settings, periods=periods, seed=seed)
        stated = pd.DataFrame([asdict(condition)] * len(rows))
        tables.append(pd.concat([stated, rows[COLUMNS]], axis=1))
    return pd.concat(tables, ignore_index=True)


def with_pattern(scene: Scene, aruco_id: int) -> Scene:
    """Return a scene of one marker with another pattern on its plate.

    Parameters
    ----------
    scene : Scene
    aruco_id : int
        Number of the pattern in its ArUco dictionary.

    Returns
    -------
    Scene
    """
    placed = scene.markers[0]
    board = replace(placed.marker.board, aruco_id=aruco_id)
    return replace(scene, markers=(replace(placed, marker=replace(placed.marker, board=board)),))


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame2dSample:
    """The first 2D frame of a trial, and what is found in it.

    Attributes
    ----------
    scene : Scene
    frame : ndarray, shape (height, width)
        As the search for 2D markers gets it.
    truth : MarkerTruth
        Of the marker, in the middle of the frame's time.
    found : Marker2d or None
        The 2D marker with the number of the marker's own pattern.
    """

    scene: Scene
    frame: npt.NDArray[Any]
    truth: MarkerTruth
    found: Marker2d | None

    def box_px(self, margin_px: float) -> tuple[float, float, float, float]:
        """Return the true box of the plate with a margin on all sides.

        Parameters
        ----------
        margin_px : float
            Width of the margin [px].

        Returns
        -------
        x, y, w, h : float
            Left, top, width and height [px].
        """
        x, y, w, h = self.truth.box_px
        return x - margin_px, y - margin_px, w + 2 * margin_px, h + 2 * margin_px

    @property
    def lit_share(self) -> float:
        """Number of pixels of the plate that are not 0, over the area of the lit cells of a plate facing the camera."""
        board, pose = self.scene.markers[0].marker.board, self.truth.pose
        side_px = board.size_m * self.scene.optics.focal_px / float(np.linalg.norm(pose.position_m))
        x, y, w, h = (round(value) for value in self.box_px(4))
        n_lit = np.count_nonzero(self.frame[max(y, 0) : y + h, max(x, 0) : x + w])
        return float(n_lit / board.cells().mean() / side_px**2)


def sample_frame_2d(condition: Condition, seed: int = 0, changed: SceneChange = lambda scene: scene) -> Frame2dSample:
    """Record the first 2D frame of a trial and search it for the 2D marker.

    Parameters
    ----------
    condition : Condition
        Its `duration_s` is not used.
    seed : int
        Seed of the scene and of the camera's chance.
    changed : callable
        Takes the scene of the experiment and returns the scene to record.

    Returns
    -------
    Frame2dSample
    """
    settings = receiver_settings(condition)
    scene = changed(scene_of(condition, seed))
    events = record(scene, settings.delta_t_2d_us * 1e-6, np.random.default_rng([seed, 2]))
    frame = frame_2d(events, settings)
    truth = truth_at(scene, settings.delta_t_2d_us / 2)[0]
    found = [each for each in find_marker_2d(frame, settings) if each.id == truth.aruco_id]
    return Frame2dSample(scene=scene, frame=frame, truth=truth, found=found[0] if found else None)
