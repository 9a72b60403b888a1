"""The frames of Fig. 13: one frame for each panel and seed, and how much of the marker's neighbourhood is lit.

    a .. g   frames of delta_t_2D at 2.5 m: current (a, b, c), angle (b, d, e), size (f, b, g)
    h, i     frames of delta_t_blinker while the camera pans before a wall
    j, k     frames of delta_t_blinker while the marker spins, near and far

A pixel of a frame has the polarity of its last event, as in the authors' software; it is 0 where there is no event.
The short frames lie within a payload, where the LED blinks (the paper does not say where). Before a frame begins, one
packet has passed, because the simulated camera starts with pixels adapted to the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.boxes import Box
from bicode_lab.camera import Scene, record, truth_at
from bicode_lab.camera.truth import packet_starts_us
from bicode_lab.events import slice_time
from bicode_lab.recognition.accumulate import Frame, accumulate
from bicode_lab.recordings.formats import whole_file
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.repository import results_folder
from bicode_studies.trial import PERIOD_S

LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
SLOW_M_PER_S, _, FAST_M_PER_S = paper.FIG_12_SPEEDS_M_PER_S
NEAR_M, FAR_M = 0.5, 2.5
AROUND = 0.25  # width of the neighbourhood around the marker, in larger sides of its box ...
AROUND_PX = 12  # ... and its least width: blur and halo reach beyond the plate


def _condition(distance_m: float = FAR_M, **setting: Any) -> Condition:
    """Return the condition of a panel. It lasts one period, so that the seeds of a pan cover the whole pan."""
    return Condition(figure="13", distance_m=distance_m, duration_s=PERIOD_S, **setting)


PANELS: dict[str, Condition] = {
    "a": _condition(current_ma=LOW_MA),
    "b": _condition(current_ma=STANDARD_MA),
    "c": _condition(current_ma=HIGH_MA),
    "d": _condition(yaw_deg=paper.FIG_9_YAWS_DEG[1]),
    "e": _condition(yaw_deg=paper.FIG_9_YAWS_DEG[2]),
    "f": _condition(size_m=paper.FIG_10_SIZES_M[0], current_ma=paper.FIG_10_CURRENTS_MA[0]),
    "g": _condition(size_m=paper.FIG_10_SIZES_M[2], current_ma=paper.FIG_10_CURRENTS_MA[2]),
    "h": _condition(speed_m_per_s=SLOW_M_PER_S),
    "i": _condition(speed_m_per_s=FAST_M_PER_S),
    "j": _condition(NEAR_M, rpm=paper.FIG_14_SPEEDS_RPM[0]),
    "k": _condition(FAR_M, rpm=paper.FIG_14_SPEEDS_RPM[0]),
}
BLINKER_PANELS = "hijk"


@dataclass(frozen=True, eq=False, kw_only=True)
class PanelFrame:
    """One panel of Fig. 13, recorded with one seed.

    Attributes
    ----------
    panel : str
        "a" .. "k".
    seed : int
    condition : Condition
    kind : {"2d", "blinker"}
        Whether the frame has the length delta_t_2D or delta_t_blinker.
    frame : ndarray of int8, shape (height, width)
        -1, 0 or +1.
    box_px : tuple of 4 floats
        Left, top, width and height of the plate's image in the middle of the frame's time, from the truth [px].
    neighbourhood_px : Box
        The same box, widened and cut to the sensor.
    region_px : int
        Number of pixels of the neighbourhood that are not 0.
    events : int
        Number of events of the whole sensor in the frame's time.
    """

    panel: str
    seed: int
    condition: Condition
    kind: str
    frame: Frame = field(repr=False)
    box_px: tuple[float, float, float, float]
    neighbourhood_px: Box
    region_px: int
    events: int

    @property
    def aruco_id(self) -> int:
        """Number of the pattern on the plate."""
        return scene_of(self.condition, self.seed).markers[0].marker.board.aruco_id

    def row(self) -> dict[str, Any]:
        """Return the row of the table of Fig. 13, which leaves out the frame."""
        counts = {"panel": self.panel, "seed": self.seed, "region_px": self.region_px, "events": self.events}
        return {**counts, "frame_kind": self.kind, **asdict(self.condition)}


def panel_frame(
    panel: str, seed: int, distance_m: float | None = None, changed: Callable[[Scene], Scene] = lambda scene: scene
) -> PanelFrame:
    """Record the frame of a panel and count the lit pixels around the marker.

    Parameters
    ----------
    panel : str
        "a" .. "k".
    seed : int
        Seed of the scene and of the camera's chance.
    distance_m : float, optional
        Another distance from camera to marker [m]; None keeps that of the panel.
    changed : callable
        Takes the scene of the panel and returns the scene to record, on a sensor of the same size.

    Returns
    -------
    PanelFrame

    Raises
    ------
    ValueError
        If Fig. 13 has no such panel.
    """
    if panel not in PANELS:
        raise ValueError(f"panel {panel!r} is not in Fig. 13; choose one of {', '.join(PANELS)}")
    condition, kind = PANELS[panel], "blinker" if panel in BLINKER_PANELS else "2d"
    if distance_m is not None:
        condition = replace(condition, distance_m=distance_m)
    scene, settings = changed(scene_of(condition, seed)), receiver_settings(condition)
    length_us = settings.delta_t_blinker_us if kind == "blinker" else settings.delta_t_2d_us
    start_us = _payload_frame_start_us(scene, length_us) if kind == "blinker" else paper.PACKET_US
    events = record(scene, (start_us + length_us) * 1e-6, np.random.default_rng([seed, 2]))
    events = slice_time(events, start_us, start_us + length_us)
    frame = accumulate(events, settings.width, settings.height, "last")
    box = truth_at(scene, start_us + length_us / 2)[0].box_px
    x, y, w, h = near = neighbourhood(box, settings.width, settings.height)
    region_px = int(np.count_nonzero(frame[y : y + h, x : x + w]))
    return PanelFrame(
        panel=panel, seed=seed, condition=condition, kind=kind, frame=frame, box_px=box, neighbourhood_px=near,
        region_px=region_px, events=events.size,
    )  # fmt: skip


def _payload_frame_start_us(scene: Scene, length_us: int) -> int:
    """Return the start of a frame in the middle of a payload, one packet or more after the start of the scene [us].

    The times of the packets are those of the truth; the authors, too, chose which frame to print.
    """
    begins_us = packet_starts_us(scene, 0, 2 * paper.PACKET_US)
    middle_us = begins_us + paper.START_US + paper.PAYLOAD_BITS * 1e6 / paper.F_ID_HZ / 2
    from_us = middle_us - length_us / 2
    return round(float(from_us[from_us >= paper.PACKET_US][0]))


def neighbourhood(box_px: tuple[float, float, float, float], width: int, height: int) -> Box:
    """Return the pixels that the light of a plate may reach.

    Parameters
    ----------
    box_px : tuple of 4 floats
        Left, top, width and height of the plate's image [px].
    width, height : int
        Size of the sensor [px].

    Returns
    -------
    Box
        The box with a margin of a quarter of its larger side, or of 12 px, cut to the sensor.

    Examples
    --------
    >>> tuple(neighbourhood((100, 100, 40, 80), 1280, 720))
    (80, 80, 81, 121)
    >>> tuple(neighbourhood((2, 700, 20, 10), 1280, 720))
    (0, 688, 35, 32)
    """
    x, y, w, h = box_px
    around = max(AROUND * max(w, h), AROUND_PX)
    left, top = int(np.floor(x - around)), int(np.floor(y - around))
    right, bottom = int(np.ceil(x + w + around)) + 1, int(np.ceil(y + h + around)) + 1
    return Box.between(left, top, right, bottom).clipped(width, height)


def panel_table(seeds: Iterable[int], panels: Iterable[str] = PANELS) -> pd.DataFrame:
    """Record panels with several seeds.

    Parameters
    ----------
    seeds : iterable of int
    panels : iterable of str

    Returns
    -------
    DataFrame
        One row for each panel and seed, see `PanelFrame.row`: ``panel``, ``seed``, ``region_px``, ``events``,
        ``frame_kind``, and the fields of the condition.
    """
    todo = [(panel, seed) for panel in panels for seed in seeds]
    bar = tqdm(todo, desc="frames", disable=None, leave=False)
    return pd.DataFrame([panel_frame(panel, seed).row() for panel, seed in bar])


def panel_results(seeds: Iterable[int], quick: bool) -> pd.DataFrame:
    """Record all panels with several seeds and keep the table in ``results``, where ``bicode claims`` reads it.

    Figure 13 has no sweep: its frames are measured within seconds, so they are recorded anew each time.

    Parameters
    ----------
    seeds : iterable of int
    quick : bool
        True keeps the table as ``results/quick/13.csv``, False as ``results/13.csv``.

    Returns
    -------
    DataFrame
        See `panel_table`.
    """
    table = panel_table(seeds)
    with whole_file(results_folder(quick) / "13.csv") as unfinished:  # a test may read it at the same time
        table.to_csv(unfinished, index=False, lineterminator="\n")
    return table


def area_ratios(above: str, below: str, distances_m: Iterable[float], seeds: Iterable[int]) -> pd.DataFrame:
    """Return the ratio of the lit areas of two panels over distance.

    Parameters
    ----------
    above, below : str
        Panels whose areas are the numerator and the denominator.
    distances_m : iterable of float
        Distances from camera to marker [m].
    seeds : iterable of int

    Returns
    -------
    DataFrame
        ``distance_m``, ``ratio`` (mean over the seeds), ``low`` and ``high`` (least and largest of them).
    """
    rows = []
    numbers = list(seeds)
    for distance_m in distances_m:
        areas = [[panel_frame(panel, n, distance_m).region_px for n in numbers] for panel in (above, below)]
        ratio = np.array(areas[0]) / np.array(areas[1])
        rows.append({"distance_m": distance_m, "ratio": ratio.mean(), "low": ratio.min(), "high": ratio.max()})
    return pd.DataFrame(rows)


def turned_share(yaw_deg: float, size_m: float = 0.05, glowing_share: float = 1.0) -> float:
    """Return the lit area that a turned plate shows, over that of a plate facing the camera, seen from afar.

    It is ``cos(yaw) + thickness / size * sin(yaw) / glowing_share``: the face gets narrower, and the edge of the plate
    comes into view, which is lit over its whole length.

    Parameters
    ----------
    yaw_deg : float
        Angle between the normal of the plate and the line of sight [deg], 0 .. 90.
    size_m : float
        Side of the plate [m].
    glowing_share : float
        Share of the face that is lit, 0 .. 1.

    Returns
    -------
    float

    Examples
    --------
    >>> round(turned_share(80), 3), turned_share(0), round(turned_share(80, glowing_share=0.75), 3)
    (0.272, 1.0, 0.305)
    """
    yaw = np.deg2rad(yaw_deg)
    return float(np.cos(yaw) + paper.PLATE_THICKNESS_M / size_m * np.sin(yaw) / glowing_share)
