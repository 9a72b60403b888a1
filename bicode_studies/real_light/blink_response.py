"""How many events one blink makes, at any rate of blinking.   LED, camera -> events a blink

Beside it stands what others measured: an EVK4 that looks at ultraviolet LEDs from 1 to 5 m, blinking 5 to 15,000
times a second. Their LEDs and their room are not the paper's, so two numbers of the *scene* are open: how bright
an LED is, and how much light the ultraviolet lens lets in beside it. The camera is the one of `constants.csv`.
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
DISTANCES_M = (*(round(1 + 0.2 * k, 1) for k in range(11)), 4.0, 5.0)  # as their report says
FOCAL_LENGTH_MM, F_NUMBER = 2.5, 1.6  # of their lens
LED_SIDE_M = 0.01  # two LEDs side by side; assumption
SENSOR_PX = 72  # a square that holds their light, halo and all
SETTLED = 6  # time constants in the dark that are let pass first
COUNT_S = 0.04  # what is counted then; at least a blink
LEAST = 0.5  # events a blink; fewer are noise in their table as in ours

WHERE_FROM = (
    "The table is evk4_events_per_blink.npz: mean events a blink (avg_events_array_0, 13 distances x 12 rates), of "
    "github.com/kubakubakuba/mrs-uvdar-distance-estimator. Put it into the folder of recordings."
)
"""Where to get the measured table."""


@dataclass(frozen=True, kw_only=True)
class Beacon:
    """An LED that blinks, half of the time on, and what it stands in.

    Parameters
    ----------
    brightness : float
        Of the LED's face over a wall of the paper's office, both through this lens.
    illuminance_lux : float
        Of the surroundings, as the lens lets it through; the paper's office has 350.
    distance_m : float
    """

    brightness: float = 10.0
    illuminance_lux: float = 350.0
    distance_m: float = 1.0

    def scene(self, blink_hz: float, pixel_model: PixelModel) -> Scene:
        """A rate of blinking and the pixels in, what the camera looks at out; nothing fires but for the LED."""
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
    """An LED, its rate and the pixels in (None: those of `constants.csv`); mean events of a blink, ON and OFF, out.

    Examples
    --------
    >>> slow, fast = (events_per_blink(Beacon(), hz) for hz in (250, 15_000))
    >>> slow > fast > 0
    True
    """
    scene = beacon.scene(blink_hz, pixel_model or PixelModel())
    dark_s = scene.pixel_model.time_constant_us * 1e-6 / ambient_signal(scene.light, scene.optics)
    settle, count = (max(1, math.ceil(span_s * blink_hz)) for span_s in (SETTLED * dark_s, COUNT_S))
    recorder = Recorder(scene, (settle + count) / blink_hz, np.random.default_rng(seed))
    from_us = settle * 1e6 / blink_hz
    return sum(int((events["t"] >= from_us).sum()) for events in recorder) / count


def blink_curve(
    beacon: Beacon, blink_hz: Iterable[float] = BLINK_HZ, pixel_model: PixelModel | None = None, seed: int = 0
) -> pd.DataFrame:
    """An LED and rates in; ``blink_hz``, ``events`` a blink and ``per_s`` (events a second) out, a row for each."""
    rates = list(blink_hz)
    events = [events_per_blink(beacon, hz, pixel_model, seed) for hz in rates]
    return pd.DataFrame({"blink_hz": rates, "events": events, "per_s": np.multiply(events, rates)})


def busiest_hz(curve: pd.DataFrame) -> float:
    """A curve in, the rate of blinking at which a second holds the most events out: beyond, the pixels lag behind.

    Examples
    --------
    >>> busiest_hz(pd.DataFrame({"blink_hz": [10.0, 100.0, 1000.0], "per_s": [500.0, 5000.0, 900.0]}))
    100.0
    """
    return float(curve["blink_hz"].to_numpy(float)[curve["per_s"].to_numpy(float).argmax()])


def slope(curve: pd.DataFrame) -> npt.NDArray[np.float64]:
    """A curve in; between its rates, by what power of the rate the events of a blink go, out, shape (n - 1,).

    0: each blink is answered in full. -1: a second holds as many events however often the LED blinks.

    Examples
    --------
    >>> slope(pd.DataFrame({"blink_hz": [10.0, 100.0, 1000.0], "events": [8.0, 8.0, 0.8]})).round(2)
    array([ 0., -1.])
    """
    events = np.maximum(curve["events"].to_numpy(float), 1e-9)
    return np.asarray(np.diff(np.log(events)) / np.diff(np.log(curve["blink_hz"].to_numpy(float))) + 0.0)


def read_blink_table(path: Path) -> pd.DataFrame:
    """The measured file in; ``distance_m``, ``blink_hz``, ``events`` a blink and ``per_s``, facing the LEDs, out.

    Raises
    ------
    ValueError
        A file that holds another table.
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
    """Two curves of events a blink in; by what factor they differ, root mean square of the logarithm, out.

    Examples
    --------
    >>> round(misfit_factor([100, 20, 4], [200, 10, 8]), 3)
    2.0
    """
    ours, theirs = (np.maximum(np.asarray(values, float), LEAST) for values in (events, measured))
    return float(np.exp(np.sqrt(np.mean(np.log(ours / theirs) ** 2))))


def fit_scene(
    measured: pd.DataFrame, brightness: Iterable[float], illuminance_lux: Iterable[float],
    pixel_model: PixelModel | None = None, seed: int = 0,
) -> pd.DataFrame:  # fmt: skip
    """A measured curve at 1 m and values for what is open of its scene in; their misfits, the best first, out.

    The pixels are not fitted. Only the ratio of their time constant to the light is in the curve anyway: three
    times the light with three times the time constant makes the same events.
    """
    rows = []
    for bright, lux in tqdm(list(product(brightness, illuminance_lux)), unit=" scenes", disable=None):
        curve = blink_curve(Beacon(brightness=bright, illuminance_lux=lux), measured["blink_hz"], pixel_model, seed)
        factor = misfit_factor(curve["events"], measured["events"])
        rows.append({"brightness": bright, "illuminance_lux": lux, "misfit_factor": factor})
    return pd.DataFrame(rows).sort_values("misfit_factor", kind="stable", ignore_index=True)


def mix_curves(curves: npt.ArrayLike, measured: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Curves, shape (n, rates), and a measured one in; how much of each is in the mixture nearest to it, (n,), out.

    Nearest in relative terms; none is less than 0. The mixture is ``weights @ curves``: pixels that see the LED in
    front of several darknesses.

    Examples
    --------
    >>> mix_curves([[8, 8, 1], [90, 9, 0]], [98, 17, 1]).round(2)
    array([1., 1.])
    """
    theirs = np.maximum(np.asarray(measured, float), LEAST)
    weights, _ = nnls((np.asarray(curves, float) / theirs).T, np.ones(theirs.size))
    return np.asarray(weights)
