"""Results of the estimation of a pose: poses with their odds and covariances, or a reason why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.pose.lock_in import LockIn

Floats = npt.NDArray[np.float64]
PoseReason = Literal["no_id", "no_edges", "no_light", "no_fit"]
POSE_REASONS: tuple[PoseReason, ...] = ("no_id", "no_edges", "no_light", "no_fit")
"""Why there is no pose: no packet was read, the LED does not switch in this span of time, too few pixels are lit for
the second moments, or no start leads to a plate in front of the camera."""

SURE_LOG_ODDS = 2.5  # natural logarithm: 12 to 1


@dataclass(frozen=True, kw_only=True, eq=False)
class PlatePose:
    """A pose of a plate.

    Parameters
    ----------
    rotation : ndarray, shape (3, 3)
        From marker axes (x right, y up, z out of the face) to camera axes (x right, y down, z forward).
    position_m : ndarray, shape (3,)
        Middle of the face in camera axes [m].
    covariance : ndarray, shape (6, 6)
        Of a small turn (rotation vector) and a small shift of the plate, both in camera axes [rad, m]. The true
        rotation is ``turn @ rotation``.
    probability : float
        Of this pose among those of the estimate, 0 .. 1.
    aruco_id : int
        The pattern.
    """

    rotation: Floats
    position_m: Floats
    covariance: Floats
    probability: float
    aruco_id: int

    def rvec(self) -> Floats:
        """Return the rotation as a rotation vector, axis times angle, as OpenCV uses it, shape (3,) [rad]."""
        return np.asarray(cv2.Rodrigues(self.rotation)[0], np.float64).ravel()

    def corners_px(self, corners_m: Floats, camera: Floats) -> Floats:
        """Return where points of the plate are in the image.

        Parameters
        ----------
        corners_m : ndarray, shape (n, 3)
            In marker axes, for example `Board.pattern_corners_m` [m].
        camera : ndarray, shape (3,)
            Focal length and principal point, see `PoseSettings.camera` [px].

        Returns
        -------
        ndarray, shape (n, 2)
            [px]
        """
        points = corners_m @ self.rotation.T + self.position_m
        return np.asarray(camera[0] * points[:, :2] / points[:, 2:] + camera[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseEstimate:
    """What is known of the pose of a plate in a span of time.

    Parameters
    ----------
    t_us : float
        Middle of the span of time, to which the poses belong [us].
    poses : tuple of PlatePose
        The most probable one first. There is a second one where the light cannot exclude it: the mirrored plate, or one
        turned by a quarter.
    reason : str or None
        Why there is no pose, one of `POSE_REASONS`; None if there is one.
    lock_in : LockIn or None
        The image that the poses come from.
    """

    t_us: float
    poses: tuple[PlatePose, ...] = ()
    reason: PoseReason | None = None
    lock_in: LockIn | None = None

    @property
    def pose(self) -> PlatePose | None:
        """The most probable pose."""
        return self.poses[0] if self.poses else None

    @property
    def is_sure(self) -> bool:
        """True where there is one pose, or the first is `SURE_LOG_ODDS` more probable than all others together."""
        rest = sum(pose.probability for pose in self.poses[1:])
        return bool(self.poses) and self.poses[0].probability >= np.exp(SURE_LOG_ODDS) * rest
