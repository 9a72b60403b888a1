"""Boxes of pixels, and what is done with two or many of them: overlap, hull, intersection over union."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Box(NamedTuple):
    """A rectangle of pixels: columns ``x .. x + w - 1``, rows ``y .. y + h - 1``.

    A box is a plain tuple ``(x, y, w, h)``, so that any such tuple can be turned into one with ``Box(*values)``.

    Attributes
    ----------
    x, y : int
        Column and row of the top left pixel [px].
    w, h : int
        Width and height [px]; a box with a side of 0 or less is empty.

    Examples
    --------
    >>> Box(0, 0, 4, 4).union(Box(6, 2, 2, 2))
    Box(x=0, y=0, w=8, h=4)
    >>> Box(0, 0, 4, 4).shared_area(Box(2, 2, 4, 4))
    4
    """

    x: int
    y: int
    w: int
    h: int

    @classmethod
    def between(cls, x: int, y: int, right: int, bottom: int) -> Box:
        """Make the box whose first column and row are `x`, `y` and that ends before `right`, `bottom` [px]."""
        return cls(x, y, right - x, bottom - y)

    @property
    def right(self) -> int:
        """First column to the right of the box [px]."""
        return self.x + self.w

    @property
    def bottom(self) -> int:
        """First row below the box [px]."""
        return self.y + self.h

    @property
    def area(self) -> int:
        """Number of pixels in the box; 0 where it is empty."""
        return max(self.w, 0) * max(self.h, 0)

    @property
    def is_empty(self) -> bool:
        """True where the box holds no pixel."""
        return self.w <= 0 or self.h <= 0

    def clipped(self, width: int, height: int) -> Box:
        """Return the part of the box that lies on a sensor of `width` times `height` pixels."""
        return Box.between(max(self.x, 0), max(self.y, 0), min(self.right, width), min(self.bottom, height))

    def union(self, other: Box) -> Box:
        """Return the smallest box that holds both boxes."""
        return Box.between(
            min(self.x, other.x), min(self.y, other.y), max(self.right, other.right), max(self.bottom, other.bottom)
        )

    def shared_area(self, other: Box) -> int:
        """Return the number of pixels that both boxes hold."""
        w = min(self.right, other.right) - max(self.x, other.x)
        h = min(self.bottom, other.bottom) - max(self.y, other.y)
        return max(w, 0) * max(h, 0)

    def overlaps(self, other: Box) -> bool:
        """Return whether the boxes share a pixel."""
        return self.shared_area(other) > 0


def iou(
    first: npt.NDArray[np.float64], second: npt.NDArray[np.float64], pad_px: float = 0.0
) -> npt.NDArray[np.float64]:
    """Return the intersection over union of each pair of boxes.

    Parameters
    ----------
    first, second : ndarray, shape (n, 4) and (m, 4)
        Boxes x, y, w, h [px], with areas above 0.
    pad_px : float
        Width of a border added on all sides of each box first [px].

    Returns
    -------
    ndarray, shape (n, m)
        Shared area over the area of both together, 0 .. 1.

    Examples
    --------
    >>> iou(np.array([[0.0, 0, 2, 2]]), np.array([[1.0, 0, 2, 2], [9, 9, 2, 2]])).round(2)
    array([[0.33, 0.  ]])
    """
    a0, a1 = first[:, None, :2] - pad_px, first[:, None, :2] + first[:, None, 2:] + pad_px
    b0, b1 = second[None, :, :2] - pad_px, second[None, :, :2] + second[None, :, 2:] + pad_px
    shared: npt.NDArray[np.float64] = np.clip(np.minimum(a1, b1) - np.maximum(a0, b0), 0, None).prod(axis=2)
    together: npt.NDArray[np.float64] = (a1 - a0).prod(axis=2) + (b1 - b0).prod(axis=2) - shared
    return shared / together
