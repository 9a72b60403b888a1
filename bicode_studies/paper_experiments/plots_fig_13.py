"""Plots of Fig. 13: frames side by side, each cut out around its marker, all frames of a row at one scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from bicode_studies.plots.frames import BoxLike, draw_frame

BAR = "#FFFFFF"


def draw_panel(
    frame: npt.NDArray[np.int8], box_px: BoxLike, ax: Axes, *, size_px: tuple[float, float], title: str = ""
) -> Axes:
    """Draw the part of a frame around the middle of the marker, as in Fig. 13.

    Parameters
    ----------
    frame : ndarray of int8, shape (height, width)
        -1, 0 or +1.
    box_px : tuple of 4 floats
        Left, top, width and height of the marker [px].
    ax : Axes
    size_px : tuple of 2 floats
        Width and height of the part [px]; what lies beyond the sensor stays dark.
    title : str
        Text below the panel, as in the paper.

    Returns
    -------
    Axes
    """
    x, y, w, h = box_px
    width, height = size_px
    draw_frame(frame, ax, zoom=(x + w / 2 - width / 2, y + h / 2 - height / 2, width, height))
    ax.set(xticks=[], yticks=[], xlabel=title, ylabel="")
    for spine in ax.spines.values():
        spine.set_visible(False)
    return ax


def draw_panels(
    frames: Sequence[npt.NDArray[np.int8]],
    boxes_px: Sequence[BoxLike],
    titles: Sequence[str],
    axes: Sequence[Axes],
    *,
    size_px: tuple[float, float],
    bar_px: int,
) -> None:
    """Draw a row of panels at one scale, with a scale bar in the first one.

    Parameters
    ----------
    frames : sequence of ndarray of int8, shape (height, width)
        -1, 0 or +1.
    boxes_px : sequence of tuples of 4 floats
        Left, top, width and height of each marker [px].
    titles : sequence of str
        Texts below the panels.
    axes : sequence of Axes
    size_px : tuple of 2 floats
        Width and height of the part that each panel shows [px].
    bar_px : int
        Length of the scale bar [px].
    """
    for frame, box, title, ax in zip(frames, boxes_px, titles, axes, strict=True):
        draw_panel(frame, box, ax, size_px=size_px, title=title)
    first = axes[0]
    x0, y0 = first.get_xlim()[0] + 0.06 * size_px[0], first.get_ylim()[0] - 0.08 * size_px[1]
    first.plot([x0, x0 + bar_px], [y0, y0], "-", color=BAR, linewidth=2.5, solid_capstyle="butt")
    first.annotate(f"{bar_px} px", (x0, y0), xytext=(0, 4), textcoords="offset points", color=BAR, fontsize=9)
