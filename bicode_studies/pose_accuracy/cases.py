"""The cases in which poses are judged: still plates of 5 cm at 10.7 mA and 350 lx, with any roll."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bicode_lab.camera import PlacedMarker, Pose, Scene, Still
from bicode_lab.marker import Board, Marker
from bicode_lab.pose.patterns import better_half

WARM_UP_PERIODS = 5  # until pixels no longer know how they started
DISTANCE_SPREAD = 0.03  # a distance is drawn within this share of the nominal one
OFFSET_SHARE, MOST_OFFSET_M = 0.1, 0.6  # the plate lies beside the axis by so much of the distance at most


@dataclass(frozen=True, kw_only=True)
class Case:
    """One row of the table.

    Parameters
    ----------
    name : str
    distance_m : float
    tilt_deg : tuple of 2 floats
        Least and largest angle between the plate's normal and the line of sight; the axis of the tilt is any one in the
        image [deg].
    periods : int
        Number of periods of a look.
    """

    name: str
    distance_m: float
    tilt_deg: tuple[float, float]
    periods: int = 1


CASES = (
    Case(name="2.5 m, tilted", distance_m=2.5, tilt_deg=(20, 60)),
    Case(name="2.5 m, facing", distance_m=2.5, tilt_deg=(0, 0)),
    Case(name="5 m, tilted", distance_m=5, tilt_deg=(20, 60)),
    Case(name="5 m, facing", distance_m=5, tilt_deg=(0, 0)),
    Case(name="10 m, tilted, 1 s", distance_m=10, tilt_deg=(20, 60), periods=30),
)


def scene_of(case: Case, seed: int) -> Scene:
    """Return the scene of a case: pattern, payload, clock, place and rotation are drawn.

    Parameters
    ----------
    case : Case
    seed : int

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([seed, 1])
    board = Board(aruco_id=int(rng.choice(better_half(Board()))))
    depth_m = case.distance_m * (1 + rng.uniform(-DISTANCE_SPREAD, DISTANCE_SPREAD))
    reach_m = min(OFFSET_SHARE * depth_m, MOST_OFFSET_M)
    x_m, y_m = rng.uniform(-reach_m, reach_m, 2)
    flat = Pose.facing(depth_m, x_m=x_m, y_m=y_m, roll_deg=rng.uniform(0, 360))
    sight = flat.position_m / np.linalg.norm(flat.position_m)
    look = Rotation.align_vectors([sight], [[0, 0, 1]])[0].as_matrix()  # the optical axis turned to the plate
    axis = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(rng.uniform(*case.tilt_deg)) * np.array([np.cos(axis), np.sin(axis), 0])
    pose = Pose(look @ Rotation.from_rotvec(tilt).as_matrix() @ flat.rotation, flat.position_m)
    marker = Marker(
        payload=int(rng.integers(1, 256)), board=board,
        phase_us=float(rng.uniform(0, 14_000)), clock_error_ppm=float(rng.uniform(-300, 300)),
    )  # fmt: skip
    return Scene(markers=(PlacedMarker(marker=marker, path=Still(pose)),))
