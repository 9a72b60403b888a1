"""Fig. 4: the acrylic plate.   ArUco id, size -> which cells glow, corners in space

The plate is engraved where it is to glow and clear, hence dark, elsewhere. Two plates
can be built: "black" engraves the pattern's black cells (frame included), so that the
pattern is seen inverted and fills the plate; "white" engraves the white cells and a
margin of one cell around the black frame, which takes two of eight cells of the side.

Axes of the marker: origin in the middle of the face, x to the right, y up, z out of
the face towards the viewer [m].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

Glow = Literal["black", "white"]


@dataclass(frozen=True, kw_only=True)
class Board:
    """One plate; the defaults are the paper's 5 cm prototype as read from Fig. 4 and 13.

    Parameters
    ----------
    aruco_id : int
        Which pattern of the dictionary; nothing ties it to the blinked ID.
    dictionary : str
        Name of one of OpenCV's predefined ArUco dictionaries.
    size_m : float
        Side of the plate [m].
    glow : {"black", "white"}
        Which cells are engraved.
    thickness_m : float
        Thickness of the plate [m]; its edges glow, too.
    """

    aruco_id: int = 7
    dictionary: str = "DICT_4X4_50"
    size_m: float = 0.05
    glow: Glow = "black"
    thickness_m: float = 0.005

    def __post_init__(self) -> None:
        for name in ("size_m", "thickness_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not a plate's; choose more than 0 m")
        if self.glow not in ("black", "white"):
            raise ValueError(f"glow={self.glow!r} is not known; choose 'black' or 'white'")
        count = len(aruco_dictionary(self.dictionary).bytesList)
        if not 0 <= self.aruco_id < count:
            raise ValueError(f"aruco_id={self.aruco_id} is not in {self.dictionary}; choose 0 .. {count - 1}")

    def cells(self) -> npt.NDArray[np.uint8]:
        """Which cells glow, from the top left, shape (n, n), 1 glows, 0 dark; n counts frame and margin.

        Examples
        --------
        >>> print(Board(aruco_id=0).cells())
        [[1 1 1 1 1 1]
         [1 0 1 0 0 1]
         [1 1 0 1 0 1]
         [1 1 1 0 0 1]
         [1 1 1 0 1 1]
         [1 1 1 1 1 1]]
        """
        dictionary = aruco_dictionary(self.dictionary)
        side = dictionary.markerSize + 2
        white = (dictionary.generateImageMarker(self.aruco_id, side) > 0).astype(np.uint8)
        return 1 - white if self.glow == "black" else np.pad(white, 1, constant_values=1)

    @property
    def pattern_size_m(self) -> float:
        """Side of the ArUco pattern from frame to frame [m]: what pose recognition needs."""
        cells = aruco_dictionary(self.dictionary).markerSize + 2
        return self.size_m * (1.0 if self.glow == "black" else cells / (cells + 2))

    def pattern_corners_m(self) -> npt.NDArray[np.float64]:
        """Corners of the ArUco pattern on the face, shape (4, 3), from the top left clockwise [m]."""
        return square_corners_m(self.pattern_size_m)

    def plate_corners_m(self) -> npt.NDArray[np.float64]:
        """Corners of the plate's face, shape (4, 3), from the top left clockwise [m]."""
        return square_corners_m(self.size_m)


def square_corners_m(size_m: float) -> npt.NDArray[np.float64]:
    """A side in, the corners of a square in the plane z = 0 out, shape (4, 3), from the top left clockwise [m].

    The order is that of OpenCV's ArUco detector and of its IPPE_SQUARE pose.
    """
    half = size_m / 2
    return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])


def aruco_dictionary(name: str) -> cv2.aruco.Dictionary:
    """The name of a predefined ArUco dictionary in, the dictionary out.

    Raises
    ------
    ValueError
        For a name that OpenCV does not have.
    """
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise ValueError(f"dictionary={name!r} is not one of OpenCV's; choose for example 'DICT_4X4_50'")
    return cv2.aruco.getPredefinedDictionary(number)
