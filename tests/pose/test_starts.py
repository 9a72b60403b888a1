"""Starts of a fit: moments, affine maps and mirrored poses."""

from __future__ import annotations

import numpy as np
import pytest

from bicode_lab.marker import Board
from bicode_lab.pose.response import LightPriors, expected
from bicode_lab.pose.starts import affine_maps, best_turns, mirrored, moments, pattern_moments, poses_of, turn_to

from .plates import CAMERA, drawn, pose

LIGHT = LightPriors().table()[:, 0].copy()


def turned_deg(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(first.T @ second) - 1) / 2, -1, 1))))


@pytest.mark.parametrize("values", [(25, 30, 75, 300), (45, 200, 160, 300), (50, 110, 290, 1100)])
@pytest.mark.parametrize("aruco_id", [17, 2])
def test_the_best_start_is_near_the_pose(values: tuple[float, ...], aruco_id: int) -> None:
    rotation, place = pose(*values)
    image, x0, y0 = drawn(rotation, place, aruco_id=aruco_id, edges=(0, 0))
    seen = np.empty(image.shape[:2])
    expected(np.ascontiguousarray(image), np.zeros_like(seen), LIGHT, seen, np.empty_like(seen))
    found = moments(seen, np.zeros_like(seen), LIGHT)
    assert found is not None
    middle, spread = found
    cells = Board(aruco_id=aruco_id).cells().astype(float)
    offset, pattern = pattern_moments(cells)
    maps = affine_maps(spread, pattern)
    best, _ = best_turns(seen, middle, maps, offset, cells, 0.9)[0]
    starts = poses_of(maps[best], middle + [x0, y0], offset, CAMERA)
    assert min(turned_deg(r, rotation) for r, _ in starts) < 10
    assert max(turned_deg(r, rotation) for r, _ in starts) > 30  # the mirrored one
    for _, t in starts:
        np.testing.assert_allclose(t, place, rtol=0.06, atol=1)


def test_a_mirrored_pose_is_tilted_as_much_to_the_other_side() -> None:
    rotation, place = pose(40, 70, 20, 300, x=60)
    other = mirrored(rotation, place)
    np.testing.assert_allclose(other @ other.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(other) == pytest.approx(1)
    np.testing.assert_allclose(mirrored(other, place), rotation, atol=1e-12)
    sight = place / np.linalg.norm(place)
    assert other[:, 2] @ sight == pytest.approx(rotation[:, 2] @ sight)
    across = (rotation + other)[:, 2] - (rotation + other)[:, 2] @ sight * sight
    np.testing.assert_allclose(across, 0, atol=1e-12)


def test_the_shortest_turn_leads_to_the_place() -> None:
    place = np.array([1.0, -2, 5])
    look = turn_to(place)
    np.testing.assert_allclose(look @ [0, 0, 1], place / np.linalg.norm(place))
    np.testing.assert_allclose(look @ look.T, np.eye(3), atol=1e-12)


def test_moments_of_a_pattern() -> None:
    middle, spread = pattern_moments(np.ones((6, 6)))
    np.testing.assert_allclose(middle, 0)
    np.testing.assert_allclose(spread, 3 * np.eye(2))
    corner = np.zeros((6, 6))
    corner[0, 5] = 1  # top right
    np.testing.assert_allclose(pattern_moments(corner)[0], 2.5)


def test_dark_images_have_no_moments() -> None:
    assert moments(np.zeros((20, 20)), np.zeros((20, 20)), LIGHT) is None
    line = np.zeros((20, 20))
    line[5] = 3
    assert moments(line, np.zeros((20, 20)), LIGHT) is None
    assert moments(np.full((20, 20), 0.5), np.ones((20, 20)), LIGHT) is None  # no more than the background's deviation
