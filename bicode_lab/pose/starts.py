"""Poses to start a fit with: from the second moments of a lock-in image and the turns of the pattern.

Seen from far, the image of a plate is its pattern under an affine map. The second moments of the image and those of
the pattern leave one angle of this map open. For each of `N_TURNS` angles the pattern is drawn and compared with the
image, and the best angles are kept. An affine map belongs to two poses, which are mirrored: tilted by the same angle
to opposite sides.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit
from bicode_lab.pose.light_model import MOST_CELLS, glow_at
from bicode_lab.pose.response import respond

Floats = npt.NDArray[np.float64]
PoseStart = tuple[Floats, Floats]  # rotation, shape (3, 3), and place [cells], shape (3,)

N_TURNS = 48
N_KEPT = 5
LEAST_EVENTS = 0.15  # events per edge; a pixel with less is dark
LEAST_PIXELS, LEAST_SPREAD = 6, 0.1  # of the lit part; the second is a determinant [px^4]
MOST_SHARE = 1.0  # of the face's luminance: no part of the plate is brighter
LEAST_TILT_DEG = 12.0  # a start that faces the camera exactly would have no slope by the tilt
FACING = np.diag([1.0, -1.0, -1.0])


def moments(image: Floats, deviation: Floats, light: Floats) -> tuple[Floats, Floats] | None:
    """Return the middle and the second moments of the light in an image.

    The share of light on each pixel is that at which the usual response gives as many events. Pixels that get less
    light than a threshold make no events, so the blurred border of the plate is cut off about where the plate ends,
    and no blur has to be taken off the moments.

    Parameters
    ----------
    image : ndarray, shape (h, w)
        Lock-in image.
    deviation : ndarray, shape (h, w)
        Standard deviation of the background in it; what lies below three times this is dark.
    light : ndarray, shape (N_LIGHT,)
        Of the usual response, see `response.respond`.

    Returns
    -------
    middle : ndarray, shape (2,)
        Column and row [px].
    spread : ndarray, shape (2, 2)
        Second moments about the middle [px^2].
    None where too few pixels are lit, or all of them on a line.
    """
    shares = np.linspace(0, MOST_SHARE, 101)
    answers = np.array([respond(share, light)[0] for share in shares])
    weight = np.where(image > np.maximum(3 * deviation, LEAST_EVENTS), np.interp(image, answers, shares), 0.0)
    total = weight.sum()
    if (weight > 0).sum() < LEAST_PIXELS:
        return None
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
    middle = np.array([(weight * columns).sum(), (weight * rows).sum()]) / total
    x, y = columns - middle[0], rows - middle[1]
    spread = np.array([[(weight * x * x).sum(), (weight * x * y).sum()], [0, (weight * y * y).sum()]]) / total
    spread[1, 0] = spread[0, 1]
    return (middle, spread) if np.linalg.det(spread) > LEAST_SPREAD else None


def pattern_moments(cells: Floats) -> tuple[Floats, Floats]:
    """Return the middle and the second moments of the light of a plate.

    Parameters
    ----------
    cells : ndarray, shape (n, n)
        Which cells glow.

    Returns
    -------
    middle : ndarray, shape (2,)
        In plate axes [cells].
    spread : ndarray, shape (2, 2)
        [cells^2].
    """
    n = cells.shape[0]
    at = np.arange(n) - (n - 1) / 2
    x, y = np.meshgrid(at, -at)
    total = cells.sum()
    middle = np.array([(cells * x).sum(), (cells * y).sum()]) / total
    x, y = x - middle[0], y - middle[1]
    spread = np.array([[(cells * x * x).sum(), (cells * x * y).sum()], [0, (cells * y * y).sum()]]) / total
    spread[1, 0] = spread[0, 1]
    return middle, spread + np.eye(2) / 12


def affine_maps(spread: Floats, pattern: Floats) -> Floats:
    """Return the maps from the plate to the image that turn one table of second moments into the other.

    Parameters
    ----------
    spread : ndarray, shape (2, 2)
        Of the image [px^2].
    pattern : ndarray, shape (2, 2)
        Of the pattern [cells^2].

    Returns
    -------
    ndarray, shape (N_TURNS, 2, 2)
        [px per cell]; y is down in the image and up on the plate.
    """
    values, axes = np.linalg.eigh(spread)
    root = axes @ np.diag(np.sqrt(values)) @ axes.T
    values, axes = np.linalg.eigh(pattern)
    back = axes @ np.diag(1 / np.sqrt(values)) @ axes.T
    turns = np.arange(N_TURNS) * (2 * np.pi / N_TURNS)
    flipped = np.array([[[np.cos(a), np.sin(a)], [np.sin(a), -np.cos(a)]] for a in turns])
    return np.asarray(root @ flipped @ back)


def poses_of(affine: Floats, middle: Floats, offset: Floats, camera: Floats) -> list[PoseStart]:
    """Return the two poses whose images an affine map describes.

    Parameters
    ----------
    affine : ndarray, shape (2, 2)
        From the plate to the image [px per cell].
    middle : ndarray, shape (2,)
        Image point [px] ...
    offset : ndarray, shape (2,)
        ... of this point of the plate [cells].
    camera : ndarray, shape (3,)
        Focal length and principal point [px].

    Returns
    -------
    list of 2 pairs
        Rotation and place [cells].
    """
    u, sizes, v = np.linalg.svd(affine @ np.diag([1.0, -1.0]))
    if np.linalg.det(u) < 0:  # both or none, as the plate is seen from its front
        u, v = u @ np.diag([1.0, -1.0]), np.diag([1.0, -1.0]) @ v
    tilt = max(math.acos(min(1.0, sizes[1] / sizes[0])), math.radians(LEAST_TILT_DEG))
    centre = middle - affine @ offset
    sight = np.array([*(centre - camera[1:]) / camera[0], 1.0])
    depth = camera[0] / sizes[0] * float(np.linalg.norm(sight[:2]) ** 2 + 1) ** 0.5
    outer, inner = np.eye(3), np.eye(3)
    outer[:2, :2], inner[:2, :2] = u, v
    look = turn_to(sight)
    found: list[PoseStart] = []
    for angle in (tilt, -tilt):
        c, s = math.cos(angle), math.sin(angle)
        about = np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])
        found.append((look @ outer @ about @ inner @ FACING, sight * depth / np.linalg.norm(sight)))
    return found


def mirrored(rotation: Floats, place: Floats) -> Floats:
    """Return the rotation with the same image, but for perspective: tilted to the other side of the line of sight."""
    look = turn_to(place)
    # Reflection of the depth of each point of the plate: the normal's part across the line of sight changes its sign.
    local = look.T @ rotation
    local = np.array([[1.0, 1, -1], [1, 1, -1], [-1, -1, 1]]) * local
    return np.asarray(look @ local)


def turn_to(place: Floats) -> Floats:
    """Return the rotation that turns the optical axis to a point by the shortest way, shape (3, 3)."""
    x, y, z = place / np.linalg.norm(place)
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])


def best_turns(
    image: Floats, middle: Floats, maps: Floats, offset: Floats, cells: Floats, blur_px: float
) -> list[tuple[int, float]]:
    """Return the maps under which the pattern looks most like the image.

    Parameters
    ----------
    image : ndarray, shape (h, w)
        Lock-in image.
    middle : ndarray, shape (2,)
        Middle of its light, column and row [px].
    maps : ndarray, shape (n, 2, 2)
        See `affine_maps`.
    offset : ndarray, shape (2,)
        Middle of the pattern's light [cells].
    cells : ndarray, shape (n, n)
        Which cells glow.
    blur_px : float
        Standard deviation of the blur [px].

    Returns
    -------
    list of (int, float)
        Index and correlation of up to `N_KEPT` maps that are better than their neighbours, the best first.
    """
    step = max(1, round(math.sqrt(image.size / 1200)))
    scores = _correlations(image, middle, np.linalg.inv(maps).astype(np.float64), offset, cells, blur_px, step)
    peaks = np.flatnonzero((scores >= np.roll(scores, 1)) & (scores > np.roll(scores, -1)))
    return [(int(k), float(scores[k])) for k in peaks[np.argsort(-scores[peaks])][:N_KEPT]]


@njit(cache=True, error_model="numpy", fastmath=True)
def _correlations(
    image: Floats, middle: Floats, back: Floats, offset: Floats, cells: Floats, blur_px: float, step: int
) -> Floats:
    """Return the correlation of the image with the pattern under each map; `back` leads from pixels to cells."""
    scores = np.zeros(back.shape[0])
    room, out = np.empty((6, MOST_CELLS)), np.empty(4)
    for k in range(back.shape[0]):
        a = back[k]
        sigma = blur_px * math.sqrt(abs(a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]))
        n = s = ss = m = mm = sm = 0.0
        for row in range(0, image.shape[0], step):
            for column in range(0, image.shape[1], step):
                x, y = column - middle[0], row - middle[1]
                u, v = a[0, 0] * x + a[0, 1] * y + offset[0], a[1, 0] * x + a[1, 1] * y + offset[1]
                glow_at(u, v, sigma, cells, room, out)
                seen, model = image[row, column], out[0]
                n += 1
                s += seen
                ss += seen * seen
                m += model
                mm += model * model
                sm += seen * model
        spread = (ss - s * s / n) * (mm - m * m / n)
        if spread > 0:
            scores[k] = (sm - s * m / n) / math.sqrt(spread)
    return scores
