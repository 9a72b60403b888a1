"""Fit a plate's pose to its lock-in image: Levenberg and Marquardt's method from one start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from bicode_lab.pose.light_model import N_IMAGE, N_POSE, draw
from bicode_lab.pose.response import N_ALL, N_LIGHT, LightPriors, expected, normal_equations

Floats = npt.NDArray[np.float64]

MOST_TURN_RAD, MOST_SHIFT = (
    0.35,
    1.0,
)  # of one step; the shift is in cells along the face, in tenths of the depth along z
LEAST_GAIN = 0.01  # a fit ends once a step improves the cost by less than this ...
ENOUGH_STEPS = 2  # ... so many times in a row ...
MOST_DAMPING = 1e4  # ... or once even steps as short as this makes them do not improve it
LIGHT_LIMITS = np.array(
    [[-4.0, 4.0], [0.05, 1.0], [0.0, 0.8], [-5.5, -1.5], [-1.2, 1.6], [0.0, 0.3], [0.0, 3.0], [0.0, 3.0]]
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """A lock-in image that poses are fitted to, and what is known of camera and plate.

    Parameters
    ----------
    seen, variance : ndarray of float64, shape (h, w)
        Lock-in image and variance of each pixel.
    x, y : int
        The first pixel.
    step_px : int
        Distance between the pixels; above 1 where a near plate is seen with fewer pixels.
    camera : ndarray, shape (3,)
        Focal length and principal point x, y [px].
    cells : ndarray of float64, shape (n, n)
        Which cells glow.
    thickness : float
        Of the plate [cells].
    priors : LightPriors
    """

    seen: Floats
    variance: Floats
    x: int
    y: int
    step_px: int
    camera: Floats
    cells: Floats
    thickness: float
    priors: LightPriors


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A pose and the light that fit a look.

    Parameters
    ----------
    rotation : ndarray, shape (3, 3)
        From plate axes to camera axes.
    place : ndarray, shape (3,)
        Middle of the face in camera axes [cells].
    light : ndarray, shape (N_LIGHT,)
        Nuisance parameters, see `response.normal_equations`.
    cost : float
        Half the weighted sum of squares; infinite where the plate cannot be drawn.
    matrix : ndarray, shape (N_ALL, N_ALL)
        Of the normal equations at this pose: the inverse is the covariance of turns [rad] and shifts [cells] in the
        plate's own axes and of the nuisance parameters.
    """

    rotation: Floats
    place: Floats
    light: Floats
    cost: float
    matrix: Floats


def fit_pose(
    look: Look, rotation: Floats, place: Floats, light: Floats, most_steps: int, keep: Sequence[int] = ()
) -> Fit:
    """Fit pose and light from one start.

    Parameters
    ----------
    look : Look
    rotation, place, light : ndarray
        The start, see `Fit`.
    most_steps : int
        Largest number of steps.
    keep : sequence of int
        Parameters that stay as they are: 0 and 1 are the turns that tilt the plate, `N_POSE` and more the light.

    Returns
    -------
    Fit
        At least as good as the start.
    """
    image = np.empty((*look.seen.shape, N_IMAGE))
    halo = halo_of(look, rotation, place)
    priors = look.priors.table()
    best = _equations(look, rotation, place, light, image, halo, priors)
    damping, idle = 1e-2, 0
    for _ in range(most_steps):
        fit, vector = best
        damped = fit.matrix + damping * np.diag(np.diag(fit.matrix)) + 1e-12 * np.eye(N_ALL)
        free = np.ones(N_ALL, np.bool_)
        low, high = LIGHT_LIMITS.T  # a parameter at its limit stays there while the slope leads outwards
        free[N_POSE:] = ~((fit.light <= low) & (vector[N_POSE:] < 0) | (fit.light >= high) & (vector[N_POSE:] > 0))
        free[list(keep)] = False
        step = np.zeros(N_ALL)
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], vector[free])
        moved = _moved(fit, step)
        tried = _equations(look, *moved, image, halo, priors)
        gain = fit.cost - tried[0].cost
        if gain > 0:
            best, damping = tried, max(damping * 0.2, 1e-5)
            idle = idle + 1 if gain < LEAST_GAIN else 0
        else:
            damping *= 6
        if idle >= ENOUGH_STEPS or damping > MOST_DAMPING:
            break
    return best[0]


