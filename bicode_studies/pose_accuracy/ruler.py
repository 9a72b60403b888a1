"""The ruler of poses: how far a pose is from the truth, always by the same four numbers.

A pose is *right* if its rotation is off by 5 degrees at most and its corners by 1 px at most (root mean square over the
four). This is stricter than `score.score`, which judges axes as the paper's authors did by eye.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from bicode_lab.camera import MarkerTruth
from bicode_lab.pose import PlatePose

STRICT_DEG = 5.0
STRICT_PX = 1.0


@dataclass(frozen=True, kw_only=True)
class PoseErrors:
    """Errors of a pose.

    Attributes
    ----------
    rotation_deg : float
        Angle between the rotation and the true one [deg].
    roll_deg : float
        Its part about the plate's normal, with its sign [deg].
    depth_percent : float
        Depth over the true depth, minus one [%].
    lateral_mm : float
        Distance from the true position, across the optical axis [mm].
    corner_px : float
        Root mean square over the four corners of the pattern [px].
    distance : float
        Squared Mahalanobis distance of the truth: the error of all six numbers by their covariance.
    """

    rotation_deg: float
    roll_deg: float
    depth_percent: float
    lateral_mm: float
    corner_px: float
    distance: float

    @property
    def is_right(self) -> bool:
        """True where rotation and corners are within `STRICT_DEG` and `STRICT_PX`."""
        return self.rotation_deg <= STRICT_DEG and self.corner_px <= STRICT_PX


def pose_errors(
    pose: PlatePose, truth: MarkerTruth, corners_m: npt.NDArray[np.float64], camera: npt.NDArray[np.float64]
) -> PoseErrors:
    """Compare a pose with the truth.

    Parameters
    ----------
    pose : PlatePose
    truth : MarkerTruth
        At the moment that the pose belongs to.
    corners_m : ndarray, shape (4, 3)
        Corners of the pattern in marker axes [m].
    camera : ndarray, shape (3,)
        Focal length and principal point, see `PoseSettings.camera` [px].

    Returns
    -------
    PoseErrors
    """
    turn = Rotation.from_matrix(truth.pose.rotation @ pose.rotation.T).as_rotvec()
    shift = truth.pose.position_m - pose.position_m
    off = np.concatenate([turn, shift])
    apart = pose.corners_px(corners_m, camera) - truth.corners_px
    return PoseErrors(
        rotation_deg=float(np.degrees(np.linalg.norm(turn))),
        roll_deg=float(np.degrees(turn @ pose.rotation[:, 2])),
        depth_percent=float(-100 * shift[2] / truth.pose.position_m[2]),
        lateral_mm=float(1e3 * np.hypot(shift[0], shift[1])),
        corner_px=float(np.sqrt((apart**2).sum(1).mean())),
        distance=float(off @ np.linalg.solve(pose.covariance, off)),
    )
