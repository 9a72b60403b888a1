"""Evidence beyond Fig. 8: what was measured on cameras of the same kind, each as a misfit of a candidate.

The facts and their sources are in ``data/measured.csv``. A misfit z counts standard deviations; its square adds to the
distance of a candidate as in minus twice a log-likelihood.

    latency      The latency of a pixel falls as one over its light. Its slope, taken at the sensor, gives a time
                 constant for the wall of the paper's office. The source does not state the plane of its irradiance, so
                 there are two readings, see `either`.
    quiet rate   Noise alone crosses the threshold now and then (Rice's formula). No more often than a quiet part of a
                 recording has events; less often is no misfit, since events have other causes, too.
    refractory   A pixel is not held longer than the shortest intervals between events.
    blinks       How the number of events per blink falls with the blink rate. Neither the LEDs nor their room are
                 known, so contrast, light and the number of pixels are chosen for each candidate as they fit best.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.camera import PixelModel
from bicode_lab.camera.optics import REFERENCE_F_NUMBER, REFERENCE_LUX
from bicode_studies.calibration.candidates import Candidate
from bicode_studies.real_light.blink_response import F_NUMBER, MIN_EVENTS, Beacon, events_per_blink
from bicode_studies.repository import repository_root

MEASURED = "data/measured.csv"
CONTRASTS = (3.0, 10.0, 30.0, 100.0)  # of the LED over the light around it, tried for each candidate ...
DARK_US = (100.0, 300.0, 1000.0, 3000.0)  # ... with these time constants of a pixel that does not see the LED


@cache
def read_measured() -> pd.DataFrame:
    """Read the facts.

    Returns
    -------
    DataFrame
        ``quantity``, ``at`` (text), ``value``, ``unit``, ``source``.
    """
    return pd.read_csv(repository_root() / MEASURED, dtype={"at": str}, keep_default_na=False)


def measured(quantity: str, at: str = "") -> float:
    """Return a measured value.

    Parameters
    ----------
    quantity : str
    at : str
        Where a quantity has several values, which of them.

    Returns
    -------
    float
    """
    table = read_measured()
    (value,) = table.loc[(table["quantity"] == quantity) & (table["at"] == at), "value"]
    return float(value)


def either(z: float) -> float:
    """Return what a misfit adds to the distance if the source can be read in two ways, of which only one asks for it.

    Both readings have the same probability; the other one is met by every candidate.

    Parameters
    ----------
    z : float
        Misfit in the one reading, in standard deviations.

    Returns
    -------
    float
        ``-2 log(1/2 + 1/2 exp(-z^2 / 2))``, between 0 and 1.39.

    Examples
    --------
    >>> [round(either(z), 2) for z in (0.0, 1.0, 5.0)]
    [0.0, 0.44, 1.39]
    """
    return float(-2 * np.log(0.5 + 0.5 * np.exp(-0.5 * z**2))) + 0.0  # no negative zero


def implied_time_constant() -> tuple[float, float]:
    """Return the time constant that the measured latencies imply for the wall of the paper's office.

    The irradiance at the sensor is ``E = lux / efficacy * reflectance * transmittance / (4 N^2)``, and the time
    constant is the slope over E. The spread holds that of the reflectance, whose two values are taken as one standard
    deviation each way, that of reading the plots (7 %), and the difference of ON and OFF.

    Returns
    -------
    middle_us, spread : float
        Median [us], and standard deviation of its logarithm.
    """
    slopes = np.log([measured("latency_slope_on"), measured("latency_slope_off")])
    reflectances = np.log([measured("wall_reflectance", "low"), measured("wall_reflectance", "high")])
    wall = REFERENCE_LUX / measured("lamp_efficacy") * np.exp(reflectances.mean())
    sensor = wall * measured("lens_transmittance") / (4 * REFERENCE_F_NUMBER**2)
    spread = float(np.sqrt(np.ptp(reflectances) ** 2 / 4 + np.ptp(slopes) ** 2 / 4 + 0.07**2))
    return float(np.exp(slopes.mean()) / sensor), spread


def latency_misfit(candidate: Candidate) -> float:
    """Return by how many standard deviations the time constant is longer than the latencies imply; negative: shorter.

    Parameters
    ----------
    candidate : Candidate

    Returns
    -------
    float
    """
    middle_us, spread = implied_time_constant()
    return float(np.log(candidate.time_constant_us / middle_us) / spread)


def quiet_rate_hz(candidate: Candidate) -> float:
    """Return how often the noise of a pixel that sees the office's wall crosses its thresholds, mean over pixels.

    Rice's formula, ``2 B exp(-threshold^2 / (2 noise^2))`` with the bandwidth ``B = 1 / (2 pi time constant)`` and two
    thresholds, is averaged over the normally distributed thresholds.

    Parameters
    ----------
    candidate : Candidate

    Returns
    -------
    float
        Rate [Hz].
    """
    bandwidth_hz = 1e6 / (2 * np.pi * candidate.time_constant_us)
    both = candidate.noise**2 + candidate.threshold_spread**2
    share = candidate.noise / np.sqrt(both) * np.exp(-(candidate.threshold**2) / (2 * both))
    return float(2 * bandwidth_hz * share)


def quiet_misfit(candidate: Candidate) -> float:
    """Return by how many standard deviations noise makes more events than a quiet recording has; 0 for fewer.

    Parameters
    ----------
    candidate : Candidate

    Returns
    -------
    float
    """
    return _excess(max(quiet_rate_hz(candidate), 1e-300), measured("quiet_rate"), measured("quiet_rate_factor"))


def refractory_misfit(candidate: Candidate) -> float:
    """Return by how many standard deviations the refractory period is longer than its bound; 0 if it is shorter.

    Parameters
    ----------
    candidate : Candidate

    Returns
    -------
    float
    """
    return _excess(candidate.refractory_us, measured("longest_refractory"), measured("longest_refractory_factor"))


def _excess(value: float, bound: float, factor: float) -> float:
    """Return by how many factors of uncertainty a value is above a measured bound; 0 if it is not above."""
    return max(0.0, float(np.log(value / bound) / np.log(factor)))


def blink_misfit(candidate: Candidate) -> float:
    """Return by how many standard deviations the shape of the events per blink differs from the measured one.

    Parameters
    ----------
    candidate : Candidate

    Returns
    -------
    float
        Root mean square of the logarithmic difference, less its mean, over that of `blink_factor` of the table; the
        least over `CONTRASTS` and `DARK_US`.
    """
    table = read_measured()
    rows = table[table["quantity"] == "events_per_blink"]
    blinks_hz, events = rows["at"].astype(float).tolist(), rows["value"].to_numpy(float)
    pixels = PixelModel(
        threshold_on=candidate.threshold, threshold_off=candidate.threshold, noise=candidate.noise,
        threshold_spread=candidate.threshold_spread, refractory_us=candidate.refractory_us,
        time_constant_us=candidate.time_constant_us,
    )  # fmt: skip
    best = np.inf
    for contrast, dark_us in product(CONTRASTS, DARK_US):
        opening = (REFERENCE_F_NUMBER / F_NUMBER) ** 2
        lux = REFERENCE_LUX * candidate.time_constant_us / (dark_us * opening)
        beacon = Beacon(brightness=contrast * lux / REFERENCE_LUX, illuminance_lux=lux)
        ours = np.array([events_per_blink(beacon, hz, pixels) for hz in blinks_hz])
        best = min(best, shape_difference(ours, events))
    return float(best / np.log(measured("blink_factor")))


def shape_difference(ours: npt.NDArray[np.float64], theirs: npt.NDArray[np.float64]) -> float:
    """Return the standard deviation of the logarithm of the ratio of two curves.

    Parameters
    ----------
    ours, theirs : ndarray, shape (n,)
        Events per blink; fewer than `MIN_EVENTS` count as so many.

    Returns
    -------
    float
        0 where one curve is a multiple of the other.

    Examples
    --------
    >>> round(shape_difference(np.array([100.0, 20.0]), np.array([50.0, 10.0])), 6)
    0.0
    """
    ratio = np.log(np.maximum(ours, MIN_EVENTS) / np.maximum(theirs, MIN_EVENTS))
    return float(ratio.std())
