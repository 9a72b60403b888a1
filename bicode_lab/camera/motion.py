"""Where things are: poses, and paths of poses over time.   time -> pose

Axes of the camera and of the world: x to the right, y down, z forward [m]; the world
is where the camera starts. A marker's axes are those of `marker.board`: z out of its face.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Floats = npt.NDArray[np.float64]

FACING = np.diag([1.0, -1.0, -1.0])
"""Rotation of a marker that looks straight into the camera, upright."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A rotation and a place: ``point_outside = rotation @ point_inside + position_m``.

    Parameters
    ----------
    rotation : ndarray, shape (3, 3)
    position_m : ndarray, shape (3,)
    """

    rotation: Floats = field(default_factory=lambda: np.eye(3))
    position_m: Floats = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def facing(
        cls, distance_m: float, *, x_m: float = 0.0, y_m: float = 0.0, yaw_deg: float = 0.0, roll_deg: float = 0.0
    ) -> Pose:
        """A marker's pose in front of the camera.

        Parameters
        ----------
        distance_m : float
            Along the optical axis.
        x_m, y_m : float
            To the right, and down.
        yaw_deg : float
            Out of plane, about the marker's vertical axis: the angle theta of IV-B.
        roll_deg : float
            In plane, counter-clockwise as the camera sees it: the rotation of IV-F.

        Examples
        --------
        >>> Pose.facing(2.5).position_m
        array([0. , 0. , 2.5])
        """
        if not distance_m > 0:
            raise ValueError(f"distance_m={distance_m} is not in front of the camera; choose more than 0 m")
        turn = turn_about("y", yaw_deg) @ turn_about("z", roll_deg)
        return cls(FACING @ turn, np.array([x_m, y_m, distance_m]))

    def inverse(self) -> Pose:
        """The pose of the outside seen from the inside."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position_m)

    def after(self, outer: Pose) -> Pose:
        """The same pose in the axes that `outer` is given in, where it was given in those of `outer`."""
        return Pose(outer.rotation @ self.rotation, outer.rotation @ self.position_m + outer.position_m)

    def apply(self, points_m: Floats) -> Floats:
        """Points inside, shape (n, 3), in; the same points outside, shape (n, 3) [m], out."""
        return np.asarray(points_m @ self.rotation.T + self.position_m)

    def rvec(self) -> Floats:
        """The rotation as axis times angle, as OpenCV has it [rad], shape (3,)."""
        return np.asarray(Rotation.from_matrix(self.rotation).as_rotvec(), np.float64)


def turn_about(axis: str, angle_deg: float) -> Floats:
    """An axis, x, y or z, and an angle in; the rotation about it by the right-hand rule out, shape (3, 3)."""
    vector = np.zeros(3)
    vector["xyz".index(axis)] = np.deg2rad(angle_deg)
    return np.asarray(cv2.Rodrigues(vector)[0], np.float64)


class Trajectory(Protocol):
    """Anything that says where something is at a time."""

    def pose_at(self, t_s: float) -> Pose:
        """The pose at time `t_s` after the start of the recording."""

    @property
    def is_still(self) -> bool:
        """True where the pose never changes."""


@dataclass(frozen=True)
class Still:
    """A path that stays where it is."""

    pose: Pose = field(default_factory=Pose)

    def pose_at(self, t_s: float) -> Pose:
        """The one pose."""
        return self.pose

    @property
    def is_still(self) -> bool:
        """Always True."""
        return True


@dataclass(frozen=True, kw_only=True)
class Moving:
    """A path of constant velocity and constant turning rate about one of its own axes.

    Parameters
    ----------
    start : Pose
        The pose at `t_s` = 0.
    velocity_m_per_s : tuple of 3 floats
        In the axes of the world.
    axis : {"x", "y", "z"}
        Its own axis to turn about: "z" spins a marker in its plane (IV-F), "y" pans a camera (IV-E).
    rate_deg_per_s : float
        Turning rate, right-hand rule.
    """

    start: Pose = field(default_factory=Pose)
    velocity_m_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: str = "z"
    rate_deg_per_s: float = 0.0

    def __post_init__(self) -> None:
        if self.axis not in ("x", "y", "z"):
            raise ValueError(f"axis={self.axis!r} is not known; choose 'x', 'y' or 'z'")

    def pose_at(self, t_s: float) -> Pose:
        """The pose at time `t_s`."""
        rotation = self.start.rotation @ turn_about(self.axis, self.rate_deg_per_s * t_s)
        return Pose(rotation, self.start.position_m + np.array(self.velocity_m_per_s) * t_s)

    @property
    def is_still(self) -> bool:
        """True where both rates are zero."""
        return self.rate_deg_per_s == 0 and not any(self.velocity_m_per_s)


def spin(start: Pose, rpm: float) -> Moving:
    """A marker's pose and a speed in; a path that spins it in its own plane out (IV-F)."""
    return Moving(start=start, axis="z", rate_deg_per_s=6 * rpm)


def pan(tangential_m_per_s: float, distance_m: float, start_deg: float = 0.0) -> Moving:
    """A tangential speed at a distance in; the camera's path that pans at speed / distance out (IV-E).

    Parameters
    ----------
    tangential_m_per_s : float
        Speed at which a marker at `distance_m` passes.
    distance_m : float
    start_deg : float
        Where the camera looks at first, to the right of the world's z axis.
    """
    if not distance_m > 0:
        raise ValueError(f"distance_m={distance_m} is not in front of the camera; choose more than 0 m")
    rate = np.rad2deg(tangential_m_per_s / distance_m)
    return Moving(start=Pose(turn_about("y", start_deg)), axis="y", rate_deg_per_s=float(rate))
