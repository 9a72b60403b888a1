"""Fig. 13: what the receiver's frames look like.   panel, seed -> frame, marker's region, condition

    a .. g   frames of delta_t_2D at 2.5 m: current (a, b, c), angle (b, d, e), size (f, b, g)
    h, i     frames of delta_t_blinker while the camera pans, before a wall
    j, k     frames of delta_t_blinker while the marker spins, near and far

A pixel of a frame has the sign of its last event, as the authors' software draws it; that it is not 0 is what the
"any" rule says, too. The short frames lie within a payload, where the LED blinks (the paper does not say where). A
packet's time goes by before a frame begins, since the camera starts with pixels at rest.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab import paper
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.camera.truth import packet_starts_us
from bicode_lab.events import join, slice_time
from bicode_lab.recognition.accumulate import Frame, accumulate
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import scene_of

LOW_MA, STANDARD_MA, HIGH_MA = paper.FIG_8_CURRENTS_MA
SLOW_M_PER_S, _, FAST_M_PER_S = paper.FIG_12_SPEEDS_M_PER_S
NEAR_M, FAR_M = 0.5, 2.5
AROUND = 0.25  # of the marker's larger side belong to its neighbourhood on each side, ...
AROUND_PX = 12  # ... and no less than this: blur and halo glow beyond the plate


def _condition(distance_m: float = FAR_M, **setting: Any) -> Condition:
    """A panel's condition: one period of it, so that a pan's seeds share the whole pan."""
    return Condition(figure="13", distance_m=distance_m, duration_s=paper.DELTA_T_WHOLE_US * 1e-6, **setting)


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
    """One panel of one seed.

    Parameters
    ----------
    panel : str
        "a" .. "k".
    seed : int
    condition : Condition
    kind : {"2d", "blinker"}
        Of delta_t_2D or of delta_t_blinker.
    frame : ndarray of int8, shape (height, width)
        -1, 0, +1.
    box_px : tuple of 4 floats
        Left, top, width, height of the plate's image in the middle of the frame's time, from the truth.
    neighbourhood_px : tuple of 4 ints
        The same, widened: x, y, w, h, inside the sensor.
    region_px : int
        Pixels in the neighbourhood that are not 0.
    events : int
        Of the whole sensor in the frame's time.
    """

    panel: str
    seed: int
    condition: Condition
    kind: str
    frame: Frame = field(repr=False)
    box_px: tuple[float, float, float, float]
    neighbourhood_px: tuple[int, int, int, int]
    region_px: int
    events: int

    @property
    def aruco_id(self) -> int:
        """Which pattern its plate has."""
        return scene_of(self.condition, self.seed).markers[0].marker.board.aruco_id

    def row(self) -> dict[str, Any]:
        """Its row in the table of Fig. 13, without the frame."""
        told = {"panel": self.panel, "seed": self.seed, "region_px": self.region_px, "events": self.events}
        return {**told, "frame_kind": self.kind, **asdict(self.condition)}


def panel_frame(panel: str, seed: int, distance_m: float | None = None) -> PanelFrame:
    """A panel of Fig. 13 and a seed in; its frame, where the marker is in it and how much of it glows, out.

    `distance_m` is for a look at the same from elsewhere; None keeps the panel's own.

    Raises
    ------
    ValueError
        No such panel.
    """
    if panel not in PANELS:
        raise ValueError(f"panel {panel!r} is not in Fig. 13; choose one of {', '.join(PANELS)}")
    condition, kind = PANELS[panel], "blinker" if panel in BLINKER_PANELS else "2d"
    if distance_m is not None:
        condition = replace(condition, distance_m=distance_m)
    scene, settings = scene_of(condition, seed), receiver_settings(condition)
    length_us = settings.delta_t_blinker_us if kind == "blinker" else settings.delta_t_2d_us
    start_us = _blinks_from_us(scene, length_us) if kind == "blinker" else paper.PACKET_US
    recorder = Recorder(scene, (start_us + length_us) * 1e-6, np.random.default_rng([seed, 2]))
    events = slice_time(join(recorder), start_us, start_us + length_us)
    frame = accumulate(events, settings.width, settings.height, "last")
    box = truth_at(scene, start_us + length_us / 2)[0].box_px
    x, y, w, h = near = neighbourhood(box, settings.width, settings.height)
    region_px = int(np.count_nonzero(frame[y : y + h, x : x + w]))
    return PanelFrame(
        panel=panel, seed=seed, condition=condition, kind=kind, frame=frame, box_px=box, neighbourhood_px=near,
        region_px=region_px, events=events.size,
    )  # fmt: skip


def _blinks_from_us(scene: Scene, length_us: int) -> int:
    """A scene and a frame's time in; the start of a frame amid a payload, a packet's time after the scene's start, out.

    The truth of the transmitter is used, as by the authors when they chose a frame to print.
    """
    begins_us = packet_starts_us(scene, 0, 2 * paper.PACKET_US)
    middle_us = begins_us + paper.START_US + paper.PAYLOAD_BITS * 1e6 / paper.F_ID_HZ / 2
    from_us = middle_us - length_us / 2
    return round(float(from_us[from_us >= paper.PACKET_US][0]))


def neighbourhood(box_px: tuple[float, float, float, float], width: int, height: int) -> tuple[int, int, int, int]:
    """The box of a plate's image and the sensor's size in; the pixels that its light may reach, x y w h, out.

    Examples
    --------
    >>> neighbourhood((100, 100, 40, 80), 1280, 720)
    (80, 80, 81, 121)
    >>> neighbourhood((2, 700, 20, 10), 1280, 720)
    (0, 688, 35, 32)
    """
    x, y, w, h = box_px
    around = max(AROUND * max(w, h), AROUND_PX)
    x0, y0 = max(int(np.floor(x - around)), 0), max(int(np.floor(y - around)), 0)
    x1, y1 = min(int(np.ceil(x + w + around)) + 1, width), min(int(np.ceil(y + h + around)) + 1, height)
    return x0, y0, x1 - x0, y1 - y0


def panel_table(seeds: Iterable[int], panels: Iterable[str] = PANELS) -> pd.DataFrame:
    """Seeds and panels in; a row for each of them out, see `PanelFrame.row`."""
    todo = [(panel, seed) for panel in panels for seed in seeds]
    bar = tqdm(todo, desc="frames", disable=None, leave=False)
    return pd.DataFrame([panel_frame(panel, seed).row() for panel, seed in bar])


def area_over_distance(above: str, below: str, distances_m: Iterable[float], seeds: Iterable[int]) -> pd.DataFrame:
    """Two panels, distances and seeds in; the ratio of their regions at each distance, mean and spread, out.

    Returns
    -------
    DataFrame
        ``distance_m``, ``ratio`` (mean over the seeds), ``low`` and ``high`` (least and most of them).
    """
    rows = []
    numbers = list(seeds)
    for distance_m in distances_m:
        areas = [[panel_frame(panel, n, distance_m).region_px for n in numbers] for panel in (above, below)]
        ratio = np.array(areas[0]) / np.array(areas[1])
        rows.append({"distance_m": distance_m, "ratio": ratio.mean(), "low": ratio.min(), "high": ratio.max()})
    return pd.DataFrame(rows)


def turned_share(
    yaw_deg: float, size_m: float = 0.05, thickness_m: float = paper.PLATE_THICKNESS_M, glowing_share: float = 1.0
) -> float:
    """An angle and a plate in; the area it shows, face and edge, over that of its face straight on, from afar, out.

    Of the face only `glowing_share` may count, the share of its cells that glow; the edge glows as a whole.

    Examples
    --------
    >>> round(turned_share(80), 3), turned_share(0), round(turned_share(80, glowing_share=0.75), 3)
    (0.272, 1.0, 0.305)
    """
    yaw = np.deg2rad(yaw_deg)
    return float(np.cos(yaw) + thickness_m / size_m * np.sin(yaw) / glowing_share)
