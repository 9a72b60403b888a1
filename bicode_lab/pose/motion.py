"""The motion of a plate in the image over one period, and its events taken back to one moment.

All of a plate lights up at each edge of its LED, so the middle of the events shortly behind an edge is the middle of
the pattern's light at that moment. A turn in the plane moves this middle around the point that the plate turns about.
The turning rate is searched on a grid: the right one makes the picture of the events, taken back, sharpest. Then pivot,
velocity and the middle's distance from the pivot follow from the middles by least squares,

    middle(t) = pivot + velocity t + R(rate t) offset,

and velocity and rate are refined by sharpness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from bicode_lab.kernels import njit

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

LEAST_EVENTS = 6  # of an edge whose middle is used
FEWEST_EDGES = 4
MOST_RATE = 330.0  # 3,150 revolutions a minute [rad/s]
STEP_PX = 0.7  # between two rates of the grid, at the border of the plate and the ends of the period
MOST_EVENTS = 6000  # events whose picture is judged
OFFSET_PENALTY = 1.0  # the middle of the light is about this far from the pivot [px]
MIDDLE_PX = 0.3  # and the middle of an edge's events is known to about this


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageMotion:
    """The motion of a plate in the image.

    Parameters
    ----------
    t_us : float
        The moment that events are taken back to [us].
    pivot_px : ndarray, shape (2,)
        Point about which the plate turns, at this moment [px].
    velocity : ndarray, shape (2,)
        [px/s]
    rate : float
        Turning rate in the image, from x (right) to y (down) [rad/s].
    """

    t_us: float
    pivot_px: Floats
    velocity: Floats
    rate: float

    def taken_back(self, x: Floats, y: Floats, t_us: Floats) -> tuple[Floats, Floats]:
        """Return where points of the plate that are seen at other moments are at `t_us`.

        Parameters
        ----------
        x, y : ndarray, shape (n,)
            [px]
        t_us : ndarray, shape (n,)
            [us]

        Returns
        -------
        x, y : ndarray, shape (n,)
            [px]
        """
        dt = (t_us - self.t_us) * 1e-6
        u, v = x - self.pivot_px[0] - self.velocity[0] * dt, y - self.pivot_px[1] - self.velocity[1] * dt
        c, s = np.cos(self.rate * dt), np.sin(self.rate * dt)
        return c * u + s * v + self.pivot_px[0], -s * u + c * v + self.pivot_px[1]


def find_motion(x: Floats, y: Floats, t: Floats, edge: Ints, t_us: float) -> ImageMotion | None:
    """Find the motion of a plate from the events that follow the edges of its LED.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Places of events shortly behind an edge of their polarity [px].
    t : ndarray, shape (n,)
        Their times, the usual latency taken off [us].
    edge : ndarray of int64, shape (n,)
        Number of the edge that each follows.
    t_us : float
        The moment to take events back to [us].

    Returns
    -------
    ImageMotion or None
        None where fewer than `FEWEST_EDGES` edges have events enough.
    """
    middles = _middles(x, y, t, edge)
    if len(middles) < FEWEST_EDGES:
        return None
    motion = _line(middles, t_us, 0.0)
    keep = _near(x, y, t, motion)
    some = np.flatnonzero(keep)
    if some.size > MOST_EVENTS:
        some = some[np.linspace(0, some.size - 1, MOST_EVENTS).astype(int)]
    x, y, t = x[some], y[some], t[some]
    u, v = motion.taken_back(x, y, t)
    radius = max(1.0, float(np.sqrt(2 * (u.var() + v.var()))))
    step = STEP_PX / radius / max(float(np.ptp(t)) * 0.5e-6, 1e-4)
    n = int(np.ceil(MOST_RATE / step))
    rates = np.arange(-n, n + 1) * step
    scores = [_sharpness(x, y, t, _line(middles, t_us, float(rate))) for rate in rates]
    start = _line(middles, t_us, float(rates[int(np.argmax(scores))]))
    return _refined(x, y, t, start, radius, step)


def _middles(x: Floats, y: Floats, t: Floats, edge: Ints) -> Floats:
    """Return time and middle of the events of each edge, shape (m, 3) [us, px]; events far off do not count."""
    rows = []
    for number in np.unique(edge):
        mine = edge == number
        if mine.sum() < LEAST_EVENTS:
            continue
        far = np.hypot(x[mine] - np.median(x[mine]), y[mine] - np.median(y[mine]))
        near = far <= 2.5 * max(float(np.median(far)), 1.0)
        rows.append((t[mine][near].mean(), x[mine][near].mean(), y[mine][near].mean()))
    return np.array(rows, np.float64).reshape(-1, 3)


def _line(middles: Floats, t_us: float, rate: float) -> ImageMotion:
    """Fit pivot, velocity and offset to the middles, for a turning rate; edges far off count less."""
    dt = (middles[:, 0] - t_us) * 1e-6
    scale = max(float(np.abs(dt).max()), 1e-6)
    one, none = np.ones_like(dt), np.zeros_like(dt)
    c, s = np.cos(rate * dt), np.sin(rate * dt)
    rows = np.concatenate(
        [np.stack([one, none, dt / scale, none, c, -s], 1), np.stack([none, one, none, dt / scale, s, c], 1)]
    )
    seen = np.concatenate([middles[:, 1], middles[:, 2]])
    prior = np.zeros((2, 6))
    prior[0, 4] = prior[1, 5] = MIDDLE_PX / OFFSET_PENALTY
    weight = np.ones_like(seen)
    values = np.zeros(6)
    for _ in range(4):
        values = np.linalg.lstsq(
            np.concatenate([rows * weight[:, None], prior]), np.concatenate([seen * weight, [0, 0]]), rcond=None
        )[0]
        off = np.abs(seen - rows @ values)
        limit = max(2.5 * float(np.median(off)), MIDDLE_PX)
        weight = np.sqrt(limit / np.maximum(off, limit))
    return ImageMotion(t_us=t_us, pivot_px=values[:2], velocity=values[2:4] / scale, rate=rate)


def _near(x: Floats, y: Floats, t: Floats, motion: ImageMotion) -> npt.NDArray[np.bool_]:
    """Return which events lie on the plate, judged by their distance from the pivot."""
    u, v = motion.taken_back(x, y, t)
    far = np.hypot(u - motion.pivot_px[0], v - motion.pivot_px[1])
    return np.asarray(far <= 2.5 * max(float(np.median(far)), 1.0))


def _refined(x: Floats, y: Floats, t: Floats, start: ImageMotion, radius: float, step: float) -> ImageMotion:
    """Refine velocity and rate by sharpness."""
    half_s = max(float(np.ptp(t)) * 0.5e-6, 1e-4)

    def moved(by: Floats) -> ImageMotion:
        shift = by[:2] / half_s
        return ImageMotion(
            t_us=start.t_us, pivot_px=start.pivot_px, velocity=start.velocity + shift, rate=start.rate + by[2] * step
        )

    simplex = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.7]], float)
    best = minimize(
        lambda by: -_sharpness(x, y, t, moved(by)), np.zeros(3), method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 60, "xatol": 0.02, "fatol": 1e-4},
    )  # fmt: skip
    return moved(np.asarray(best.x, np.float64))


def _sharpness(x: Floats, y: Floats, t: Floats, motion: ImageMotion) -> float:
    """Return how sharp the picture of the events is, taken back: the mean count where an event lands."""
    u, v = motion.taken_back(x, y, t)
    return float(_mean_count(u - motion.pivot_px[0], v - motion.pivot_px[1]))


@njit(cache=True)
def _mean_count(u: Floats, v: Floats) -> float:
    """Return the mean square of a picture whose events are shared between their four nearest pixels."""
    size = 257
    picture = np.zeros((size, size))
    for i in range(u.size):
        x, y = u[i] + size // 2, v[i] + size // 2
        if not (0 <= x < size - 1 and 0 <= y < size - 1):
            continue
        column, row = int(x), int(y)
        a, b = x - column, y - row
        picture[row, column] += (1 - a) * (1 - b)
        picture[row, column + 1] += a * (1 - b)
        picture[row + 1, column] += (1 - a) * b
        picture[row + 1, column + 1] += a * b
    # A blur makes the measure nearly the same wherever in a pixel an event lands.
    total = 0.0
    for row in range(1, size - 1):
        for column in range(1, size - 1):
            m = picture[row, column]
            if m > 0:
                around = picture[row - 1, column] + picture[row + 1, column] + picture[row, column - 1]
                blurred = 0.5 * m + 0.125 * (around + picture[row, column + 1])
                total += blurred * blurred
    return total / max(u.size, 1)
