"""Frames, boxes and poses are drawn where their data say."""

import numpy as np
import pytest
from matplotlib import colors
from matplotlib.figure import Figure

from bicode_studies.plots import (
    BACKGROUND,
    OFF,
    ON,
    draw_box,
    draw_boxes,
    draw_corners,
    draw_counts,
    draw_frame,
    draw_inset,
    draw_pose,
)


@pytest.fixture
def ax():
    return Figure().add_subplot()


@pytest.fixture
def frame():
    return np.random.default_rng(0).integers(-1, 2, (20, 30)).astype(np.int8)


def test_a_frame_is_drawn_as_it_is_with_axes_named(ax, frame):
    before = frame.copy()
    assert draw_frame(frame, ax) is ax
    (image,) = ax.images
    np.testing.assert_array_equal(image.get_array(), frame)
    np.testing.assert_array_equal(frame, before)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (px)", "y (px)")


@pytest.mark.parametrize(("value", "color"), [(-1, OFF), (0, BACKGROUND), (1, ON)])
def test_each_value_has_its_colour_whatever_else_is_in_the_frame(ax, value, color):
    draw_frame(np.full((4, 4), value, np.int8), ax)
    (image,) = ax.images
    assert colors.to_hex(image.to_rgba(image.get_array())[0, 0]) == color.lower()


def test_y_runs_down_and_a_zoom_shows_whole_pixels(ax, frame):
    draw_frame(frame, ax, zoom=(5, 6, 10, 8))
    assert ax.get_xlim() == (4.5, 14.5)
    assert ax.get_ylim() == (13.5, 5.5)
    (image,) = ax.images
    np.testing.assert_array_equal(image.get_array(), frame[6:14, 5:15])
    assert tuple(image.get_extent()) == (4.5, 14.5, 13.5, 5.5)


def test_a_zoom_may_reach_over_the_border(ax, frame):
    draw_frame(frame, ax, zoom=(-4, 15, 10, 10))
    assert ax.get_xlim() == (-4.5, 5.5)
    (image,) = ax.images
    np.testing.assert_array_equal(image.get_array(), frame[15:, :6])
    assert tuple(image.get_extent()) == (-0.5, 5.5, 19.5, 14.5)


def test_counts_are_graded_and_the_largest_may_be_fixed(ax):
    counts = np.arange(6).reshape(2, 3)
    draw_counts(counts, ax, largest=20)
    (image,) = ax.images
    np.testing.assert_array_equal(image.get_array(), counts)
    assert image.get_clim() == (0, 20)
    assert ax.get_figure().axes[1].get_ylabel() == "events per pixel (count)"


def test_counts_of_nothing_are_legal(ax):
    draw_counts(np.zeros((4, 5), int), ax, bar=False)
    assert ax.images[0].get_clim() == (0, 1)
    assert len(ax.get_figure().axes) == 1


def test_an_inset_shows_the_part_asked_for(ax, frame):
    draw_frame(frame, ax)
    inset = draw_inset(frame, ax, (2, 3, 6, 5))
    assert inset.get_xlim() == (1.5, 7.5)
    np.testing.assert_array_equal(inset.images[0].get_array(), frame[3:8, 2:8])


def test_a_box_goes_round_its_pixels_with_its_label(ax):
    draw_box((5, 6, 1, 2), ax, label="track 3")
    (patch,) = ax.patches
    assert (patch.get_xy(), patch.get_width(), patch.get_height()) == ((4.5, 5.5), 1, 2)
    assert [text.get_text() for text in ax.texts] == ["track 3"]


def test_boxes_have_a_label_each_or_none(ax):
    draw_boxes([(0, 0, 2, 2), (5, 5, 1, 1)], ax)
    assert (len(ax.patches), len(ax.texts)) == (2, 0)
    draw_boxes([], ax)
    with pytest.raises(ValueError, match="1 labels for 2 boxes"):
        draw_boxes([(0, 0, 2, 2), (5, 5, 1, 1)], ax, labels=["one"])


def test_corners_keep_their_order_and_the_first_has_the_dot(ax):
    corners = np.array([[1, 2], [8, 2.5], [8, 9], [1, 9]])
    draw_corners(corners, ax)
    np.testing.assert_array_equal(ax.patches[0].get_xy()[:4], corners)
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), corners[:1])


def test_the_axes_of_a_pose_start_at_its_place_and_end_where_the_camera_sees_their_tips(ax):
    """Use a marker that faces the camera: x points right, y up in the image, z towards the camera."""
    matrix = np.array([[1000.0, 0, 320], [0, 1000, 240], [0, 0, 1]])
    draw_pose([np.pi, 0, 0], [0, 0, 2.0], matrix, ax, length_m=0.1)
    ends = [line.get_xydata() for line in ax.lines]
    for end in ends:
        np.testing.assert_allclose(end[0], [320, 240], atol=1e-6)
    np.testing.assert_allclose(ends[0][1], [370, 240], atol=1e-6)
    np.testing.assert_allclose(ends[1][1], [320, 190], atol=1e-6)
    np.testing.assert_allclose(ends[2][1], [320, 240], atol=1e-6)
    assert [text.get_text() for text in ax.texts] == ["x", "y", "z"]
