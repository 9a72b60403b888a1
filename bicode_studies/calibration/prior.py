"""The prior of the fitted constants: what is known of each of them before Fig. 8 and the measurements are looked at.

The ends of each distribution are the range in `constants.csv`, whose column ``source`` says where they come from; the
shapes are here. Between the ends,

    uniform       all values are alike
    log-uniform   all factors are alike: only the order of magnitude is known
    normal        middle and standard deviation are known
    log-normal    middle and its factor of uncertainty are known

A constant with a factor is handled as its logarithm. The least region is handled as a number with decimals, which is
rounded where it is used; so `Prior` has coordinates, which are numbers, and categories, which are names without an
order. All categories of a kind are alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.constants import all_constants
from bicode_studies.calibration.candidates import Candidate, candidate_of

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """The prior of one number: a normal distribution that is cut at both ends, or a uniform one.

    Attributes
    ----------
    low, high : float
        Ends.
    middle, spread : float
        Mean and standard deviation of the normal distribution before it is cut; an infinite spread is uniform.
    """

    low: float
    high: float
    middle: float = 0.0
    spread: float = np.inf


@dataclass(frozen=True, eq=False)
class Points:
    """Some points of a prior's space.

    Attributes
    ----------
    x : ndarray, shape (n, coordinates)
    k : ndarray of int, shape (n, categories)
        Number of the category of each kind, from 0.
    """

    x: Floats
    k: Ints

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: npt.NDArray[np.bool_] | Ints) -> Points:
        """Return the points of some rows."""
        return Points(self.x[rows], self.k[rows])


@dataclass(frozen=True, kw_only=True)
class Prior:
    """A distribution of independent coordinates and categories.

    Attributes
    ----------
    coordinates : tuple of Coordinate
    categories : tuple of int
        Number of categories of each kind; all have the same probability.
    """

    coordinates: tuple[Coordinate, ...]
    categories: tuple[int, ...] = ()

    def draw(self, n: int, rng: np.random.Generator) -> Points:
        """Draw `n` points."""
        x = np.empty((n, len(self.coordinates)))
        for column, one in enumerate(self.coordinates):
            x[:, column] = _drawn(one, n, rng)
        return Points(x, rng.integers(0, self.categories, (n, len(self.categories))))

    def log_density(self, x: Floats) -> Floats:
        """Return the logarithm of the density of coordinates, up to a constant.

        Parameters
        ----------
        x : ndarray, shape (n, coordinates)

        Returns
        -------
        ndarray, shape (n,)
            Minus infinity outside the ends.
        """
        low, high, middle, spread = np.array([(c.low, c.high, c.middle, c.spread) for c in self.coordinates]).T
        log = -0.5 * (((x - middle) / spread) ** 2).sum(axis=1)
        return np.asarray(np.where(((x >= low) & (x <= high)).all(axis=1), log, -np.inf))


def _drawn(one: Coordinate, n: int, rng: np.random.Generator) -> Floats:
    """Draw `n` values of a coordinate; those beyond an end are drawn again."""
    if np.isinf(one.spread):
        return rng.uniform(one.low, one.high, n)
    values = rng.normal(one.middle, one.spread, n)
    while (outside := (values < one.low) | (values > one.high)).any():
        values[outside] = rng.normal(one.middle, one.spread, int(outside.sum()))
    return values


SHAPES: dict[str, tuple[str, float, float]] = {
    "led_to_ambient": ("log-uniform", 0, 0),
    "blur_px": ("log-uniform", 0, 0),
    "halo_fraction": ("uniform", 0, 0),
    "time_constant_us": ("log-uniform", 0, 0),
    "threshold": ("normal", 0.25, 0.05),
    "threshold_spread": ("log-normal", 0.03, 1.5),
    "noise": ("log-uniform", 0, 0),
    "refractory_us": ("log-uniform", 0, 0),
    "min_region_pixels": ("uniform", 0, 0),
}
"""Shape, middle, and standard deviation (of a log-normal one: the factor that is one standard deviation)."""
OPENINGS_PX = (0, 2, 3, 4, 5)  # 1 is no opening, as 0 is
PATTERNS = 50  # of DICT_4X4_50


def prior_of_constants() -> Prior:
    """Return the prior of the fitted constants; its coordinates are in the order of `SHAPES`.

    Returns
    -------
    Prior
        Its kinds of categories are the openings of `OPENINGS_PX` and the patterns.
    """
    return Prior(
        coordinates=tuple(_coordinate(name) for name in SHAPES), categories=(len(OPENINGS_PX), PATTERNS)
    )  # fmt: skip


def _coordinate(name: str) -> Coordinate:
    """Return the prior of a constant."""
    shape, middle, spread = SHAPES[name]
    ends = np.array([all_constants()[name].low, all_constants()[name].high])
    if name == "min_region_pixels":
        ends += (-0.499, 0.499)  # so that each whole number has the same share
    if shape.startswith("log-"):
        ends = np.log(ends)
    if shape.endswith("uniform"):
        return Coordinate(low=ends[0], high=ends[1])
    if shape == "log-normal":
        middle, spread = float(np.log(middle)), float(np.log(spread))
    return Coordinate(low=ends[0], high=ends[1], middle=middle, spread=spread)


def candidates_at(points: Points) -> list[Candidate]:
    """Return the candidates at some points of the prior of the constants.

    Parameters
    ----------
    points : Points

    Returns
    -------
    list of Candidate
    """
    found = []
    for x, (opening, pattern) in zip(points.x, points.k, strict=True):
        values = {
            name: float(np.exp(value)) if shape.startswith("log-") else float(value)
            for (name, (shape, *_)), value in zip(SHAPES.items(), x, strict=True)
        }
        found.append(candidate_of({**values, "opening_px": OPENINGS_PX[opening], "aruco_id": int(pattern)}))
    return found


def prior_table(n: int) -> pd.DataFrame:
    """Draw `n` sets from the prior, the same every time; one row for each, with the constants as columns."""
    points = prior_of_constants().draw(n, np.random.default_rng(0))
    return pd.DataFrame([vars(candidate) for candidate in candidates_at(points)])
