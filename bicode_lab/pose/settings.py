"""Settings of the estimation of poses: the camera, the packets, the plate, and what is known of the light."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bicode_lab.marker.board import Board, aruco_dictionary
from bicode_lab.marker.packet import PacketFormat
from bicode_lab.pose.response import LightPriors


@dataclass(frozen=True, kw_only=True)
class PoseSettings:
    """What has to be known to estimate poses; the defaults are the paper's camera and marker.

    Parameters
    ----------
    board : Board
        The plate: pattern, size, thickness, and which cells glow.
    aruco_ids : tuple of int
        Patterns of the board's dictionary that may stand on the plate, of which the one that fits best is found; empty
        for the pattern of `board`.
    packet_format : PacketFormat
        Format of the packets that the markers send.
    width, height : int
        Sensor size [px].
    focal_px : float
        Focal length [px]; the default is 8 mm divided by 4.86 um.
    cx, cy : float, optional
        Principal point [px]; None takes the middle of the sensor.
    priors : LightPriors
        What is known of light and sensor beforehand.

    Raises
    ------
    ValueError
        If a value is impossible.

    Examples
    --------
    >>> PoseSettings().camera
    array([1646.09,  639.5 ,  359.5 ])
    """

    board: Board = field(default_factory=Board)
    aruco_ids: tuple[int, ...] = ()
    packet_format: PacketFormat = field(default_factory=PacketFormat)
    width: int = 1280
    height: int = 720
    focal_px: float = 1646.09
    cx: float | None = None
    cy: float | None = None
    priors: LightPriors = field(default_factory=LightPriors)

    def __post_init__(self) -> None:
        if not self.focal_px > 0:
            raise ValueError(f"focal_px={self.focal_px} is not a length; choose more than 0")
        for name in ("width", "height"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}={getattr(self, name)} is too small; choose 1 or more")
        count = len(aruco_dictionary(self.board.dictionary).bytesList)
        for number in self.aruco_ids:
            if not 0 <= number < count:
                raise ValueError(f"aruco_ids has {number}, not in {self.board.dictionary}; choose 0 .. {count - 1}")

    @property
    def camera(self) -> npt.NDArray[np.float64]:
        """Focal length and principal point x, y, shape (3,) [px]; pixel centres are at whole numbers."""
        cx = (self.width - 1) / 2 if self.cx is None else self.cx
        cy = (self.height - 1) / 2 if self.cy is None else self.cy
        return np.array([self.focal_px, cx, cy])

    @property
    def candidates(self) -> tuple[int, ...]:
        """Patterns that may stand on the plate."""
        return self.aruco_ids or (self.board.aruco_id,)
