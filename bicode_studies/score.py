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

import cv2
import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.stats import binomtest

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


def accuracy(right: npt.ArrayLike) -> tuple[float, float, float]:
    """Right or wrong, one for each period, in; accuracy and its 95 % Wilson interval out.

    The interval takes the periods as independent; those of one recording are not, so
    accuracies over several seeds take theirs over the seeds.

    Examples
    --------
    >>> tuple(round(v, 3) for v in accuracy([True] * 9 + [False]))
    (0.9, 0.596, 0.982)
    """
    values = np.asarray(right, bool)
    if not values.size:
        raise ValueError("no period to judge; record for longer than one period")
    result = binomtest(int(values.sum()), values.size)
    interval = result.proportion_ci(0.95, method="wilson")
    return float(result.statistic), float(interval.low), float(interval.high)


def bootstrap(
    shares: npt.NDArray[np.float64], n_periods: int, rng: np.random.Generator, n: int = 2000
) -> tuple[float, float]:
    """One share a seed and the number of all periods in, the 95 % interval of their mean, drawn over seeds, out.

    Where all seeds have the same share, one seed among them, there is nothing to draw from; then it is Wilson's
    interval over the periods, which takes them as independent.
    """
    if (shares == shares[0]).all():
        share, weight = shares[0], 1.96**2 / (n_periods + 1.96**2)
        middle = share + (0.5 - share) * weight
        half = 1.96 * np.sqrt(share * (1 - share) * n_periods + 1.96**2 / 4) / (n_periods + 1.96**2)
        return max(0.0, float(middle - half)), min(1.0, float(middle + half))
    means = rng.choice(shares, (n, shares.size)).mean(axis=1)
    return float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


def over_seeds(
    table: pd.DataFrame, by: list[str], right: str = "id_right", rng: np.random.Generator | None = None
) -> pd.DataFrame:
    """Rows of trials in, a row for each of their conditions out: the accuracy and its 95 % interval over seeds.

    Parameters
    ----------
    table : DataFrame
        A row for each trial: the columns of `by`, ``periods``, and that of `right`, a count of right periods.
    by : list of str
        Columns that tell conditions apart.
    right : str
    rng : numpy.random.Generator, optional
        Of the bootstrap; without it the same draws every time.

    Returns
    -------
    DataFrame
        The columns of `by`; ``seeds`` and ``periods`` (counts), ``accuracy``, the mean of the seeds' shares,
        ``low`` and ``high``.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    seen = table[table["periods"] > 0]
    rows = []
    for key, group in seen.groupby(by, sort=False, dropna=False):
        shares = (group[right] / group["periods"]).to_numpy(float)
        periods = int(group["periods"].sum())
        low, high = bootstrap(shares, periods, rng)
        told = {"seeds": shares.size, "periods": periods, "accuracy": shares.mean(), "low": low, "high": high}
        rows.append({**dict(zip(by, key, strict=True)), **told})
    return pd.DataFrame(rows, columns=[*by, "seeds", "periods", "accuracy", "low", "high"])


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
    between = rotation_of(np.asarray(sighting.rvec, float)).T @ truth.pose.rotation
    axis_deg = float(np.rad2deg(np.arccos(np.clip(np.diag(between), -1, 1))).max())
    tvec_m = float(np.linalg.norm(np.asarray(sighting.tvec, float) - truth.pose.position_m))
    return corner_px, axis_deg, tvec_m


def rotation_of(rvec: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """OpenCV's axis times angle [rad], shape (3,), in; the rotation matrix out.

    Examples
    --------
    >>> bool(np.allclose(rotation_of(np.array([np.pi, 0, 0])), np.diag([1, -1, -1])))
    True
    """
    return np.asarray(cv2.Rodrigues(rvec.reshape(3))[0], np.float64)
