"""Follow regions from period to period.

A track predicts the centre of its box with a constant velocity. Boxes and predictions are matched by their distance,
with the Hungarian method. A box may lie as far from a prediction as it is large, or `REACH_PX`; so a marker that moves
by its own length in a period, and whose boxes do not overlap, keeps its track.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from bicode_lab.boxes import Box

Memory = TypeVar("Memory")

REACH_PX = 6.0
NEW_REACH = 2.0  # a new track has no velocity yet, so its reach is this many times as large
GAIN = 0.5  # weight of a new velocity against the one before
TOO_FAR = 1e6


@dataclass
class Track(Generic[Memory]):
    """A region that is followed.

    Attributes
    ----------
    number : int
        Number of the track, which no other track of the stream has.
    box : Box
        Its box in the last period in which it was found [px].
    centre, velocity : ndarray, shape (2,)
        Centre [px] and velocity [px per period].
    age : int
        Periods since it was found.
    n_found : int
        Periods in which it was found.
    memory
        What the receiver remembers of it.
    """

    number: int
    box: Box
    centre: npt.NDArray[np.float64]
    velocity: npt.NDArray[np.float64]
    memory: Memory
    age: int = 0
    n_found: int = 1

    def predicted(self) -> Box:
        """Return where its box should be in this period [px]."""
        x, y = self.centre + self.velocity * self.age
        return Box(round(x - self.box.w / 2), round(y - self.box.h / 2), self.box.w, self.box.h)

    @property
    def reach_px(self) -> float:
        """How far from the prediction its box may be found [px]."""
        return max(REACH_PX, self.box.w, self.box.h) * (NEW_REACH if self.n_found == 1 else 1.0)

    def found(self, box: Box) -> None:
        """Set the box in which it was found in this period."""
        centre = _centre(box)
        velocity = (centre - self.centre) / max(self.age, 1)
        self.velocity = velocity if self.n_found == 1 else (1 - GAIN) * self.velocity + GAIN * velocity
        self.box, self.centre, self.age = box, centre, 0
        self.n_found += 1


class Tracks(Generic[Memory]):
    """All tracks of a stream.

    Parameters
    ----------
    max_age : int
        Number of periods that a track survives without a box.
    """

    def __init__(self, max_age: int) -> None:
        self.alive: list[Track[Memory]] = []
        self._max_age = max_age
        self._next_number = 1

    def advance(self, n_periods: int) -> None:
        """Let time pass, and forget the tracks that have not been found for too long."""
        for track in self.alive:
            track.age += n_periods
        self.alive = [track for track in self.alive if track.age <= self._max_age]

    def update(self, boxes: Sequence[Box], make: Callable[[Box], Memory]) -> list[Track[Memory]]:
        """Match the boxes of a period with the tracks; a box without a match starts a track.

        Parameters
        ----------
        boxes : sequence of Box
            [px]
        make : callable
            Makes the memory of a new track from its box.

        Returns
        -------
        list of Track
            The track of each box, in the order of the boxes.
        """
        found: dict[int, Track[Memory]] = {}
        if self.alive and boxes:
            places = np.array([_centre(track.predicted()) for track in self.alive])
            distance = np.linalg.norm(np.array([_centre(box) for box in boxes])[:, None] - places[None], axis=2)
            reach = np.array([track.reach_px for track in self.alive])[None, :]
            size = np.array([max(box.w, box.h) for box in boxes])[:, None]
            cost = np.where(distance <= np.maximum(reach, size), distance, TOO_FAR)
            for i, j in zip(*linear_sum_assignment(cost), strict=True):
                if cost[i, j] < TOO_FAR:
                    self.alive[j].found(boxes[i])
                    found[int(i)] = self.alive[j]
        for i, box in enumerate(boxes):
            if i not in found:
                found[i] = Track(self._next_number, box, _centre(box), np.zeros(2), make(box))
                self._next_number += 1
                self.alive.append(found[i])
        return [found[i] for i in range(len(boxes))]


def _centre(box: Box) -> npt.NDArray[np.float64]:
    """Return the centre of a box [px]."""
    return np.array([box.x + box.w / 2, box.y + box.h / 2])
