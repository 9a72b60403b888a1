"""Fig. 2 f, second half: which region is which, period after period?   regions -> tracks

SORT (Bewley et al. 2016): each track is a Kalman filter over seven numbers, a box's centre
x, y, area and aspect ratio and the speeds of the first three; predictions and new regions
are matched by overlap (IoU) with the Hungarian method.

Where this differs from the stock settings, and why:

- min_hits is 1: the decoder judges by itself whether a region is a marker, so a track is
  reported from its first period. Waiting for three hits in a row reports it in two of three.
- max_age is 5 periods, not 1: a track outlives its marker being hidden, or too faint for a moment.
- Boxes are padded by PAD_PX on all sides before the overlap is taken. The box of a marker
  4 px wide changes by a pixel from period to period, which halves its IoU; padded, it does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from bicode_lab.boxes import iou

PAD_PX = 4.0

Array = npt.NDArray[np.float64]

# State: x, y, area, aspect, and speeds of x, y, area, per period. SORT's own noise levels,
# but for the speeds: a period is 33 ms, in which a marker may be set in motion at once.
MOTION = np.eye(7) + np.eye(7, k=4)
MEASURED = np.eye(4, 7)
MOTION_NOISE = np.diag([1.0, 1.0, 1.0, 0.01, 0.1, 0.1, 0.01])
START_COVARIANCE = np.diag([10.0, 10.0, 10.0, 10.0, 1e4, 1e4, 1e4])
MEASURED_NOISE = np.diag([1.0, 1.0, 10.0, 10.0])


class Track:
    """One region followed over periods: a 7-state constant-velocity Kalman filter.

    Parameters
    ----------
    number : int
        The track's name, never used twice.
    box : sequence of 4 numbers
        x, y, w, h of its first region [px].
    """

    def __init__(self, number: int, box: Sequence[float]) -> None:
        self.number = number
        self.age = 0  # periods since it was last seen
        self.hits = 1
        self.state = np.concatenate([_to_measurement(box), np.zeros(3)])
        self.covariance = START_COVARIANCE.copy()

    def predict(self) -> Array:
        """One period goes by; the box where the region should be now out, x y w h [px]."""
        if self.state[2] + self.state[6] <= 0:
            self.state[6] = 0.0  # an area does not shrink below nothing
        self.state = MOTION @ self.state
        self.covariance = MOTION @ self.covariance @ MOTION.T + MOTION_NOISE
        self.age += 1
        return self.box()

    def update(self, box: Sequence[float]) -> None:
        """The region that was found in."""
        innovation = _to_measurement(box) - MEASURED @ self.state
        spread = MEASURED @ self.covariance @ MEASURED.T + MEASURED_NOISE
        gain = np.linalg.solve(spread, MEASURED @ self.covariance).T
        self.state = self.state + gain @ innovation
        self.covariance = (np.eye(7) - gain @ MEASURED) @ self.covariance
        self.age = 0
        self.hits += 1

    def box(self) -> Array:
        """Nothing in, the filtered box out, x y w h [px]."""
        x, y, area, aspect = self.state[:4]
        w = float(np.sqrt(max(area, 1e-6) * max(aspect, 1e-6)))
        h = max(area, 1e-6) / w
        return np.array([x - w / 2, y - h / 2, w, h])


class Tracker:
    """All tracks of a stream.

    Parameters
    ----------
    max_age : int
        Periods a track survives without a region.
    min_iou : float
        Least overlap of padded boxes for a match, 0 .. 1.
    """

    def __init__(self, max_age: int = 5, min_iou: float = 0.1) -> None:
        self.max_age = max_age
        self.min_iou = min_iou
        self.tracks: list[Track] = []
        self._next_number = 1

    def update(self, boxes: Sequence[Sequence[float]]) -> list[Track]:
        """The boxes of one period in, x y w h [px]; the track of each box, in the same order, out."""
        predicted = [track.predict() for track in self.tracks]
        found: dict[int, Track] = {}
        if predicted and len(boxes):
            overlap = iou(np.array(boxes, float), np.array(predicted), PAD_PX)
            for i, j in zip(*linear_sum_assignment(-overlap), strict=True):
                if overlap[i, j] >= self.min_iou:
                    self.tracks[j].update(boxes[i])
                    found[int(i)] = self.tracks[j]
        for i in range(len(boxes)):
            if i not in found:
                found[i] = Track(self._next_number, boxes[i])
                self._next_number += 1
                self.tracks.append(found[i])
        self.tracks = [track for track in self.tracks if track.age <= self.max_age]
        return [found[i] for i in range(len(boxes))]

    def skip(self, n_periods: int) -> None:
        """A number of periods without any region in; their time goes by."""
        for _ in range(min(n_periods, self.max_age + 1)):
            self.update([])


def _to_measurement(box: Sequence[float]) -> Array:
    """A box x y w h in; its centre, area and aspect ratio out."""
    x, y, w, h = (float(value) for value in box)
    return np.array([x + w / 2, y + h / 2, w * h, w / h])
