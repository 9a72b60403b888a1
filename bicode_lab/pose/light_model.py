"""The light of a plate on each pixel, as the receiver expects it, with its derivatives.

The receiver has a light model of its own, because it must not see the camera's. The plate is a square of n x n cells
that glow or do not, and up to two of its side faces are seen beside it. All lengths on the plate are in cells, with
the origin in the middle of the face, x to the right and y up. The lens blurs the image with a Gaussian. Blurred by an
isotropic Gaussian on the plate, a pattern of square cells has a closed form: a sum of products of normal distribution
functions,

    glow(u, v) = sum_ij c_ij (F(u - b_i) - F(u - b_i+1)) (F(v - b_j) - F(v - b_j+1)).

On a tilted plate an isotropic blur of the image is no isotropic blur of the plate. The one on the plate is as wide as
the image's along the plate's wider direction, and the rest, along the narrower direction, is added by the quadrature
of Gauss and Hermite with `TAPS` points. Second moments are exact in both directions.

A side face is thin. Seen along a direction d in plate axes, a point at the depth s below the edge of the face covers
the point of the face's plane that is shifted by q = s (d_x, d_y) / d_z, so a side face covers a strip of the width
|q| beside its edge. Its luminance relative to the face is a free parameter.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from bicode_lab.kernels import njit

Floats = npt.NDArray[np.float64]

N_POSE = 6  # three rotations and three shifts of the plate, in its own axes
N_IMAGE = 10  # planes of an image: value, derivatives of the pose, derivative of ln(blur), value of two side faces
REACH = 4.0  # the blur ends after so many standard deviations
MOST_CELLS = 16  # along a side of the plate

_STEP = 1 / 64
_GRID = np.arange(-REACH - 1, REACH + 1 + _STEP / 2, _STEP)
_NORMAL = np.array([0.5 * (1 + math.erf(x / math.sqrt(2))) for x in _GRID])
_DENSITY = np.exp(-0.5 * _GRID**2) / math.sqrt(2 * math.pi)
_HERMITE = [np.polynomial.hermite_e.hermegauss(n) for n in range(1, 6)]
TAPS = np.zeros((6, 2, 5))
"""Points and weights of the quadrature with 1 .. 5 points, by their number, in standard deviations."""
for _n, (_points, _weights) in enumerate(_HERMITE, 1):
    TAPS[_n, 0, :_n], TAPS[_n, 1, :_n] = _points, _weights / _weights.sum()
TAPS_FOR = np.array([0.02, 0.3, 0.6])
"""Shares of the variance along the narrow direction that the quadrature adds, above which 2, 3 or 5 points are used."""


@njit(cache=True, inline="always", error_model="numpy", fastmath=True)
def _normal(x: float) -> tuple[float, float]:
    """Return the distribution function and the density of the normal distribution."""
    if x <= -REACH:
        return 0.0, 0.0
    if x >= REACH:
        return 1.0, 0.0
    at = (x + REACH + 1) * 64.0
    k = int(at)
    f = at - k
    return _NORMAL[k] + f * (_NORMAL[k + 1] - _NORMAL[k]), _DENSITY[k] + f * (_DENSITY[k + 1] - _DENSITY[k])


@njit(cache=True, error_model="numpy", fastmath=True)
def _along(x: float, sigma: float, n: int, share: Floats, slope: Floats, wider: Floats) -> tuple[int, int]:
    """Fill in the weight of each cell along an axis and its derivatives by x and ln(sigma); return those reached."""
    half = 0.5 * n
    first = max(0, math.floor(x - REACH * sigma + half))
    last = min(n, math.floor(x + REACH * sigma + half) + 1)
    if first >= last:
        return 0, 0
    z = (x - (first - half)) / sigma
    f0, d0 = _normal(z)
    w0 = -z * d0
    for i in range(first, last):
        z = (x - (i + 1 - half)) / sigma
        f1, d1 = _normal(z)
        w1 = -z * d1
        share[i], slope[i], wider[i] = f0 - f1, (d0 - d1) / sigma, w0 - w1
        f0, d0, w0 = f1, d1, w1
    return first, last


@njit(cache=True, error_model="numpy", fastmath=True)
def glow_at(u: float, v: float, sigma: float, cells: Floats, room: Floats, out: Floats) -> None:
    """Fill in the blurred glow at a point of the plate: value, derivatives by u, v and ln(sigma)."""
    n = cells.shape[0]
    i0, i1 = _along(u, sigma, n, room[0], room[1], room[2])
    j0, j1 = _along(v, sigma, n, room[3], room[4], room[5])
    value = by_u = by_v = by_sigma = 0.0
    for j in range(j0, j1):
        row = n - 1 - j  # the first row of cells is at the top
        a = b = c = 0.0
        for i in range(i0, i1):
            lit = cells[row, i]
            a += lit * room[0, i]
            b += lit * room[1, i]
            c += lit * room[2, i]
        value += a * room[3, j]
        by_u += b * room[3, j]
        by_v += a * room[4, j]
        by_sigma += c * room[3, j] + a * room[5, j]
    out[0], out[1], out[2], out[3] = value, by_u, by_v, by_sigma


@njit(cache=True, error_model="numpy", fastmath=True)
def _strip(x: float, y: float, sigma: float, half: float, q: float, shift: float, out: Floats) -> None:
    """Fill in the light of the side face beside the edge in x: value, derivatives by x, y, q, shift and ln(sigma)."""
    s = 1.0 if q > 0 else -1.0
    far = min(max((s * x - half) / abs(q), 0.0), 1.0)  # the strip is a parallelogram
    z0, z1 = (s * x - half) / sigma, (s * x - half - abs(q)) / sigma
    z2, z3 = (y + half - far * shift) / sigma, (y - half - far * shift) / sigma
    f0, d0 = _normal(z0)
    f1, d1 = _normal(z1)
    f2, d2 = _normal(z2)
    f3, d3 = _normal(z3)
    a, b = f0 - f1, f2 - f3
    slope = a * (d2 - d3) / sigma
    out[0] = a * b
    out[1] = s * (d0 - d1) / sigma * b
    out[2] = slope
    out[3] = s * d1 / sigma * b
    out[4] = -far * slope
    out[5] = (z1 * d1 - z0 * d0) * b + a * (z3 * d3 - z2 * d2)
    if 0.0 < far < 1.0:
        out[1] -= slope * shift / q
        out[3] += slope * shift * far / q


@njit(cache=True, error_model="numpy", fastmath=True)
def spread_of(rotation: Floats, place: Floats, focal: float, blur: float, taps: Floats) -> tuple[float, int]:
    """Fill in offsets x, y [px] and weights of the taps; return the blur on the plate [cells] and their number."""
    z = place[2]
    x, y = place[0] / z, place[1] / z
    # Derivatives of the image point by plate coordinates at the middle of the plate [px per cell].
    a = focal / z * (rotation[0, 0] - x * rotation[2, 0])
    b = focal / z * (rotation[0, 1] - x * rotation[2, 1])
    c = focal / z * (rotation[1, 0] - y * rotation[2, 0])
    d = focal / z * (rotation[1, 1] - y * rotation[2, 1])
    xx, xy, yy = a * a + b * b, a * c + b * d, c * c + d * d
    mean, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    wide, narrow = mean + half, max(mean - half, 0.0)
    direction = 0.5 * math.atan2(2 * xy, xx - yy) + 0.5 * math.pi  # of the narrow direction
    rest = max(0.0, 1.0 - narrow / wide)
    n = 1
    if rest > TAPS_FOR[2]:
        n = 5
    elif rest > TAPS_FOR[1]:
        n = 3
    elif rest > TAPS_FOR[0]:
        n = 2
    for k in range(n):
        far = TAPS[n, 0, k] * math.sqrt(rest) * blur
        taps[k, 0], taps[k, 1], taps[k, 2] = far * math.cos(direction), far * math.sin(direction), TAPS[n, 1, k]
    return blur / math.sqrt(wide), n


@njit(cache=True, error_model="numpy", fastmath=True)
def draw(
    rotation: Floats, place: Floats, camera: Floats, x0: int, y0: int, step: int, blur: float,
    cells: Floats, thickness: float, edges: Floats, slopes: bool, image: Floats,
) -> None:  # fmt: skip
    """Draw the plate with its derivatives on the pixels of a box.

    Parameters
    ----------
    rotation, place : ndarray, shape (3, 3), (3,)
        Pose of the plate in camera axes; the place in cells.
    camera : ndarray, shape (3,)
        Focal length and principal point x, y [px].
    x0, y0, step : int
        First pixel of the box, and distance between the pixels that are drawn [px].
    blur : float
        Standard deviation of the lens's blur, the square of the pixel included [px].
    cells : ndarray, shape (n, n)
        1 where a cell glows, 0 elsewhere.
    thickness : float
        Of the plate [cells].
    edges : ndarray, shape (2,)
        Luminance of the side faces that are seen beside the edges in x and in y, relative to the face; they are part of
        the derivatives and not of the value.
    slopes : bool
        Whether to fill in more than the value.
    image : ndarray, shape (height, width, N_IMAGE)
        Filled in: the value; its derivatives by three rotations [rad] and three shifts [cells] about and along the
        plate's own axes, and by ln(blur), side faces included; the values of the two side faces at luminance 1.
    """
    taps, room, work = np.empty((5, 3)), np.empty((6, MOST_CELLS)), np.empty(10)
    sigma, n_taps = spread_of(rotation, place, camera[0], blur, taps)
    look = rotation.T @ place  # direction of sight in the middle of the plate, in plate axes
    shift = np.array([thickness * look[0] / look[2], thickness * look[1] / look[2]])  # of the back edges
    half = 0.5 * cells.shape[0]
    far_u, far_v = half + abs(shift[0]) + REACH * sigma, half + abs(shift[1]) + REACH * sigma
    sight = np.empty(3)
    image[:] = 0.0
    for row in range(image.shape[0]):
        for column in range(image.shape[1]):
            for k in range(n_taps):
                rx = (x0 + step * column + taps[k, 0] - camera[1]) / camera[0]
                ry = (y0 + step * row + taps[k, 1] - camera[2]) / camera[0]
                for m in range(3):
                    sight[m] = rotation[0, m] * rx + rotation[1, m] * ry + rotation[2, m]
                if sight[2] > -1e-6:
                    continue  # the face is seen from behind
                far = look[2] / sight[2]
                u, v = far * sight[0] - look[0], far * sight[1] - look[1]
                if abs(u) > far_u or abs(v) > far_v:
                    continue
                out, weight = image[row, column], taps[k, 2]
                glow_at(u, v, sigma, cells, room, work[:4])
                out[0] += weight * work[0]
                _add_sides(u, v, sigma, half, shift, thickness, edges, weight, work, out)
                if slopes:
                    # The offsets of the taps grow with the blur.
                    su, sv = sight[0] / sight[2], sight[1] / sight[2]
                    du = taps[k, 0] * (rotation[0, 0] - su * rotation[0, 2])
                    du += taps[k, 1] * (rotation[1, 0] - su * rotation[1, 2])
                    dv = taps[k, 0] * (rotation[0, 1] - sv * rotation[0, 2])
                    dv += taps[k, 1] * (rotation[1, 1] - sv * rotation[1, 2])
                    wider = far / camera[0] * (work[1] * du + work[2] * dv) + work[3]
                    _add_slopes(u, v, su, sv, work[1], work[2], wider, weight, out)


@njit(cache=True, error_model="numpy", fastmath=True)
def _add_sides(
    u: float, v: float, sigma: float, half: float, shift: Floats, thickness: float, edges: Floats, weight: float,
    work: Floats, out: Floats,
) -> None:  # fmt: skip
    """Add the light of the side faces to the planes of a pixel, and their slopes to `work[1:4]`."""
    qx, qy = shift[0], shift[1]
    strip = work[4:]
    for side in range(2):
        if abs(shift[side]) < 1e-9:
            continue
        edge = edges[side]
        _strip(u if side == 0 else v, v if side == 0 else u, sigma, half, shift[side], shift[1 - side], strip)
        out[8 + side] += weight * strip[0]
        work[1] += edge * strip[1 + side]
        work[2] += edge * strip[2 - side]
        work[3] += edge * strip[5]
        # As the plate turns about its axes, the direction of sight turns the other way, and the shift changes.
        by_x, by_y = (strip[3], strip[4]) if side == 0 else (strip[4], strip[3])
        out[1] += weight * edge * (by_x * qx * qy / thickness + by_y * (thickness + qy * qy / thickness))
        out[2] -= weight * edge * (by_x * (thickness + qx * qx / thickness) + by_y * qx * qy / thickness)
        out[3] += weight * edge * (by_x * qy - by_y * qx)


@njit(cache=True, inline="always", error_model="numpy", fastmath=True)
def _add_slopes(
    u: float, v: float, su: float, sv: float, by_u: float, by_v: float, wider: float, weight: float, out: Floats
) -> None:
    """Add the slopes of a point to the planes of a pixel.

    As the plate turns by w and shifts by s, a line of sight d meets it at a point that moves by -(w x u + s) + a d,
    with a such that the point stays on the plate; su and sv are d_x / d_z and d_y / d_z.
    """
    along = by_u * su + by_v * sv
    out[1] += weight * along * v
    out[2] -= weight * along * u
    out[3] += weight * (by_u * v - by_v * u)
    out[4] -= weight * by_u
    out[5] -= weight * by_v
    out[6] += weight * along
    out[7] += weight * wider
