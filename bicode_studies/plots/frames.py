"""Draw event frames in the colours of the camera maker's viewer, and what the receiver found in them.

Frames have the shape (height, width). Pixel centres lie on whole numbers and y runs down.
A box (x, y, w, h) begins at its top left pixel: box (5, 6, 1, 1) holds the pixel (5, 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LinearSegmentedColormap, ListedColormap
from matplotlib.image import AxesImage
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import Normal, Stroke

BACKGROUND = "#1E2534"
ON = "#FFFFFF"
OFF = "#407EC9"
FOUND = "#E69F00"  # for boxes and corners: Okabe-Ito orange, visible on dark frames and in grey print

BoxLike = Sequence[float]
"""A box as (x, y, w, h) [px]; fractions are allowed."""

_THREE = ListedColormap([OFF, BACKGROUND, ON], name="three_values")
_GRADED = LinearSegmentedColormap.from_list("graded", [BACKGROUND, OFF, ON])


def draw_frame(frame: npt.NDArray[Any], ax: Axes, *, zoom: BoxLike | None = None) -> Axes:
    """Draw a 3-valued frame: +1 white, -1 blue, 0 dark, as in Fig. 3.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        Values -1, 0 and +1.
    ax : Axes
        Where to draw.
    zoom : (x, y, w, h), optional
        The part to show [px]; None shows all.

    Returns
    -------
    Axes
        The axes.
    """
    _show(frame, ax, zoom, _THREE, -1.0, 1.0)
    return ax


def draw_counts(
    counts: npt.NDArray[Any], ax: Axes, *, zoom: BoxLike | None = None, largest: float | None = None, bar: bool = True
) -> Axes:
    """Draw the number of events per pixel: dark for 0, then blue, white for the largest.

    Parameters
    ----------
    counts : ndarray, shape (height, width)
        Events of each pixel, 0 or more.
    ax : Axes
        Where to draw.
    zoom : (x, y, w, h), optional
        The part to show [px]; None shows all.
    largest : float, optional
        The count that is drawn white; None takes the largest of the frame.
    bar : bool
        Whether to draw a colour bar.

    Returns
    -------
    Axes
        The axes.
    """
    top = largest if largest is not None else max(float(counts.max(initial=1)), 1.0)
    image = _show(counts, ax, zoom, _GRADED, 0.0, top)
    if bar:
        figure = ax.get_figure()
        assert figure is not None
        figure.colorbar(image, ax=ax, label="events per pixel (count)", shrink=0.85)
    return ax


def draw_inset(
    frame: npt.NDArray[Any],
    ax: Axes,
    zoom: BoxLike,
    *,
    bounds: tuple[float, float, float, float] = (0.62, 0.55, 0.36, 0.42),
) -> Axes:
    """Draw a part of a 3-valued frame, enlarged, in a corner of the axes that show the frame.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        Values -1, 0 and +1.
    ax : Axes
        The axes that show the whole frame.
    zoom : (x, y, w, h)
        The part to enlarge [px].
    bounds : (left, bottom, width, height)
        Place of the enlarged part, as fractions of `ax`.

    Returns
    -------
    Axes
        The new axes, which hold the enlarged part.
    """
    inset = ax.inset_axes(bounds)
    draw_frame(frame, inset, zoom=zoom)
    inset.set(xlabel="", ylabel="", xticks=[], yticks=[])
    for spine in inset.spines.values():
        spine.set(visible=True, color=FOUND, linewidth=1.2)
    x, y, w, h = zoom
    ax.indicate_inset((x - 0.5, y - 0.5, w, h), inset, edgecolor=FOUND, alpha=0.9)
    return inset


def draw_box(box: BoxLike, ax: Axes, *, label: str = "") -> Axes:
    """Draw a box around the pixels it holds, with a label above it.

    Parameters
    ----------
    box : (x, y, w, h)
        The box [px].
    ax : Axes
        Where to draw.
    label : str
        The label; none if empty.

    Returns
    -------
    Axes
        The axes.
    """
    x, y, w, h = box
    ax.add_patch(Rectangle((x - 0.5, y - 0.5), w, h, fill=False, edgecolor=FOUND, linewidth=1.5))
    if label:
        ax.annotate(
            label, (x - 0.5, y - 0.5), xytext=(0, 3), textcoords="offset points", color=FOUND, fontsize=9,
            fontweight="bold", va="bottom", bbox={"facecolor": BACKGROUND, "edgecolor": "none", "pad": 1, "alpha": 0.8},
        )  # fmt: skip
    return ax


def draw_boxes(boxes: Sequence[BoxLike], ax: Axes, *, labels: Sequence[str] = ()) -> Axes:
    """Draw the boxes of regions or tracks, each with its label or all without; see `draw_box`.

    Parameters
    ----------
    boxes : sequence of (x, y, w, h)
        The boxes [px].
    ax : Axes
        Where to draw.
    labels : sequence of str
        One label per box, or none at all.

    Returns
    -------
    Axes
        The axes.

    Raises
    ------
    ValueError
        If there are labels, but not one per box.
    """
    if labels and len(labels) != len(boxes):
        raise ValueError(f"{len(labels)} labels for {len(boxes)} boxes; give one per box, or none")
    for number, box in enumerate(boxes):
        draw_box(box, ax, label=labels[number] if labels else "")
    return ax


def draw_corners(corners_px: npt.ArrayLike, ax: Axes, *, color: str = FOUND, dashed: bool = False) -> Axes:
    """Draw the outline of four corners, and a dot on the first one, the pattern's own top left corner.

    Parameters
    ----------
    corners_px : array_like, shape (4, 2)
        The corners (x, y) [px].
    ax : Axes
        Where to draw.
    color : str
        Colour of outline and dot.
    dashed : bool
        Whether the outline is dashed.

    Returns
    -------
    Axes
        The axes.
    """
    corners = np.asarray(corners_px, float)
    style = "--" if dashed else "-"
    ax.add_patch(Polygon(corners, closed=True, fill=False, edgecolor=color, linewidth=1.5, linestyle=style))
    ax.plot(corners[:1, 0], corners[:1, 1], "o", color=color, markersize=5)
    return ax


def draw_pose(
    rvec: npt.ArrayLike, tvec: npt.ArrayLike, matrix: npt.ArrayLike, ax: Axes, *, length_m: float = 0.025
) -> Axes:
    """Draw the three axes of a marker's pose where the camera sees them: x red, y green, z blue.

    Parameters
    ----------
    rvec, tvec : array_like, shape (3,)
        Rotation vector [rad] and translation [m] from the marker's frame to the camera's.
    matrix : array_like, shape (3, 3)
        The camera matrix K [px].
    ax : Axes
        Where to draw.
    length_m : float
        Length of the drawn axes [m].

    Returns
    -------
    Axes
        The axes.
    """
    points = np.vstack([np.zeros(3), np.eye(3)]) * length_m
    place = [np.asarray(v, float).reshape(3, 1) for v in (rvec, tvec)]
    seen = cv2.projectPoints(points, place[0], place[1], np.asarray(matrix, float), np.zeros(5))[0].reshape(4, 2)
    dark_rim = [Stroke(linewidth=5, foreground=BACKGROUND), Normal()]
    for name, color, tip in zip("xyz", ("#FF5A4F", "#3DDC84", "#56B4E9"), seen[1:], strict=True):
        ax.plot(*np.stack([seen[0], tip], axis=1), "-", color=color, linewidth=2.5, path_effects=dark_rim)
        ax.annotate(
            name, (float(tip[0]), float(tip[1])), xytext=(3, 3), textcoords="offset points", color=color,
            fontsize=10, fontweight="bold", path_effects=dark_rim,
        )  # fmt: skip
    return ax


def _show(
    frame: npt.NDArray[Any], ax: Axes, zoom: BoxLike | None, colors: Colormap, lowest: float, highest: float
) -> AxesImage:
    """Draw the selected part of a frame as an image, with labelled axes and without a grid."""
    height, width = frame.shape
    x, y, w, h = (0, 0, width, height) if zoom is None else zoom
    left, top = max(int(np.floor(x)), 0), max(int(np.floor(y)), 0)
    part = frame[top : max(int(np.ceil(y + h)), top + 1), left : max(int(np.ceil(x + w)), left + 1)]
    image = ax.imshow(
        part, cmap=colors, vmin=lowest, vmax=highest, interpolation="antialiased", interpolation_stage="rgba",
        extent=(left - 0.5, left + part.shape[1] - 0.5, top + part.shape[0] - 0.5, top - 0.5),
    )  # fmt: skip
    ax.set(xlim=(x - 0.5, x + w - 0.5), ylim=(y + h - 0.5, y - 0.5), xlabel="x (px)", ylabel="y (px)")
    ax.set_facecolor(BACKGROUND)
    ax.grid(visible=False)
    return image
