"""Tests of the plate against OpenCV's own marker."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.marker import Board
from bicode_lab.marker.board import aruco_dictionary, square_corners_m


def detect(image, dictionary):
    """Return ArUco ids and corners that default parameters find in a grey image."""
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    return ([] if ids is None else ids.ravel().tolist()), corners


def drawn(cells, px):
    """Return a picture of cells with px pixels per cell, glowing cells white."""
    return np.kron(cells, np.ones((px, px), np.uint8)).astype(np.uint8) * 255


@pytest.mark.parametrize("name", ["DICT_4X4_50", "DICT_5X5_100", "DICT_6X6_250", "DICT_ARUCO_ORIGINAL"])
def test_cells_are_those_of_opencvs_own_marker(name):
    dictionary = aruco_dictionary(name)
    side = dictionary.markerSize + 2
    for number in range(0, len(dictionary.bytesList), 7):
        # Drawn large by OpenCV and read in the middle of each cell.
        large = cv2.aruco.generateImageMarker(dictionary, number, side * 10)
        white = large[5::10, 5::10] > 127
        black_plate = Board(aruco_id=number, dictionary=name, glow="black").cells()
        np.testing.assert_array_equal(black_plate, ~white)
        white_plate = Board(aruco_id=number, dictionary=name, glow="white").cells()
        assert white_plate.shape == (side + 2, side + 2)
        np.testing.assert_array_equal(white_plate[1:-1, 1:-1], white)
        frame = np.ones_like(white_plate, bool)
        frame[1:-1, 1:-1] = False
        assert white_plate[frame].all()  # the glowing margin around the dark border


@pytest.mark.parametrize("glow", ["black", "white"])
def test_every_plate_of_the_default_dictionary_is_detected(glow):
    for number in range(50):
        board = Board(aruco_id=number, glow=glow)
        image = drawn(board.cells(), 12)
        if glow == "black":
            image = 255 - image  # the black cells glow: what glows is seen inverted
        image = np.pad(image, 24, constant_values=255 if glow == "black" else 0)
        ids, corners = detect(image, aruco_dictionary(board.dictionary))
        assert ids == [number]
        # Where the pattern lies on the plate, and which corner is first: pixel centres are whole numbers.
        half = (image.shape[0] - 1) / 2
        px_per_m = 12 * board.cells().shape[0] / board.size_m
        expected = board.pattern_corners_m()[:, :2] * [px_per_m, -px_per_m] + half
        assert np.abs(corners[0].reshape(4, 2) - expected).max() <= 1.0  # detected to the pixel


def test_six_cells_over_five_centimetres():
    assert Board().cells().shape == (6, 6)
    assert Board(glow="white").cells().shape == (8, 8)
    assert Board().pattern_size_m == 0.05
    assert Board(glow="white").pattern_size_m == pytest.approx(0.05 * 6 / 8)


@given(st.floats(1e-4, 10))
def test_corners_run_clockwise_from_the_top_left_about_the_middle(size_m):
    corners = square_corners_m(size_m)
    assert corners.sum(0).tolist() == [0, 0, 0]
    assert corners[0, 0] < 0 < corners[0, 1]  # left, up (y up)
    np.testing.assert_allclose(np.linalg.norm(np.diff(corners, axis=0, append=corners[:1]), axis=1), size_m)
    # Seen from the viewer (z towards him, y up) clockwise is a negative turn.
    area = 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, np.roll(corners, -1, 0), strict=True))
    assert area == pytest.approx(-(size_m**2))
    # The order that OpenCV's IPPE_SQUARE asks for.
    half = size_m / 2
    np.testing.assert_array_equal(corners, [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"size_m": 0.0}, ["size_m=0.0", "more than 0"]),
        ({"glow": "red"}, ["'red'", "'black' or 'white'"]),
        ({"aruco_id": 50}, ["aruco_id=50", "DICT_4X4_50", "0 .. 49"]),
        ({"aruco_id": -1}, ["aruco_id=-1", "0 .. 49"]),
        ({"dictionary": "DICT_9X9"}, ["'DICT_9X9'", "DICT_4X4_50"]),
        ({"dictionary": "CORNER_REFINE_NONE"}, ["'CORNER_REFINE_NONE'"]),
        ({"thickness_m": -0.001}, ["thickness_m=-0.001"]),
        ({"size_m": float("nan")}, ["size_m=nan"]),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, words):
    with pytest.raises(ValueError) as refused:
        Board(**settings)
    assert all(word in str(refused.value) for word in words), refused.value
