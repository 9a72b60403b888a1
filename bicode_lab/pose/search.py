"""Search all poses that explain a lock-in image: from every start, the mirrored pose, and the pair that is one pose.

The variance of a pixel has four parts: the background that was subtracted, a floor `FLOOR` for what the light model
leaves out, and two parts that differing thresholds and the grid of whole events make and that time does not average
out,

    STEP_SHARE doubt + (THRESHOLD_SHARE y)^2

at y events per edge. The last two are multiplied by a factor that is estimated from the residuals, since the spread
of thresholds and the noise differ between sensors.

Near facing, the light tells the angle of the tilt only weakly, and the two mirrored poses are the two ends of one
hill of the likelihood. `_barrier` is how much the cost rises between them. Below `LEAST_BARRIER` they are taken as
one pose: their mean, with the distance between them in its covariance. Up to `CLEAR_BARRIER` each keeps its pose, and
its covariance is widened until the pose between them is as improbable by it as by the cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.pose.fit import Fit, Look, fit_pose, model_image
from bicode_lab.pose.light_model import N_POSE
from bicode_lab.pose.response import N_ALL
from bicode_lab.pose.starts import PoseStart, mirrored

Floats = npt.NDArray[np.float64]

FLOOR = 0.05  # events per edge
STEP_SHARE, THRESHOLD_SHARE = 0.24, 0.05
FIRST_PIXELS = 30.0  # the residuals of so many pixels weigh as much as the factor 1 that is expected
LEAST_FACTOR, MOST_SQUARE = 0.3, 16.0  # limits of that factor, and of one pixel's share in it
SHORT, LONG = 12, 40  # steps of a fit that is compared with others, and of one that is given out
WORTH_LOG_ODDS = 8.0  # poses that are less probable by this are not given out ...
WORTH_SHORT = 25.0  # ... and those that are so much worse after a short fit are not followed
NEAR_DEG = 5.0  # a start so near to a pose that was found already is not followed
SAME_DEG, SAME_DISTANCE = (
    1.0,
    2.0,
)  # fits that are nearer than one of these are the same; the second is Mahalanobis', squared
LEAST_BARRIER, CLEAR_BARRIER = 3.5, 8.0
TILT = (0, 1)  # parameters of a fit
SLOW_LIGHT = tuple(range(N_POSE + 1, N_ALL))  # everything about the light but its brightness
MOST_TURN_DEG = 60.0  # mirrored poses farther apart are never one pose


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """A pose that explains a look.

    Parameters
    ----------
    rotation, place : ndarray
        See `fit.Fit`.
    covariance : ndarray, shape (6, 6)
        Of a small turn and a small shift of the plate in camera axes [rad, cells].
    cost : float
        Half the weighted sum of squares.
    """

    rotation: Floats
    place: Floats
    covariance: Floats
    cost: float


def search(look: Look, starts: Sequence[PoseStart], light: Floats) -> list[Solution]:
    """Fit poses from all starts, and the mirrored ones.

    Parameters
    ----------
    look : Look
        With the variance of the background; the other parts are added here.
    starts : sequence of (rotation, place)
    light : ndarray
        Nuisance parameters to start with.

    Returns
    -------
    list of Solution
        The best first; empty if no start leads to a plate in front of the camera.
    """
    rough = replace(look, variance=look.variance + _rough_variance(look.seen))
    fits = [fit_pose(rough, *start, light, SHORT, SLOW_LIGHT) for start in starts]
    fits = sorted((fit for fit in fits if np.isfinite(fit.cost)), key=lambda fit: fit.cost)
    if not fits:
        return []
    best, exact = fits[0], rough
    for _ in range(2):
        exact = replace(look, variance=variance_of(look, best))
        best = fit_pose(exact, best.rotation, best.place, best.light, LONG)
    exact = replace(look, variance=variance_of(look, best))
    followed = [best, *(fit for fit in fits[1:] if fit.cost < fits[0].cost + WORTH_SHORT)]
    done: list[Fit] = []
    for fit in followed:
        if any(_deg(fit.rotation, other.rotation) < NEAR_DEG for other in done):
            continue
        _follow(exact, fit.rotation, fit, done)
        _follow(exact, mirrored(done[-1].rotation, done[-1].place), done[-1], done)
    done.sort(key=lambda fit: fit.cost)
    return _merged(exact, _different([fit for fit in done if fit.cost < done[0].cost + WORTH_LOG_ODDS]))


def variance_of(look: Look, fit: Fit) -> Floats:
    """Return the variance of each pixel, with a factor estimated from the residuals of a fit.

    Parameters
    ----------
    look : Look
        With the variance of the background.
    fit : Fit

    Returns
    -------
    ndarray, shape (h, w)
        [events per edge, squared]
    """
    model, doubt = model_image(look, fit)
    known = look.variance + FLOOR**2
    part = STEP_SHARE * doubt + (THRESHOLD_SHARE * model) ** 2
    # Pixels count as much as they tell about the place of the plate: those on the borders of cells.
    rows, columns = np.gradient(model)
    weight = (rows**2 + columns**2) / (part + known) * (part > known)
    square = np.minimum((look.seen - model) ** 2 / (part + known), MOST_SQUARE)
    total = max(float(weight.sum()), 1e-9)
    pixels = max(total**2 / max(float((weight**2).sum()), 1e-18) - N_POSE, 0.0)
    mean = max(float((weight * square).sum()) / total, LEAST_FACTOR)
    factor = (FIRST_PIXELS + pixels * mean) / (FIRST_PIXELS + pixels)
    return np.asarray(known + factor * part)


def _rough_variance(seen: Floats) -> Floats:
    """Return the variance of each pixel before there is a fit."""
    smooth = np.clip(cv2.GaussianBlur(seen, (0, 0), 1.0), 0, None)
    return np.asarray(FLOOR**2 + STEP_SHARE * smooth / (smooth + 0.5) + (THRESHOLD_SHARE * smooth) ** 2)


def _follow(look: Look, rotation: Floats, fit: Fit, done: list[Fit]) -> None:
    """Fit from a rotation and the place and light of another fit, and keep the result."""
    done.append(fit_pose(look, rotation, fit.place, fit.light, LONG))


def _deg(first: Floats, second: Floats) -> float:
    """Return the angle between two rotations [deg]."""
    return float(np.degrees(np.linalg.norm(_turn(first, second))))


def _turn(first: Floats, second: Floats) -> Floats:
    """Return the rotation vector that leads from one rotation to another, in the axes of the first [rad]."""
    return np.asarray(cv2.Rodrigues(first.T @ second)[0], np.float64).ravel()


def _apart(first: Fit, second: Fit) -> Floats:
    """Return turn and shift that lead from one fit to another, in camera axes, shape (6,) [rad, cells]."""
    turn = first.rotation @ _turn(first.rotation, second.rotation)
    return np.concatenate([turn, second.place - first.place])


def _different(fits: list[Fit]) -> list[Fit]:
    """Return the fits without those that are the same as a better one."""
    kept: list[Fit] = []
    for fit in fits:
        for other in kept:
            apart = _apart(other, fit)
            near = apart @ np.linalg.solve(_covariance(other), apart) < SAME_DISTANCE
            if near or np.degrees(np.linalg.norm(apart[:3])) < SAME_DEG:
                break
        else:
            kept.append(fit)
    return kept


def _merged(look: Look, fits: list[Fit]) -> list[Solution]:
    """Return solutions; fits without a barrier between them are one."""
    groups: list[list[Fit]] = []
    wider: dict[int, Floats] = {}
    for fit in fits:
        for group in groups:
            apart = _apart(group[0], fit)
            if np.degrees(np.linalg.norm(apart[:3])) > MOST_TURN_DEG:
                continue
            barrier = _barrier(look, group[0], fit)
            if barrier < LEAST_BARRIER:
                group.append(fit)
                break
            if barrier < CLEAR_BARRIER:
                for each in (group[0], fit):
                    wider[id(each)] = _widened(_covariance(each), apart / 2, barrier)
        else:
            groups.append([fit])
    for group in groups:
        if len(group) == 1 and id(group[0]) not in wider:  # its mirrored start led back to it, or away
            wider[id(group[0])] = _towards_facing(look, group)
    return [_together(group, [wider.get(id(fit), _covariance(fit)) for fit in group]) for group in groups]


def _towards_facing(look: Look, group: list[Fit]) -> Floats:
    """Return the covariance of a group's only fit, where a plate that faces the camera may explain the look as well.

    If it does, the mirrored pose is added to the group, although it is no solution of its own.
    """
    fit = group[0]
    opposite = replace(fit, rotation=mirrored(fit.rotation, fit.place))
    apart = _apart(fit, opposite)
    if np.degrees(np.linalg.norm(apart[:3])) > MOST_TURN_DEG:
        return _covariance(fit)
    opposite = fit_pose(look, opposite.rotation, fit.place, fit.light, LONG, TILT)
    barrier = _barrier(look, fit, replace(opposite, cost=fit.cost))
    if barrier < LEAST_BARRIER:
        group.append(replace(opposite, matrix=fit.matrix))
        return _covariance(fit)
    return _widened(_covariance(fit), apart / 2, barrier) if barrier < CLEAR_BARRIER else _covariance(fit)


def _barrier(look: Look, first: Fit, second: Fit) -> float:
    """Return how much the cost of the worse fit rises on the way to the other one, with the tilt in the middle."""
    turn = _turn(first.rotation, second.rotation)
    middle = first.rotation @ np.asarray(cv2.Rodrigues(turn / 2)[0], np.float64)
    place, light = (first.place + second.place) / 2, (first.light + second.light) / 2
    return fit_pose(look, middle, place, light, LONG, TILT).cost - second.cost


def _widened(covariance: Floats, way: Floats, barrier: float) -> Floats:
    """Return a covariance by which the end of a way is no more improbable than its barrier says."""
    distance = float(way @ np.linalg.solve(covariance, way))
    return covariance + np.outer(way, way) * max(0.0, 1 / (2 * barrier) - 1 / distance)


def _together(group: list[Fit], covariances: list[Floats]) -> Solution:
    """Return fits as one solution: mean and covariance of their mixture."""
    best = group[0]
    odds = np.exp([best.cost - fit.cost for fit in group])
    share = odds / odds.sum()
    ways = np.array([_apart(best, fit) for fit in group])
    mean = share @ ways
    spread = sum(s * (c + np.outer(w - mean, w - mean)) for s, c, w in zip(share, covariances, ways, strict=True))
    rotation = np.asarray(cv2.Rodrigues(mean[:3].copy())[0], np.float64) @ best.rotation
    cost = best.cost - float(np.log(odds.sum()))
    return Solution(rotation=rotation, place=best.place + mean[3:], covariance=np.asarray(spread), cost=cost)


def _covariance(fit: Fit) -> Floats:
    """Return the covariance of a fit's pose in camera axes [rad, cells]."""
    own = np.linalg.inv(fit.matrix)[:N_POSE, :N_POSE]
    axes = np.zeros((N_POSE, N_POSE))
    axes[:3, :3] = axes[3:, 3:] = fit.rotation
    return np.asarray(axes @ own @ axes.T)
