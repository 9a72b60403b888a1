"""The scenes of the experiments of section IV: what a condition and a seed put before the camera.

A condition holds what the paper states and varies. A seed draws what it does not state: payload, phase of the packet,
place between the pixels, the part of the pan that is recorded, and the angle at which a turn begins.
"""

from __future__ import annotations

import numpy as np

from bicode_lab import paper
from bicode_lab.camera import Light, Optics, PlacedMarker, Pose, Scene, Still, Wall, pan, spin, textured_wall
from bicode_lab.camera.motion import Trajectory
from bicode_lab.camera.optics import OFFICE_INFRARED_SHARE
from bicode_lab.constants import constant
from bicode_lab.marker import Board, Marker
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.paper_experiments.conditions import Condition

WALL_M = 5.0  # least distance of the wall behind the marker [m] ...
WALL_BEHIND = 1.25  # ... and its least distance in distances of the marker
WALL_PICTURE, WALL_CONTRAST = (
    "camera",
    0.039,
)  # makes as many events as a real recording, 0.11 Mev/s at 0.314 m/s, 2.5 m
STRATA = 10  # parts of equal length that a pan is divided into; seed n records from part n modulo 10


def optics_of(condition: Condition) -> Optics:
    """Return the lens and the filter of a condition (III-B).

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    Optics
    """
    if condition.band == "infrared":
        return Optics(f_number=paper.F_NUMBER_INFRARED, infrared_filter=True)
    return Optics(f_number=paper.F_NUMBER_VISIBLE)


def light_of(condition: Condition) -> Light:
    """Return the ambient light of a condition: lamps up to the illuminance of the office, daylight above it.

    Daylight has a larger share of infrared than lamps, and a sensor without a filter responds to all of it.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    Light
    """
    place = "office" if condition.illuminance_lux <= paper.OFFICE_LUX else "evening"
    if condition.band == "infrared":
        share = constant(f"infrared_share_{place}")
    else:
        share = OFFICE_INFRARED_SHARE if place == "office" else constant("infrared_share_bare_sensor")
    return Light(illuminance_lux=condition.illuminance_lux, infrared_share=share)


def scene_of(condition: Condition, seed: int) -> Scene:
    """Make the scene of a trial.

    Parameters
    ----------
    condition : Condition
    seed : int
        Seed of the payload (1 .. 255), of the phase of the packet, of the place within a pixel, of the part of the
        pan, and of the angle at which a turn begins.

    Returns
    -------
    Scene
        Its time 0 is `recording_start_s` after the pan has begun.
    """
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
    turned_deg = float(rng.uniform(0, 360)) if condition.rpm else 0.0
    pose = Pose.facing(condition.distance_m, x_m=float(x), y_m=float(y), yaw_deg=condition.yaw_deg, roll_deg=turned_deg)
    path = spin(pose, condition.rpm) if condition.rpm else Still(pose)
    return Scene(
        markers=(PlacedMarker(marker=marker, path=path),),
        camera=_camera_path(condition, seed),
        optics=optics,
        light=light_of(condition),
        wall=_wall(condition) if condition.speed_m_per_s else None,
    )


def half_pan_deg(condition: Condition) -> float:
    """Return the largest angle from the optical axis at which the marker is still wholly in view.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    float
        Angle [deg]; a pan goes from minus this to plus this.
    """
    optics = optics_of(condition)
    edge = optics.width / 2 / optics.focal_px - condition.size_m / condition.distance_m
    return float(np.rad2deg(np.arctan(edge)))


def motion_duration_s(condition: Condition) -> float:
    """Return how long the whole motion takes: the pan from the marker's entering to its leaving, or half a turn.

    Parameters
    ----------
    condition : Condition
        One that moves.

    Returns
    -------
    float
        Duration [s].
    """
    if condition.rpm:
        return 30 / condition.rpm
    return float(np.deg2rad(2 * half_pan_deg(condition)) * condition.distance_m / condition.speed_m_per_s)


def recording_start_s(condition: Condition, seed: int) -> float:
    """Return how long after the start of the motion the recording begins.

    Each seed of a pan records from a random place in one of `STRATA` parts of equal length, so that the seeds cover
    the whole pan evenly. A turn is recorded from its start.

    Parameters
    ----------
    condition : Condition
    seed : int

    Returns
    -------
    float
        Time from the marker's entering to the start of the recording [s]; 0 without a pan.
    """
    if not condition.speed_m_per_s:
        return 0.0
    rest_s = max(motion_duration_s(condition) - condition.duration_s, 0.0)
    at = (seed % STRATA + np.random.default_rng([seed, 4]).random()) / STRATA
    return float(at * rest_s)


def _camera_path(condition: Condition, seed: int) -> Trajectory:
    """Return the path of the camera, which pans from one side to the other while it passes the marker."""
    if not condition.speed_m_per_s:
        return Still()
    rate_deg_per_s = np.rad2deg(condition.speed_m_per_s / condition.distance_m)
    start_deg = -half_pan_deg(condition) + rate_deg_per_s * recording_start_s(condition, seed)
    return pan(condition.speed_m_per_s, condition.distance_m, start_deg=float(start_deg))


def _wall(condition: Condition) -> Wall:
    """Return the textured wall behind the marker; a point of its texture is one pixel wide at any distance."""
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