def model_image(look: Look, fit: Fit) -> tuple[Floats, Floats]:
    """Return the lock-in image that a fit expects and its doubt, see `response.respond`, each of shape (h, w).

    The doubt is that of the usual softness, as a softness that fits badly must not be excused by it.
    """
    image = np.empty((*look.seen.shape, N_IMAGE))
    _draw(look, fit.rotation, fit.place, fit.light, False, image)
    out, doubt, halo = np.empty(look.seen.shape), np.empty(look.seen.shape), halo_of(look, fit.rotation, fit.place)
    usual = fit.light.copy()
    usual[3] = look.priors.log_softness[0]
    expected(image, halo, usual, out, doubt)
    expected(image, halo, fit.light, out, np.empty_like(doubt))
    return out, doubt


def halo_of(look: Look, rotation: Floats, place: Floats) -> Floats:
    """Return the image of a plate blurred by the halo; it changes little while a fit goes on.

    Parameters
    ----------
    look : Look
    rotation, place : ndarray
        See `Fit`.

    Returns
    -------
    ndarray, shape (h, w)
        Share of the face's luminance.
    """
    rows, columns = (_between(size, look.step_px, look.priors.halo_px) for size in look.seen.shape)
    coarse_px = look.step_px * _coarse(look.step_px, look.priors.halo_px)
    image = np.empty((rows.shape[1], columns.shape[1], N_IMAGE))
    n = look.cells.shape[0]
    even = np.full((1, 1), look.cells.mean())
    # The halo is much wider than a cell: one square with the mean glow will do, in units of the plate's side.
    draw(rotation, place / n, look.camera, look.x, look.y, coarse_px, look.priors.halo_px, even, 1e-6, np.zeros(2),
         False, image)  # fmt: skip
    return np.ascontiguousarray(rows @ image[:, :, 0] @ columns.T)


def _coarse(step_px: int, halo_px: float) -> int:
    """Return how many pixels of a look lie between two at which the halo is drawn: a third of the halo's size."""
    return max(1, int(halo_px / (3 * step_px)))


def _between(size: int, step_px: int, halo_px: float) -> Floats:
    """Return the matrix that interpolates between the pixels at which the halo is drawn, shape (size, fewer)."""
    every = _coarse(step_px, halo_px)
    at = np.arange(size) / every
    left = np.floor(at).astype(int)
    matrix = np.zeros((size, left[-1] + 2))
    matrix[np.arange(size), left] = 1 - (at - left)
    matrix[np.arange(size), left + 1] = at - left
    return matrix


def _draw(look: Look, rotation: Floats, place: Floats, light: Floats, slopes: bool, image: Floats) -> None:
    """Draw the plate on the pixels of a look."""
    draw(rotation, place, look.camera, look.x, look.y, look.step_px, float(np.exp(light[4])), look.cells,
         look.thickness, light[6:8], slopes, image)  # fmt: skip


def _equations(
    look: Look, rotation: Floats, place: Floats, light: Floats, image: Floats, halo: Floats, priors: Floats
) -> tuple[Fit, Floats]:
    """Return a fit with its cost and matrix, and the vector of its normal equations."""
    matrix, vector = np.empty((N_ALL, N_ALL)), np.empty(N_ALL)
    cost = np.inf
    if place[2] > 0 and (rotation.T @ place)[2] < 0:  # the face is seen from its front
        _draw(look, rotation, place, light, True, image)
        cost = normal_equations(image, halo, look.seen, look.variance, light, priors, matrix, vector)
    return Fit(rotation=rotation, place=place, light=light, cost=cost, matrix=matrix), vector


def _moved(fit: Fit, step: Floats) -> tuple[Floats, Floats, Floats]:
    """Return pose and light after a step; a step that is too long is shortened."""
    depth = float(fit.place[2])
    size = max(
        float(np.abs(step[:3]).max()) / MOST_TURN_RAD,
        float(np.abs(step[3:5]).max()) / MOST_SHIFT,
        abs(float(step[5])) / (0.1 * depth),
        1.0,
    )
    step = step / size
    rotation = fit.rotation @ np.asarray(cv2.Rodrigues(step[:3].copy())[0], np.float64)
    place = fit.place + fit.rotation @ step[3:N_POSE]
    light = np.clip(fit.light + step[N_POSE:], LIGHT_LIMITS[:, 0], LIGHT_LIMITS[:, 1])
    return rotation, place, light


def start_light(priors: LightPriors) -> Floats:
    """Return the nuisance parameters to start with, shape (N_LIGHT,)."""
    light = priors.table()[:, 0].copy()
    assert light.size == N_LIGHT
    return light
