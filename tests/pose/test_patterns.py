"""Patterns that can be told from their own turns."""

from dataclasses import replace

import numpy as np
import pytest

from bicode_lab.marker import Board
from bicode_lab.pose.patterns import better_half, turn_contrast


def test_a_sharp_pattern_differs_by_the_cells_that_differ() -> None:
    cells = Board(aruco_id=2).cells().astype(int)
    least = min(np.abs(cells - np.rot90(cells, turns)).sum() for turns in (1, 2, 3))
    assert turn_contrast(Board(aruco_id=2), 0.05) == pytest.approx(least, rel=0.05)


def test_blur_takes_contrast_and_the_better_half_has_more_of_it() -> None:
    board = Board()
    contrast = [turn_contrast(replace(board, aruco_id=number)) for number in range(50)]
    assert contrast[17] < turn_contrast(Board(aruco_id=17), 0.3)
    half = better_half(board)
    assert len(set(half)) == 25
    assert min(contrast[number] for number in half) >= max(contrast[number] for number in set(range(50)) - set(half))
    assert half[0] == int(np.argmax(contrast))
