"""Poses, and trajectories: poses over time.

The axes of the camera and of the world are x to the right, y down, z forward [m]; the world has its origin where the
camera starts. The axes of a marker are those of `marker.board`: z points out of its face.
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
    """A rotation and a position: ``point_outside = rotation @ point_inside + position_m``.

    Parameters
    ----------
    rotation : ndarray, shape (3, 3)
    position_m : ndarray, shape (3,)
        [m]
    """

    rotation: Floats = field(default_factory=lambda: np.eye(3))
    position_m: Floats = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def facing(
        cls, distance_m: float, *, x_m: float = 0.0, y_m: float = 0.0, yaw_deg: float = 0.0, roll_deg: float = 0.0
    ) -> Pose:
        """Return the pose of a marker in front of the camera.

        Parameters
        ----------
        distance_m : float
            Distance along the optical axis, above 0 [m].
        x_m, y_m : float
            Offset to the right and down [m].
        yaw_deg : float
            Turn about the marker's vertical axis, out of its plane: the angle theta of IV-B [deg].
        roll_deg : float
            Turn in the marker's plane, counter-clockwise as the camera sees it: the rotation of IV-F [deg].

        Returns
        -------
        Pose

        Raises
        ------
        ValueError
            If `distance_m` is not above 0.

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
        """Return the pose of the outer axes, given in the inner axes."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position_m)

    def after(self, outer: Pose) -> Pose:
        """Return this pose in the axes in which `outer` is given, where this pose is given in the axes of `outer`.

        Parameters
        ----------
        outer : Pose

        Returns
        -------
        Pose
        """
        return Pose(outer.rotation @ self.rotation, outer.rotation @ self.position_m + outer.position_m)

    def apply(self, points_m: Floats) -> Floats:
        """Transform points from the inner axes to the outer axes.

        Parameters
        ----------
        points_m : ndarray, shape (n, 3)
            [m]

        Returns
        -------
        ndarray, shape (n, 3)
            [m]
        """
        return np.asarray(points_m @ self.rotation.T + self.position_m)

    def rvec(self) -> Floats:
        """Return the rotation as a rotation vector, axis times angle, as OpenCV uses it, shape (3,) [rad]."""
        return np.asarray(Rotation.from_matrix(self.rotation).as_rotvec(), np.float64)


def turn_about(axis: str, angle_deg: float) -> Floats:
    """Return the rotation about an axis by the right-hand rule.

    Parameters
    ----------
    axis : {"x", "y", "z"}
    angle_deg : float
        [deg]

    Returns
    -------
    ndarray, shape (3, 3)
    """
    vector = np.zeros(3)
    vector["xyz".index(axis)] = np.deg2rad(angle_deg)
    return np.asarray(cv2.Rodrigues(vector)[0], np.float64)


class Trajectory(Protocol):
    """Anything that has a pose at each time."""

    def pose_at(self, t_s: float) -> Pose:
        """Return the pose at a time after the start of the recording [s]."""

    @property
    def is_still(self) -> bool:
        """True where the pose never changes."""


@dataclass(frozen=True)
class Still:
    """A trajectory that stays at one pose.

    Parameters
    ----------
    pose : Pose
    """

    pose: Pose = field(default_factory=Pose)

    def pose_at(self, t_s: float) -> Pose:
        """Return the pose, which is the same at all times."""
        return self.pose

    @property
    def is_still(self) -> bool:
        """Always True."""
        return True


@dataclass(frozen=True, kw_only=True)
class Moving:
    """A trajectory of constant velocity that turns at a constant rate about one of its own axes.

    Parameters
    ----------
    start : Pose
        The pose at `t_s` = 0.
    velocity_m_per_s : tuple of 3 floats
        In the axes of the world [m/s].
    axis : {"x", "y", "z"}
        Own axis to turn about: "z" spins a marker in its plane (IV-F), "y" pans a camera (IV-E).
    rate_deg_per_s : float
        Turning rate by the right-hand rule [deg/s].

    Raises
    ------
    ValueError
        If there is no such axis.
    """

    start: Pose = field(default_factory=Pose)
    velocity_m_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: str = "z"
    rate_deg_per_s: float = 0.0

    def __post_init__(self) -> None:
        if self.axis not in ("x", "y", "z"):
            raise ValueError(f"axis={self.axis!r} is not known; choose 'x', 'y' or 'z'")

    def pose_at(self, t_s: float) -> Pose:
        """Return the pose at a time.

        Parameters
        ----------
        t_s : float
            Time since the start of the recording [s].

        Returns
        -------
        Pose
        """
        rotation = self.start.rotation @ turn_about(self.axis, self.rate_deg_per_s * t_s)
        return Pose(rotation, self.start.position_m + np.array(self.velocity_m_per_s) * t_s)

    @property
    def is_still(self) -> bool:
        """True where both rates are zero."""
        return self.rate_deg_per_s == 0 and not any(self.velocity_m_per_s)


def spin(start: Pose, rpm: float) -> Moving:
    """Return the trajectory of a marker that spins in its own plane (IV-F).

    Parameters
    ----------
    start : Pose
        Pose of the marker at the start.
    rpm : float
        Speed [revolutions per minute].

    Returns
    -------
    Moving
    """
    return Moving(start=start, axis="z", rate_deg_per_s=6 * rpm)


def pan(tangential_m_per_s: float, distance_m: float, start_deg: float = 0.0) -> Moving:
    """Return the trajectory of a camera that pans at the rate ``tangential_m_per_s / distance_m`` (IV-E).

    Parameters
    ----------
    tangential_m_per_s : float
        Speed at which a marker at `distance_m` passes [m/s].
    distance_m : float
        Above 0 [m].
    start_deg : float
        Direction in which the camera looks at the start, to the right of the world's z axis [deg].

    Returns
    -------
    Moving

    Raises
    ------
    ValueError
        If `distance_m` is not above 0.
    """
    if not distance_m > 0:
        raise ValueError(f"distance_m={distance_m} is not in front of the camera; choose more than 0 m")
    rate = np.rad2deg(tangential_m_per_s / distance_m)
    return Moving(start=Pose(turn_about("y", start_deg)), axis="y", rate_deg_per_s=float(rate))
