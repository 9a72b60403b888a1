"""Candidates of the calibration: a set of values of the fitted constants, and the scene and receiver that have them."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace

from bicode_lab.camera import Scene
from bicode_lab.constants import all_constants, constant
from bicode_lab.recognition import ReceiverSettings
from bicode_studies.paper_experiments.variants import with_pattern


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Values of the constants that are fitted; `constants.csv` says what each of them means."""

    led_to_ambient: float
    blur_px: float
    halo_fraction: float
    time_constant_us: float
    threshold: float
    threshold_spread: float
    noise: float
    refractory_us: float
    min_region_pixels: int
    opening_px: int
    aruco_id: int


NOT_IN_FIG_8 = ("edge_glow", "infrared_share_office", "infrared_share_evening", "processing_mev_per_s")
"""Constants that Fig. 8 does not determine; each is fitted to another claim, see `other_claims`."""
WHOLE = ("min_region_pixels", "opening_px", "aruco_id")  # whole numbers
NAMES = tuple(field.name for field in fields(Candidate))


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


def other_constants(replaced: Collection[str]) -> str:
    """Return the constants that are not replaced, as JSON of their values by name, so that trials are kept under them.

    Parameters
    ----------
    replaced : collection of str
        Names of constants.

    Returns
    -------
    str
    """
    return json.dumps({name: one.value for name, one in all_constants().items() if name not in replaced})


def candidate_scene(scene: Scene, candidate: Candidate, size_px: tuple[int, int] | None = None) -> Scene:
    """Return a scene of one marker with the constants of a candidate.

    Parameters
    ----------
    scene : Scene
        Of one marker.
    candidate : Candidate
        Its opening and its least region belong to the receiver and are not used.
    size_px : tuple of int, optional
        Width and height of the sensor [px]; None keeps those of the scene.

    Returns
    -------
    Scene
    """
    width, height = size_px or (scene.optics.width, scene.optics.height)
    bright = candidate.led_to_ambient
    return replace(
        with_pattern(scene, candidate.aruco_id),
        light=replace(scene.light, led_to_ambient=bright, infrared_led_to_ambient=bright),
        optics=replace(
            scene.optics, blur_px=candidate.blur_px, halo_fraction=candidate.halo_fraction, width=width, height=height
        ),
        pixel_model=replace(
            scene.pixel_model, time_constant_us=candidate.time_constant_us, noise=candidate.noise,
            threshold_on=candidate.threshold, threshold_off=candidate.threshold,
            threshold_spread=candidate.threshold_spread, refractory_us=candidate.refractory_us,
        ),
    )  # fmt: skip


def candidate_receiver(settings: ReceiverSettings, candidate: Candidate) -> ReceiverSettings:
    """Return the settings of a receiver with the opening and the least region of a candidate.

    Parameters
    ----------
    settings : ReceiverSettings
    candidate : Candidate

    Returns
    -------
    ReceiverSettings
    """
    return replace(settings, opening_px=candidate.opening_px, min_region_pixels=candidate.min_region_pixels)
