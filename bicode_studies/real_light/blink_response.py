"""Simulate how many events one blink of an LED makes, as a function of the blink rate, and compare with a measurement.

The measurement was made by others with an EVK4 camera that looked at ultraviolet LEDs from 1 to 5 m away, blinking 5
to 15,000 times per second. Their LEDs and their room are not those of the paper. So two parameters of the *scene* are
unknown: the brightness of the LED, and how much other light passes the ultraviolet lens. The camera is the one of
`constants.csv`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import nnls
from tqdm import tqdm

from bicode_lab.camera import Light, Optics, PixelModel, Pose, Recorder, Scene, Still
from bicode_lab.camera.lamp import Flicker, Lamp
from bicode_lab.camera.optics import ambient_signal

BLINK_HZ = (5.0, 12.5, 25.0, 50.0, 125.0, 250.0, 500.0, 1250.0, 2500.0, 5000.0, 10_000.0, 15_000.0)
DISTANCES_M = (*(round(1 + 0.2 * k, 1) for k in range(11)), 4.0, 5.0)  # of the measurement, as its report states
FOCAL_LENGTH_MM, F_NUMBER = 2.5, 1.6  # of the lens of the measurement
LED_SIDE_M = 0.01  # two LEDs side by side; assumption
SENSOR_PX = 72  # side of a square that holds the light with its halo
SETTLE_TIME_CONSTANTS = 6  # with the LED off; events before this time are not counted
COUNT_S = 0.04  # time in which events are counted; at least one blink
MIN_EVENTS = 0.5  # per blink; fewer are noise in the measurement and in the simulation

WHERE_FROM = (
    "The table is evk4_events_per_blink.npz: mean events per blink (avg_events_array_0, 13 distances x 12 rates), of "
    "github.com/kubakubakuba/mrs-uvdar-distance-estimator. Put it into the folder of recordings."
)
"""Where to get the measured table."""


@dataclass(frozen=True, kw_only=True)
class Beacon:
    """A blinking LED that is on for half of each period, and the light around it.

    Parameters
    ----------
    brightness : float
        Brightness of the LED's face relative to a wall of the paper's office, both seen through this lens.
    illuminance_lux : float
        Illuminance of the surroundings as far as it passes the lens [lx]; the paper's office has 350.
    distance_m : float
        Distance from the camera [m].
    """

    brightness: float = 10.0
    illuminance_lux: float = 350.0
    distance_m: float = 1.0

    def scene(self, blink_hz: float, pixel_model: PixelModel) -> Scene:
        """Return the scene of the LED; all its events come from the LED.

        Parameters
        ----------
        blink_hz : float
            Blink rate [Hz].
        pixel_model : PixelModel
            The camera's pixels; their background activity and hot pixels are switched off.

        Returns
        -------
        Scene
        """
        lamp = Lamp(
            flicker=Flicker(rate_hz=blink_hz, shape="square", depth=1.0, duty=0.5),
            path=Still(Pose.facing(self.distance_m)),
            width_m=LED_SIDE_M, height_m=LED_SIDE_M, brightness=self.brightness,
        )  # fmt: skip
        optics = Optics(width=SENSOR_PX, height=SENSOR_PX, focal_length_mm=FOCAL_LENGTH_MM, f_number=F_NUMBER)
        return Scene(
            markers=(), lamps=(lamp,), optics=optics, light=Light(illuminance_lux=self.illuminance_lux),
            pixel_model=replace(pixel_model, background_hz=0.0, hot_pixels=0),
        )  # fmt: skip


def events_per_blink(beacon: Beacon, blink_hz: float, pixel_model: PixelModel | None = None, seed: int = 0) -> float:
    """Return the mean number of events per blink, ON and OFF together.

    Parameters
    ----------
    beacon : Beacon
        The LED and its surroundings.
    blink_hz : float
        Blink rate [Hz].
    pixel_model : PixelModel, optional
        The camera's pixels; None takes those of `constants.csv`.
    seed : int
        Seed of all random draws.

    Returns
    -------
    float

    Examples
    --------
    >>> slow, fast = (events_per_blink(Beacon(), hz) for hz in (250, 15_000))
    >>> slow > fast > 0
    True
    """
    scene = beacon.scene(blink_hz, pixel_model or PixelModel())
    dark_s = scene.pixel_model.time_constant_us * 1e-6 / ambient_signal(scene.light, scene.optics)
    settle, count = (max(1, math.ceil(span_s * blink_hz)) for span_s in (SETTLE_TIME_CONSTANTS * dark_s, COUNT_S))
    recorder = Recorder(scene, (settle + count) / blink_hz, np.random.default_rng(seed))
    from_us = settle * 1e6 / blink_hz
    return sum(int((events["t"] >= from_us).sum()) for events in recorder) / count


def blink_curve(
    beacon: Beacon, blink_hz: Iterable[float] = BLINK_HZ, pixel_model: PixelModel | None = None, seed: int = 0
) -> pd.DataFrame:
    """Simulate the events per blink for several blink rates.

    Parameters
    ----------
    beacon, pixel_model, seed
        See `events_per_blink`.
    blink_hz : iterable of float
        Blink rates [Hz].

    Returns
    -------
    DataFrame
        One row per rate: ``blink_hz``, ``events`` (per blink) and ``per_s`` (events per second).
    """
    rates = list(blink_hz)
    events = [events_per_blink(beacon, hz, pixel_model, seed) for hz in rates]
    return pd.DataFrame({"blink_hz": rates, "events": events, "per_s": np.multiply(events, rates)})


def busiest_hz(curve: pd.DataFrame) -> float:
    """Return the blink rate with the most events per second; at higher rates the pixels cannot follow.

    Parameters
    ----------
    curve : DataFrame
        As `blink_curve` returns it.

    Returns
    -------
    float
        Blink rate [Hz].

    Examples
    --------
    >>> busiest_hz(pd.DataFrame({"blink_hz": [10.0, 100.0, 1000.0], "per_s": [500.0, 5000.0, 900.0]}))
    100.0
    """
    return float(curve["blink_hz"].to_numpy(float)[curve["per_s"].to_numpy(float).argmax()])


def slope(curve: pd.DataFrame) -> npt.NDArray[np.float64]:
    """Return the slope of a curve in double-logarithmic scale: the exponent of ``events ~ blink_hz ** slope``.

    A slope of 0 means that each blink makes all its events. A slope of -1 means that the number of events per second
    does not depend on the blink rate.

    Parameters
    ----------
    curve : DataFrame
        As `blink_curve` returns it, with n rates.

    Returns
    -------
    ndarray, shape (n - 1,)
        Slopes between successive rates.

    Examples
    --------
    >>> slope(pd.DataFrame({"blink_hz": [10.0, 100.0, 1000.0], "events": [8.0, 8.0, 0.8]})).round(2)
    array([ 0., -1.])
    """
    events = np.maximum(curve["events"].to_numpy(float), 1e-9)
    return np.asarray(np.diff(np.log(events)) / np.diff(np.log(curve["blink_hz"].to_numpy(float))) + 0.0)


def read_blink_table(path: Path) -> pd.DataFrame:
    """Read the table of the measurement, for a camera that faces the LEDs.

    Parameters
    ----------
    path : Path
        The file evk4_events_per_blink.npz.

    Returns
    -------
    DataFrame
        One row per distance and rate: ``distance_m``, ``blink_hz``, ``events`` (per blink) and ``per_s`` (events per
        second).

    Raises
    ------
    ValueError
        If the file holds another table.
    """
    shape = (len(DISTANCES_M), len(BLINK_HZ))
    with np.load(path) as arrays:
        if "avg_events_array_0" not in arrays or arrays["avg_events_array_0"].shape != shape:
            raise ValueError(f"{path.name} holds no avg_events_array_0 of {shape[0]} distances x {shape[1]} rates")
        events = arrays["avg_events_array_0"]
    distance_m, blink_hz = (grid.ravel() for grid in np.meshgrid(DISTANCES_M, BLINK_HZ, indexing="ij"))
    table = pd.DataFrame({"distance_m": distance_m, "blink_hz": blink_hz, "events": events.ravel()})
    return table.assign(per_s=table["events"] * table["blink_hz"])


def misfit_factor(events: npt.ArrayLike, measured: npt.ArrayLike) -> float:
    """Return the factor by which two curves of events per blink differ.

    It is ``exp(sqrt(mean(log(events / measured) ** 2)))``; values below `MIN_EVENTS` are set to `MIN_EVENTS`.

    Parameters
    ----------
    events, measured : array_like, shape (n,)
        Events per blink.

    Returns
    -------
    float
        Factor, 1 or more.

    Examples
    --------
    >>> round(misfit_factor([100, 20, 4], [200, 10, 8]), 3)
    2.0
    """
    ours, theirs = (np.maximum(np.asarray(values, float), MIN_EVENTS) for values in (events, measured))
    return float(np.exp(np.sqrt(np.mean(np.log(ours / theirs) ** 2))))


def fit_scene(
    measured: pd.DataFrame, brightness: Iterable[float], illuminance_lux: Iterable[float],
    pixel_model: PixelModel | None = None, seed: int = 0,
) -> pd.DataFrame:  # fmt: skip
    """Fit the unknown parameters of the scene to a curve that was measured at 1 m, by trying all combinations.

    The pixels are not fitted. The curve only depends on the ratio of their time constant to the light: three times
    the light with three times the time constant makes the same events.

    Parameters
    ----------
    measured : DataFrame
        Measured curve with ``blink_hz`` and ``events``.
    brightness, illuminance_lux : iterable of float
        Values to try for the parameters of `Beacon`.
    pixel_model, seed
        See `events_per_blink`.

    Returns
    -------
    DataFrame
        One row per combination, the best first: ``brightness``, ``illuminance_lux``, ``misfit_factor``.
    """
    rows = []
    for bright, lux in tqdm(list(product(brightness, illuminance_lux)), unit=" scenes", disable=None):
        curve = blink_curve(Beacon(brightness=bright, illuminance_lux=lux), measured["blink_hz"], pixel_model, seed)
        factor = misfit_factor(curve["events"], measured["events"])
        rows.append({"brightness": bright, "illuminance_lux": lux, "misfit_factor": factor})
    return pd.DataFrame(rows).sort_values("misfit_factor", kind="stable", ignore_index=True)


def mix_curves(curves: npt.ArrayLike, measured: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return the weights of the mixture of curves that is nearest to a measured curve.

    The mixture is ``weights @ curves``; it stands for pixels that see the LED in front of backgrounds of different
    darkness. The sum of squared relative differences is minimal, with no weight below 0.

    Parameters
    ----------
    curves : array_like, shape (n, rates)
        Events per blink.
    measured : array_like, shape (rates,)
        Measured events per blink.

    Returns
    -------
    ndarray, shape (n,)
        Weights, 0 or more.

    Examples
    --------
    >>> mix_curves([[8, 8, 1], [90, 9, 0]], [98, 17, 1]).round(2)
    array([1., 1.])
    """
    theirs = np.maximum(np.asarray(measured, float), MIN_EVENTS)
    weights, _ = nnls((np.asarray(curves, float) / theirs).T, np.ones(theirs.size))
    return np.asarray(weights)
