"""IV-A: how often is it right?   sightings, truth -> right or wrong, period by period

Accuracy is the number of periods read right over all periods; a period with no reading
is wrong. The ID of a marker is right where every checked packet that was read at its
place in the period holds its payload. The 2D marker is right where its id was found
with its corners in place and its axes pointing the right way; the paper's authors
judged those by eye, here they are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from bicode_lab.camera.truth import MarkerTruth
from bicode_lab.recognition import Sighting

CORNER_PX = 2.0  # corners may be off by this much (root mean square over the four) ...
CORNER_SHARE = 0.05  # ... or by this share of the marker's side, whichever is more
AXIS_DEG = 30.0  # an axis drawn within this angle of the true one looks right
PLACE_PX = 4.0  # a sighting belongs to a marker if its middle lies in the marker's box, widened by this


@dataclass(frozen=True, kw_only=True)
class Periods:
    """The periods to judge: ``start_us + k * length_us`` for k = 0 .. count - 1, each with its 2D frame."""

    start_us: int
    count: int
    length_us: int = 33_000
    frame_2d_us: int = 13_200


def score(sightings: Iterable[Sighting], truth: Callable[[float], list[MarkerTruth]], periods: Periods) -> pd.DataFrame:
    """Sightings and truth in, one row for each period and marker in view out.

    Parameters
    ----------
    sightings : iterable of Sighting
    truth : callable
        A moment [us] in, every marker's truth then out; see `camera.truth_at`.
    periods : Periods

    Returns
    -------
    DataFrame
        ``period``, ``marker`` (its number in the scene), ``payload``; ``id_right``, ``marker_2d_right``
        (bool); ``ids`` (tuple of the IDs read there); ``corner_px`` (root mean square corner error, nan
        where the 2D marker was not found), ``axis_deg`` (worst axis error), ``tvec_m`` (position error).
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
    """True where the middle of the sighting lies on the marker."""
    left, top, width, height = truth.box_px
    x, y = sighting.x + (sighting.w - 1) / 2, sighting.y + (sighting.h - 1) / 2
    return bool(left - PLACE_PX <= x <= left + width + PLACE_PX and top - PLACE_PX <= y <= top + height + PLACE_PX)


def _judge(here: list[Sighting], middle: MarkerTruth, frame: MarkerTruth) -> dict[str, object]:
    """One marker in one period: its sightings in, what was right of them out."""
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
    """A 2D reading and the truth in; corner error [px], worst axis error [deg] and position error [m] out."""
    off = np.asarray(sighting.corners, float) - truth.corners_px
    corner_px = float(np.sqrt((off**2).sum(1).mean()))
    seen = Rotation.from_rotvec(np.asarray(sighting.rvec, float).reshape(3)).as_matrix()
    between = seen.T @ truth.pose.rotation
    axis_deg = float(np.rad2deg(np.arccos(np.clip(np.diag(between), -1, 1))).max())
    tvec_m = float(np.linalg.norm(np.asarray(sighting.tvec, float) - truth.pose.position_m))
    return corner_px, axis_deg, tvec_m
