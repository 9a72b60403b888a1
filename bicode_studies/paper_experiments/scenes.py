"""IV: what stood where.   condition, seed -> scene

A condition is what the paper varies; a seed is everything it does not tell: payload, phase of the packet, place
between the pixels, which part of the pan, where the turn begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bicode_lab import paper
from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Scene, Still, Wall, pan, spin, textured_wall
from bicode_lab.camera.motion import Path
from bicode_lab.camera.optics import OFFICE_INFRARED_SHARE
from bicode_lab.constants import constant
from bicode_lab.marker import Board, Marker
from bicode_lab.recognition import ReceiverSettings

WALL_M = 5.0  # where the wall is, at least
WALL_BEHIND = 1.25  # times as far as the marker, at least
WALL_PICTURE, WALL_CONTRAST = "camera", 0.039  # as dense as a real recording, 0.11 Mev/s at 0.314 m/s and 2.5 m
STRATA = 10  # seeds share a pan evenly


@dataclass(frozen=True, kw_only=True)
class Condition:
    """What one cell of an experiment is set to; the defaults are those of IV-A.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    distance_m, size_m, current_ma : float
    band : {"red", "infrared"}
        The LED; with the infrared one the IR88 filter is on and the lens at F2.0 (III-B).
    illuminance_lux : float
    yaw_deg : float
        Angle between the marker's normal and the optical axis (IV-B).
    speed_m_per_s : float
        Tangential speed of the pan at the marker's distance (IV-E); 0 stands still.
    rpm : float
        Of the marker in its plane (IV-F).
    duration_s : float
        Of the recording.
    """

    figure: str
    distance_m: float
    size_m: float = 0.05
    current_ma: float = 10.7
    band: str = "red"
    illuminance_lux: float = paper.OFFICE_LUX
    yaw_deg: float = 0.0
    speed_m_per_s: float = 0.0
    rpm: float = 0.0
    duration_s: float = 0.66

    @property
    def moves(self) -> bool:
        """Whether camera or marker move."""
        return bool(self.speed_m_per_s or self.rpm)


def optics_of(condition: Condition) -> Optics:
    """A condition in, lens and filter out."""
    if condition.band == "infrared":
        return Optics(f_number=paper.F_NUMBER_INFRARED, infrared_filter=True)
    return Optics(f_number=paper.F_NUMBER_VISIBLE)


def light_of(condition: Condition) -> Light:
    """A condition in, the light out: lamps up to the office's illuminance, daylight above.

    Daylight has more beyond the visible than lamps, and a sensor without a filter sees all of it.
    """
    place = "office" if condition.illuminance_lux <= paper.OFFICE_LUX else "evening"
    if condition.band == "infrared":
        share = constant(f"infrared_share_{place}")
    else:
        share = OFFICE_INFRARED_SHARE if place == "office" else constant("infrared_share_bare_sensor")
    return Light(illuminance_lux=condition.illuminance_lux, infrared_share=share)


def scene_of(condition: Condition, seed: int) -> Scene:
    """A condition and a seed in, the scene out; its recording begins `begins_at_s` after the pan did."""
    rng = np.random.default_rng([seed, 1])
    optics = optics_of(condition)
    x, y = rng.uniform(-0.5, 0.5, 2) * condition.distance_m / optics.focal_px
    marker = Marker(
        payload=int(rng.integers(1, 256)),
        board=Board(size_m=condition.size_m, aruco_id=round(constant("aruco_id"))),
        current_ma=condition.current_ma,
        band="infrared" if condition.band == "infrared" else "visible",
        phase_us=float(rng.uniform(0, paper.PACKET_US)),
    )
    turned = float(rng.uniform(0, 360)) if condition.rpm else 0.0
    pose = Pose.facing(condition.distance_m, x_m=float(x), y_m=float(y), yaw_deg=condition.yaw_deg, roll_deg=turned)
    path = spin(pose, condition.rpm) if condition.rpm else Still(pose)
    return Scene(
        markers=(PlacedMarker(marker=marker, path=path),),
        camera=_camera(condition, seed),
        optics=optics,
        light=light_of(condition),
        wall=_wall(condition) if condition.speed_m_per_s else None,
    )


def half_pan_deg(condition: Condition) -> float:
    """A condition in; how far from the optical axis the marker is when it is wholly in view for the last time out."""
    optics = optics_of(condition)
    edge = optics.width / 2 / optics.focal_px - condition.size_m / condition.distance_m
    return float(np.rad2deg(np.arctan(edge)))


def whole_s(condition: Condition) -> float:
    """A condition that moves in; how long the pan from entering to leaving, or half a turn, takes, out."""
    if condition.rpm:
        return 30 / condition.rpm
    return float(np.deg2rad(2 * half_pan_deg(condition)) * condition.distance_m / condition.speed_m_per_s)


def begins_at_s(condition: Condition, seed: int) -> float:
    """A condition and a seed in; how long after the marker has come into view, or begun to turn, the recording begins.

    The seeds of a pan share it evenly, each at a random place of its part; a turn is recorded from its start.
    """
    if not condition.speed_m_per_s:
        return 0.0
    rest_s = max(whole_s(condition) - condition.duration_s, 0.0)
    at = (seed % STRATA + np.random.default_rng([seed, 4]).random()) / STRATA
    return float(at * rest_s)


def _camera(condition: Condition, seed: int) -> Path:
    """The camera's path; it pans from one side to the other while the marker passes."""
    if not condition.speed_m_per_s:
        return Still()
    rate_deg_per_s = np.rad2deg(condition.speed_m_per_s / condition.distance_m)
    start_deg = -half_pan_deg(condition) + rate_deg_per_s * begins_at_s(condition, seed)
    return pan(condition.speed_m_per_s, condition.distance_m, start_deg=float(start_deg))


def _wall(condition: Condition) -> Wall:
    """A texture behind the marker whose points are as wide as a pixel wherever it stands."""
    distance_m = max(WALL_M, WALL_BEHIND * condition.distance_m)
    texel_m = distance_m / optics_of(condition).focal_px
    return textured_wall(WALL_PICTURE, contrast=WALL_CONTRAST, distance_m=distance_m, texel_m=texel_m)


WINDOW = Optics(width=96, height=72)  # a small sensor with the paper's lens, for trials of the ID alone
WINDOW_RECEIVER = ReceiverSettings(width=WINDOW.width, height=WINDOW.height, detect_2d=False)


def window_scene(distance_m: float, seed: int, clock_error_ppm: float = 0.0) -> Scene:
    """Place the paper's marker before a small sensor, `WINDOW`, where an ID is simulated and read quickly.

    Parameters
    ----------
    distance_m : float
        Distance from camera to marker [m]; the marker faces the camera.
    seed : int
        Seed of the payload (1 .. 255), of the phase of the packet, of the place within a pixel and of the sign of the
        clock error.
    clock_error_ppm : float
        Size of the error of the transmitter's clock [ppm].

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([seed, 1])
    x, y = rng.uniform(-0.5, 0.5, 2) * distance_m / WINDOW.focal_px
    marker = Marker(
        payload=int(rng.integers(1, 256)),
        phase_us=float(rng.uniform(0, paper.PACKET_US)),
        clock_error_ppm=float(clock_error_ppm * rng.choice([-1, 1])),
    )
    path = Still(Pose.facing(distance_m, x_m=float(x), y_m=float(y)))
    return Scene(markers=(PlacedMarker(marker=marker, path=path),), optics=WINDOW)
