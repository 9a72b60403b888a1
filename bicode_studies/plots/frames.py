"""Event frames in the colours of the camera maker's own viewer, and what was found in them.

Frames have shape (height, width); pixel centres lie on whole numbers, y runs down.
Boxes are (x, y, w, h) from their top left pixel: box (5, 6, 1, 1) holds pixel (5, 6).
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
FOUND = "#E69F00"  # boxes and corners: Okabe-Ito orange, seen on the dark and in grey

Box = Sequence[float]
"""Left, top, width, height [px]."""

_THREE = ListedColormap([OFF, BACKGROUND, ON], name="three_values")
_GRADED = LinearSegmentedColormap.from_list("graded", [BACKGROUND, OFF, ON])


def draw_frame(frame: npt.NDArray[Any], ax: Axes, *, zoom: Box | None = None) -> Axes:
    """A 3-valued frame in; +1 white, -1 blue, 0 dark, as in Fig. 3.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        -1, 0, +1.
    ax : Axes
    zoom : (x, y, w, h), optional
        The part to show [px]; None shows all.
    """
    _show(frame, ax, zoom, _THREE, -1.0, 1.0)
    return ax


def draw_counts(
    counts: npt.NDArray[Any], ax: Axes, *, zoom: Box | None = None, largest: float | None = None, bar: bool = True
) -> Axes:
    """A graded frame in, from dark (0 events) over blue to white (many).

    Parameters
    ----------
    counts : ndarray, shape (height, width)
        Events of each pixel, 0 or more.
    ax : Axes
    zoom : (x, y, w, h), optional
        The part to show [px]; None shows all.
    largest : float, optional
        Count that is drawn white; None takes the largest there is.
    bar : bool
        Whether to put a colour bar beside it.
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
    zoom: Box,
    *,
    bounds: tuple[float, float, float, float] = (0.62, 0.55, 0.36, 0.42),
) -> Axes:
    """A 3-valued frame and a part of it in; that part, enlarged, in a corner of `ax`, and the new axes out.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
    ax : Axes
        Holds the whole frame already.
    zoom : (x, y, w, h)
        The part to enlarge [px].
    bounds : (left, bottom, width, height)
        Where in `ax`, as fractions of it.
    """
    inset = ax.inset_axes(bounds)
    draw_frame(frame, inset, zoom=zoom)
    inset.set(xlabel="", ylabel="", xticks=[], yticks=[])
    for spine in inset.spines.values():
        spine.set(visible=True, color=FOUND, linewidth=1.2)
    x, y, w, h = zoom
    ax.indicate_inset((x - 0.5, y - 0.5, w, h), inset, edgecolor=FOUND, alpha=0.9)
    return inset


def draw_box(box: Box, ax: Axes, *, label: str = "", color: str = FOUND, dashed: bool = False) -> Axes:
    """A box (x, y, w, h) [px] and its label in; both drawn around the pixels it holds."""
    x, y, w, h = box
    style = "--" if dashed else "-"
    ax.add_patch(Rectangle((x - 0.5, y - 0.5), w, h, fill=False, edgecolor=color, linewidth=1.5, linestyle=style))
    if label:
        ax.annotate(
            label, (x - 0.5, y - 0.5), xytext=(0, 3), textcoords="offset points", color=color, fontsize=9,
            fontweight="bold", va="bottom", bbox={"facecolor": BACKGROUND, "edgecolor": "none", "pad": 1, "alpha": 0.8},
        )  # fmt: skip
    return ax


def draw_boxes(
    boxes: Sequence[Box], ax: Axes, *, labels: Sequence[str] = (), color: str = FOUND, dashed: bool = False
) -> Axes:
    """Boxes of regions or tracks in, with a label each or none at all; see `draw_box`.

    Raises
    ------
    ValueError
        Where there are labels, but not one a box.
    """
    if labels and len(labels) != len(boxes):
        raise ValueError(f"{len(labels)} labels for {len(boxes)} boxes; give one a box, or none")
    for number, box in enumerate(boxes):
        draw_box(box, ax, label=labels[number] if labels else "", color=color, dashed=dashed)
    return ax


def draw_corners(corners_px: npt.ArrayLike, ax: Axes, *, color: str = FOUND, dashed: bool = False) -> Axes:
    """Four corners in, shape (4, 2) [px]; their outline, and a dot on the first, the pattern's own top left."""
    corners = np.asarray(corners_px, float)
    style = "--" if dashed else "-"
    ax.add_patch(Polygon(corners, closed=True, fill=False, edgecolor=color, linewidth=1.5, linestyle=style))
    ax.plot(corners[:1, 0], corners[:1, 1], "o", color=color, markersize=5)
    return ax


def draw_pose(
    rvec: npt.ArrayLike, tvec: npt.ArrayLike, matrix: npt.ArrayLike, ax: Axes, *, length_m: float = 0.025
) -> Axes:
    """A marker's pose in; its three axes where the camera sees them: x red, y green, z blue, named at their tips.

    Parameters
    ----------
    rvec, tvec : array_like, shape (3,)
        Rotation vector [rad] and place [m], marker to camera.
    matrix : array_like, shape (3, 3)
        The camera's matrix K [px].
    ax : Axes
    length_m : float
        Length of the axes drawn [m].
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
    frame: npt.NDArray[Any], ax: Axes, zoom: Box | None, colors: Colormap, lowest: float, highest: float
) -> AxesImage:
    """The part of a frame that is asked for as a picture, axes named, no grid over it."""
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
