"""The acrylic plate (Fig. 4): which of its cells glow, and where its corners are.

The plate glows where it is engraved and is clear, hence dark, elsewhere. Two kinds of plate can be built. On a "black"
plate the black cells of the pattern are engraved, the frame included: the camera sees the pattern inverted, and the
pattern fills the plate. On a "white" plate the white cells are engraved and a margin of one cell around the black
frame, which takes two of the eight cells of each side.

The axes of a marker have their origin in the middle of the face: x to the right, y up, z out of the face towards the
viewer [m].
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
    """A plate with an ArUco pattern; the defaults are the paper's 5 cm prototype as read from Fig. 4 and 13.

    Parameters
    ----------
    aruco_id : int
        Index of the pattern in the dictionary; it is independent of the blinked ID.
    dictionary : str
        Name of one of OpenCV's predefined ArUco dictionaries.
    size_m : float
        Side of the plate [m].
    glow : {"black", "white"}
        Which cells of the pattern are engraved and glow.
    thickness_m : float
        Thickness of the plate [m]; its side faces glow, too.

    Raises
    ------
    ValueError
        If a value is impossible or the dictionary has no such pattern.
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
        """Return which cells of the plate glow.

        Returns
        -------
        ndarray of uint8, shape (n, n)
            1 glows, 0 is dark; from the top left cell, with frame and margin.

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
        """Side of the ArUco pattern with its frame [m], which the estimation of the pose needs."""
        cells = aruco_dictionary(self.dictionary).markerSize + 2
        return self.size_m * (1.0 if self.glow == "black" else cells / (cells + 2))

    def pattern_corners_m(self) -> npt.NDArray[np.float64]:
        """Return the corners of the ArUco pattern on the face, shape (4, 3), clockwise from the top left [m]."""
        return square_corners_m(self.pattern_size_m)

    def plate_corners_m(self) -> npt.NDArray[np.float64]:
        """Return the corners of the face of the plate, shape (4, 3), clockwise from the top left [m]."""
        return square_corners_m(self.size_m)


def square_corners_m(size_m: float) -> npt.NDArray[np.float64]:
    """Return the corners of a square in the plane z = 0.

    The order is that of OpenCV's ArUco detector and of its pose method IPPE_SQUARE.

    Parameters
    ----------
    size_m : float
        Side of the square [m].

    Returns
    -------
    ndarray of float64, shape (4, 3)
        Clockwise from the top left [m].
    """
    half = size_m / 2
    return np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])


def aruco_dictionary(name: str) -> cv2.aruco.Dictionary:
    """Return a predefined ArUco dictionary of OpenCV.

    Parameters
    ----------
    name : str
        For example "DICT_4X4_50".

    Returns
    -------
    cv2.aruco.Dictionary

    Raises
    ------
    ValueError
        If OpenCV has no dictionary of this name.
    """
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise ValueError(f"dictionary={name!r} is not one of OpenCV's; choose for example 'DICT_4X4_50'")
    return cv2.aruco.getPredefinedDictionary(number)
