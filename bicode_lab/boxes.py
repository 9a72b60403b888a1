"""Boxes of pixels, and what is done with two or many of them: overlap, hull, intersection over union."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

MERGE_AREA = 3.0  # a region up to this many times as large as the box of a 2D marker is that marker's, else clutter


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
        """Make a box from its borders.

        Parameters
        ----------
        x, y : int
            First column and first row [px].
        right, bottom : int
            First column to the right of the box and first row below it [px].
        """
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


def merge_boxes(
    regions: Sequence[Box], markers: Sequence[Box], width: int, height: int
) -> list[tuple[Box, int | None]]:
    """Merge each 2D marker's box with the blinking regions that overlap it.

    The merged box is the hull of both, so that it covers a moving marker over the whole period. A region that is
    more than `MERGE_AREA` times as large as the marker's box, or that overlaps several markers, is clutter and is
    not merged. A marker without a region keeps its own box.

    Parameters
    ----------
    regions, markers : sequence of Box
        Blinking regions, and boxes of the 2D markers.
    width, height : int
        Sensor size [px]; merged boxes are clipped to it.

    Returns
    -------
    list of (Box, int or None)
        The boxes to decode, each with the index of its 2D marker: first one for each marker, then the regions that
        overlap no marker, with None.

    Examples
    --------
    >>> merge_boxes([Box(10, 10, 5, 5), Box(50, 50, 4, 4)], [Box(8, 8, 10, 10)], 100, 100)
    [(Box(x=8, y=8, w=10, h=10), 0), (Box(x=50, y=50, w=4, h=4), None)]
    """
    touched = [[region.overlaps(marker) for marker in markers] for region in regions]
    merged: list[tuple[Box, int | None]] = []
    for m, marker in enumerate(markers):
        box = marker
        for region, touches in zip(regions, touched, strict=True):
            if touches[m] and sum(touches) == 1 and region.area <= MERGE_AREA * marker.area:
                box = box.union(region)
        merged.append((box.clipped(width, height), m))
    return merged + [(region, None) for region, touches in zip(regions, touched, strict=True) if not any(touches)]


def keep_larger(first: Sequence[Box], second: Sequence[Box]) -> list[Box]:
    """Join two lists of boxes; where a box of one list overlaps a box of the other, keep the larger one.

    Parameters
    ----------
    first, second : sequence of Box
        Of two boxes with equal areas, the one of `second` is kept.

    Returns
    -------
    list of Box
        The boxes of `first` that are kept, then those of `second`.

    Examples
    --------
    >>> keep_larger([Box(10, 10, 3, 3)], [Box(9, 9, 6, 6), Box(200, 9, 5, 5)])
    [Box(x=9, y=9, w=6, h=6), Box(x=200, y=9, w=5, h=5)]
    """

    def hides(box: Box, other: Box) -> bool:
        return box.overlaps(other) and box.area >= other.area

    kept = [box for box in first if not any(hides(other, box) for other in second)]
    return kept + [box for box in second if not any(hides(other, box) for other in kept)]


def overlapping_groups(boxes: Sequence[Box]) -> list[tuple[Box, list[int]]]:
    """Group boxes until the hulls of no two groups overlap.

    Parameters
    ----------
    boxes : sequence of Box
        Empty boxes belong to no group.

    Returns
    -------
    list of (Box, list of int)
        The hull of each group, and the indices of its members in rising order.

    Examples
    --------
    >>> overlapping_groups([Box(0, 0, 4, 4), Box(9, 0, 2, 2), Box(3, 3, 2, 2)])
    [(Box(x=9, y=0, w=2, h=2), [1]), (Box(x=0, y=0, w=5, h=5), [0, 2])]
    """
    groups: list[tuple[Box, list[int]]] = []
    for i, box in enumerate(boxes):
        if box.is_empty:
            continue
        members = [i]
        while touching := [group for group in groups if group[0].overlaps(box)]:
            for group in touching:
                box, members = box.union(group[0]), group[1] + members
                groups.remove(group)
        groups.append((box, sorted(members)))
    return groups
