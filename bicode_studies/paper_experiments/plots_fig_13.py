"""Fig. 13: frames side by side, each around its marker, those of a row at one scale."""

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
    """A 3-valued frame and the marker's box in; the part of `size_px` around the marker's middle, as Fig. 13 shows it.

    Parameters
    ----------
    frame : ndarray, shape (height, width)
        -1, 0, +1.
    box_px : (x, y, w, h)
        Where the marker is [px].
    ax : Axes
    size_px : (width, height)
        Of the part; what lies beyond the sensor stays dark [px].
    title : str
        Below the panel, as in the paper.
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
    """A row of panels in, drawn at one scale, which a bar of `bar_px` pixels in the first one tells."""
    for frame, box, title, ax in zip(frames, boxes_px, titles, axes, strict=True):
        draw_panel(frame, box, ax, size_px=size_px, title=title)
    first = axes[0]
    x0, y0 = first.get_xlim()[0] + 0.06 * size_px[0], first.get_ylim()[0] - 0.08 * size_px[1]
    first.plot([x0, x0 + bar_px], [y0, y0], "-", color=BAR, linewidth=2.5, solid_capstyle="butt")
    first.annotate(f"{bar_px} px", (x0, y0), xytext=(0, 4), textcoords="offset points", color=BAR, fontsize=9)
