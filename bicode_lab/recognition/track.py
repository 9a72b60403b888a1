"""Follow regions from period to period (Fig. 2, second half of box f).

The method is SORT (Bewley et al. 2016). Each track is a Kalman filter over seven numbers: the centre x, y, the area and
the aspect ratio of a box, and the speeds of the first three. Predictions and new regions are matched by their
intersection over union (IoU) with the Hungarian method.

This differs from the usual settings in three ways:

- min_hits is 1: a track is reported from its first period, because the decoder decides by itself whether a region is a
  marker. Waiting for three hits in a row would report it in only two of three periods.
- max_age is 5 periods, not 1: a track continues while its marker is hidden or too faint for a moment.
- Boxes are padded by PAD_PX on all sides before the IoU is computed. The box of a marker that is 4 px wide changes by a
  pixel from period to period, which halves the IoU without padding.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from bicode_lab.boxes import iou

PAD_PX = 4.0

Array = npt.NDArray[np.float64]

# State: x, y, area, aspect ratio, and the speeds of x, y, area per period. The noise is that of SORT, except for the
# speeds: within a period of 33 ms a marker may start to move at full speed.
MOTION = np.eye(7) + np.eye(7, k=4)
MEASURED = np.eye(4, 7)
MOTION_NOISE = np.diag([1.0, 1.0, 1.0, 0.01, 0.1, 0.1, 0.01])
START_COVARIANCE = np.diag([10.0, 10.0, 10.0, 10.0, 1e4, 1e4, 1e4])
MEASURED_NOISE = np.diag([1.0, 1.0, 10.0, 10.0])


class Track:
    """A region that is followed over periods: a constant-velocity Kalman filter with seven states.

    Parameters
    ----------
    number : int
        Number of the track, which no other track of the stream has.
    box : sequence of 4 numbers
        x, y, w, h of its first region [px].

    Attributes
    ----------
    age : int
        Number of periods since the region was last seen.
    state : ndarray, shape (7,)
        Centre x, y [px], area [px^2], aspect ratio w / h; speeds of x, y [px per period] and area [px^2 per period].
    covariance : ndarray, shape (7, 7)
        Covariance of the state.
    """

    def __init__(self, number: int, box: Sequence[float]) -> None:
        self.number = number
        self.age = 0
        self.state = np.concatenate([_to_measurement(box), np.zeros(3)])
        self.covariance = START_COVARIANCE.copy()

    def predict(self) -> Array:
        """Advance the track by one period.

        Returns
        -------
        ndarray, shape (4,)
            Predicted box x, y, w, h [px].
        """
        if self.state[2] + self.state[6] <= 0:
            self.state[6] = 0.0  # the area stays above 0
        self.state = MOTION @ self.state
        self.covariance = MOTION @ self.covariance @ MOTION.T + MOTION_NOISE
        self.age += 1
        return self.box()

    def update(self, box: Sequence[float]) -> None:
        """Correct the track with the region that was found.

        Parameters
        ----------
        box : sequence of 4 numbers
            x, y, w, h of the region [px].
        """
        innovation = _to_measurement(box) - MEASURED @ self.state
        spread = MEASURED @ self.covariance @ MEASURED.T + MEASURED_NOISE
        gain = np.linalg.solve(spread, MEASURED @ self.covariance).T
        self.state = self.state + gain @ innovation
        self.covariance = (np.eye(7) - gain @ MEASURED) @ self.covariance
        self.age = 0

    def box(self) -> Array:
        """Return the filtered box x, y, w, h [px], shape (4,)."""
        x, y, area, aspect = self.state[:4]
        w = float(np.sqrt(max(area, 1e-6) * max(aspect, 1e-6)))
        h = max(area, 1e-6) / w
        return np.array([x - w / 2, y - h / 2, w, h])


class Tracker:
    """All tracks of a stream.

    Parameters
    ----------
    max_age : int
        Number of periods that a track survives without a region.
    min_iou : float
        Least intersection over union of padded boxes for a match, 0 .. 1.

    Attributes
    ----------
    tracks : list of Track
        The tracks that are alive.
    """

    def __init__(self, max_age: int = 5, min_iou: float = 0.1) -> None:
        self.max_age = max_age
        self.min_iou = min_iou
        self.tracks: list[Track] = []
        self._next_number = 1

    def update(self, boxes: Sequence[Sequence[float]]) -> list[Track]:
        """Match the boxes of one period with the tracks; a box without a match starts a track.

        Parameters
        ----------
        boxes : sequence of (x, y, w, h)
            Regions of the period [px].

        Returns
        -------
        list of Track
            The track of each box, in the order of the boxes.
        """
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
        """Let `n_periods` periods without any region pass."""
        for _ in range(min(n_periods, self.max_age + 1)):
            self.update([])


def _to_measurement(box: Sequence[float]) -> Array:
    """Return the centre x, y, the area and the aspect ratio of a box x, y, w, h."""
    x, y, w, h = (float(value) for value in box)
    return np.array([x + w / 2, y + h / 2, w * h, w / h])
