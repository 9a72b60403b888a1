"""Candidates of the calibration: values of the free constants, how they are drawn, and the scene that has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from bicode_lab.camera import Scene
from bicode_lab.constants import all_constants, constant
from bicode_studies.paper_experiments.variants import with_pattern

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Values of the constants that are fitted to Fig. 8; `constants.csv` says what each of them means."""

    led_to_ambient: float
    blur_px: float
    halo_fraction: float
    time_constant_us: float
    aruco_id: int
    min_region_pixels: int


WHOLE = ("aruco_id", "min_region_pixels")  # whole numbers
NAMES = tuple(field.name for field in fields(Candidate))
EARLIER = tuple(
    Candidate(**dict(zip(NAMES, values, strict=True)))  # type: ignore[arg-type]
    for values in (
        (1.45, 0.87, 0.02, 314.0, 17, 15), (1.34, 0.584, 0.05, 361.0, 12, 11),
        (1.39, 0.649, 0.0344, 375.0, 19, 11), (1.21, 0.716, 0.05, 202.0, 24, 11),
    )
)  # fmt: skip
"""The best candidate of each pattern in an earlier search."""


def candidate_in_use() -> Candidate:
    """Return the candidate with the values of `constants.csv`."""
    return candidate_of({name: constant(name) for name in NAMES})


def candidate_of(values: Mapping[str, float]) -> Candidate:
    """Make a candidate from the values of its constants.

    Parameters
    ----------
    values : mapping of str to float
        At least the constants of `NAMES`; other keys are left out.

    Returns
    -------
    Candidate
        Whole constants are rounded, the others have three significant digits.
    """
    kept = {name: round(values[name]) if name in WHOLE else float(f"{values[name]:.3g}") for name in NAMES}
    return Candidate(**kept)  # type: ignore[arg-type]


def draw_candidates(n: int, rng: np.random.Generator) -> list[Candidate]:
    """Draw `n` candidates; each constant is uniformly distributed over its range in `constants.csv`.

    Parameters
    ----------
    n : int
    rng : numpy.random.Generator

    Returns
    -------
    list of Candidate
    """
    return [_candidate_at(rng.random(len(NAMES))) for _ in range(n)]


def draw_neighbours(candidate: Candidate, n: int, rng: np.random.Generator) -> list[Candidate]:
    """Draw `n` variations of a candidate.

    Pattern and minimum region size stay the same. Each other constant is moved by a normally distributed amount with
    a standard deviation of a tenth of its range, and stays within the range.

    Parameters
    ----------
    candidate : Candidate
    n : int
    rng : numpy.random.Generator

    Returns
    -------
    list of Candidate
    """
    low, high = _ranges()
    held = (np.array([getattr(candidate, name) for name in NAMES], float) - low) / (high - low)
    moved = np.clip(held + 0.1 * rng.standard_normal((n, held.size)), 0, 1)
    kept = {name: getattr(candidate, name) for name in WHOLE}
    return [replace(_candidate_at(shares), **kept) for shares in moved]


def _ranges() -> tuple[Floats, Floats]:
    """Return the ends of each constant's range, shape (constants,); whole ones are widened by one half."""
    half = np.array([0.5 if name in WHOLE else 0.0 for name in NAMES])
    low, high = np.array([(all_constants()[name].low, all_constants()[name].high) for name in NAMES]).T
    return low - half, high + half


def _candidate_at(shares: Floats) -> Candidate:
    """Return the candidate whose constants lie at these shares, 0 .. 1, of their ranges."""
    low, high = _ranges()
    return candidate_of(dict(zip(NAMES, (low + shares * (high - low)).tolist(), strict=True)))


def candidate_scene(scene: Scene, candidate: Candidate, size_px: tuple[int, int]) -> Scene:
    """Return a scene with the constants of a candidate and another sensor size.

    Parameters
    ----------
    scene : Scene
        Of one marker.
    candidate : Candidate
        Its minimum region size belongs to the receiver and is not used.
    size_px : tuple of int
        Width and height of the sensor [px].

    Returns
    -------
    Scene
    """
    return replace(
        with_pattern(scene, candidate.aruco_id),
        light=replace(scene.light, led_to_ambient=candidate.led_to_ambient),
        optics=replace(
            scene.optics, blur_px=candidate.blur_px, halo_fraction=candidate.halo_fraction,
            width=size_px[0], height=size_px[1],
        ),
        pixel_model=replace(scene.pixel_model, time_constant_us=candidate.time_constant_us),
    )  # fmt: skip
