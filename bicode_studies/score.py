"""Score sightings against the truth: which periods have the right ID and the right 2D marker (IV-A).

Accuracy is the number of right periods over the number of all periods; a period without a reading is wrong. The ID of a
marker is right if all packets with a right checksum that were read at its place in the period hold its payload. The 2D
marker is right if its pattern was found with the corners in place and the axes pointing the right way. The paper's
authors judged corners and axes by eye; here they are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from bicode_lab import paper
from bicode_lab.camera import MarkerTruth
from bicode_lab.recognition import Sighting

CORNER_PX = 2.0  # largest error of corners that are right (root mean square over the four) ...
CORNER_SHARE = 0.05  # ... or this share of the marker's side, whichever is more
AXIS_DEG = 30.0  # an axis drawn within this angle of the true one looks right
PLACE_PX = 4.0  # a sighting belongs to a marker if its middle lies in the marker's box, widened by this on each side


@dataclass(frozen=True, kw_only=True)
class Periods:
    """The periods that are judged: period k starts at ``start_us + k * length_us``, for k = 0 .. count - 1.

    Attributes
    ----------
    start_us : int
        Start of the first period [us].
    count : int
        Number of periods.
    length_us : int
        Length of a period, delta_t_whole [us].
    frame_2d_us : int
        Length of the 2D frame at the start of each period, delta_t_2D [us].
    """

    start_us: int
    count: int
    length_us: int = paper.DELTA_T_WHOLE_US
    frame_2d_us: int = paper.DELTA_T_2D_US


def score(sightings: Iterable[Sighting], truth: Callable[[float], list[MarkerTruth]], periods: Periods) -> pd.DataFrame:
    """Judge each period and each marker in view.

    An ID is compared with the truth in the middle of the period, a 2D marker with the truth in the middle of its frame.

    Parameters
    ----------
    sightings : iterable of Sighting
        In any order; those outside the periods are left out.
    truth : callable
        Takes a time [us] and returns the truth of every marker of the scene at that time, see `camera.truth_at`.
    periods : Periods
        The periods that are judged.

    Returns
    -------
    DataFrame
        One row for each period and each marker that is in view in its middle: ``period``; ``marker`` (its number in the
        scene); ``payload``; ``id_right`` and ``marker_2d_right`` (bool); ``ids`` (tuple of the IDs read at its place,
        rising); ``corner_px`` (root mean square error of the corners [px]), ``axis_deg`` (largest error of an axis
        [deg]) and ``tvec_m`` (error of the position [m]), all nan where the 2D marker was not found.
    """
    found: dict[int, list[Sighting]] = {}
    for sighting in sightings:
        found.setdefault((sighting.t_us - periods.start_us) // periods.length_us, []).append(sighting)
    rows = []
    for k in range(periods.count):
        start = periods.start_us + k * periods.length_us
        middles = truth(start + periods.length_us / 2)
        frames = truth(start + periods.frame_2d_us / 2)
        for number, (middle, frame) in enumerate(zip(middles, frames, strict=True)):
            if middle.in_view:
                here = [s for s in found.get(k, []) if _is_at(s, middle)]
                rows.append({"period": k, "marker": number, "payload": middle.payload, **_judge(here, middle, frame)})
    return pd.DataFrame(rows)


def _is_at(sighting: Sighting, truth: MarkerTruth) -> bool:
    """Return whether the middle of the sighting's box lies on the marker."""
    left, top, width, height = truth.box_px
    x, y = sighting.x + (sighting.w - 1) / 2, sighting.y + (sighting.h - 1) / 2
    return bool(left - PLACE_PX <= x <= left + width + PLACE_PX and top - PLACE_PX <= y <= top + height + PLACE_PX)


def _judge(here: list[Sighting], middle: MarkerTruth, frame: MarkerTruth) -> dict[str, object]:
    """Judge the sightings at one marker in one period."""
    ids = {s.id for s in here if s.id is not None}
    conflict = any(s.reason == "conflict" for s in here)
    errors = [_errors_2d(s, frame) for s in here if s.marker_2d_id == frame.aruco_id and s.corners is not None]
    corner_px, axis_deg, tvec_m = min(errors, default=(np.nan, np.nan, np.nan))
    side_px = float(np.linalg.norm(np.diff(frame.corners_px[[0, 1]], axis=0)))
    return {
        "id_right": ids == {middle.payload} and not conflict,
        "ids": tuple(sorted(ids)),
        "marker_2d_right": bool(corner_px <= max(CORNER_PX, CORNER_SHARE * side_px) and axis_deg <= AXIS_DEG),
        "corner_px": corner_px,
        "axis_deg": axis_deg,
        "tvec_m": tvec_m,
    }


def _errors_2d(sighting: Sighting, truth: MarkerTruth) -> tuple[float, float, float]:
    """Return the errors of a 2D marker: corners [px], worst axis [deg], position [m]."""
    off = np.asarray(sighting.corners, float) - truth.corners_px
    corner_px = float(np.sqrt((off**2).sum(1).mean()))
    seen = Rotation.from_rotvec(np.asarray(sighting.rvec, float).reshape(3)).as_matrix()
    between = seen.T @ truth.pose.rotation
    axis_deg = float(np.rad2deg(np.arccos(np.clip(np.diag(between), -1, 1))).max())
    tvec_m = float(np.linalg.norm(np.asarray(sighting.tvec, float) - truth.pose.position_m))
    return corner_px, axis_deg, tvec_m
