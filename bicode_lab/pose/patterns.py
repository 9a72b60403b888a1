"""Which patterns of a dictionary can be told from their own turns when they are far away.

From far, the lens blurs a pattern, and only the difference that is left between the pattern and itself, turned by one,
two or three quarters, tells which way is up.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from bicode_lab.marker.board import Board, aruco_dictionary

FAR_BLUR_CELLS = 0.6  # a blur of 0.8 px on a 5 cm plate at 10 m, seen through 8 mm and 4.86 um
FINER = 8  # points per cell, along each side


def turn_contrast(board: Board, blur_cells: float = FAR_BLUR_CELLS) -> float:
    """Return how much a blurred pattern differs from its own turns.

    Parameters
    ----------
    board : Board
    blur_cells : float
        Standard deviation of the blur [cells].

    Returns
    -------
    float
        Sum of squared differences, in cells of full contrast, for the turn that differs least; 0 where a turn looks the
        same.

    Examples
    --------
    >>> round(turn_contrast(Board(aruco_id=17)), 1), round(turn_contrast(Board(aruco_id=17), 0.05), 1)
    (1.7, 5.8)
    """
    cells = np.pad(board.cells().astype(np.float32), 3)
    fine = cv2.resize(cells, None, fx=FINER, fy=FINER, interpolation=cv2.INTER_NEAREST)
    seen = cv2.GaussianBlur(fine, (0, 0), blur_cells * FINER)
    return min(float(((seen - np.rot90(seen, turns)) ** 2).sum()) / FINER**2 for turns in (1, 2, 3))


def better_half(board: Board, blur_cells: float = FAR_BLUR_CELLS) -> tuple[int, ...]:
    """Return the half of a dictionary's patterns that differs most from its own turns.

    Parameters
    ----------
    board : Board
        Its dictionary and the cells that glow count, its pattern does not.
    blur_cells : float
        Standard deviation of the blur [cells].

    Returns
    -------
    tuple of int
        The best pattern first.
    """
    count = len(aruco_dictionary(board.dictionary).bytesList)
    contrast = [turn_contrast(replace(board, aruco_id=number), blur_cells) for number in range(count)]
    return tuple(int(number) for number in np.argsort(-np.array(contrast), kind="stable")[: count // 2])
