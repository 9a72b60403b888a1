"""Columns of the pose that need no further arithmetic: position, angles and a quaternion that does not flip its sign.

A marker that faces the camera upright has the angles 0. Yaw turns it about its vertical axis (the angle theta of
IV-B), then pitch about its horizontal axis, then roll in its plane, counter-clockwise as the camera sees it (IV-F).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bicode_lab.recognition import Sighting

COLUMNS = ("x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg", "qw", "qx", "qy", "qz")
FACING = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


class PoseColumns:
    """Maker of the columns of a table of sightings, which remembers the latest quaternion of each track."""

    def __init__(self) -> None:
        self._latest: dict[int, np.ndarray[Any, np.dtype[np.float64]]] = {}

    def __call__(self, sighting: Sighting) -> dict[str, float | None]:
        """Return the columns of a sighting.

        Parameters
        ----------
        sighting : Sighting

        Returns
        -------
        dict of str to float or None
            By the names of `COLUMNS`; None where there is no pose.
        """
        if sighting.rvec is None or sighting.tvec is None:
            return dict.fromkeys(COLUMNS)
        turn = Rotation.from_rotvec(np.ravel(sighting.rvec))
        yaw, pitch, roll = (FACING.inv() * turn).as_euler("YXZ", degrees=True)
        quaternion = turn.as_quat()  # x, y, z, w
        before = self._latest.get(sighting.track)
        flips = quaternion @ before < 0 if before is not None else quaternion[np.argmax(np.abs(quaternion))] < 0
        quaternion = -quaternion if flips else quaternion
        self._latest[sighting.track] = quaternion
        x, y, z, w = quaternion.tolist()
        values = (*np.ravel(sighting.tvec).tolist(), float(roll), float(pitch), float(yaw), w, x, y, z)
        return dict(zip(COLUMNS, values, strict=True))
