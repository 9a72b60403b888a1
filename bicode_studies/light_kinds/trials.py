"""One light, named once: the trials of the table of names, from two cameras."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bicode_lab.camera import Lamp, PlacedMarker, Pose, Scene, Still, record
from bicode_lab.camera.lamp import Flicker
from bicode_lab.events import Events
from bicode_lab.lights.name import LightName, name_light
from bicode_lab.marker import Marker, PacketFormat
from bicode_studies.light_kinds.lights import Light, level_of
from bicode_studies.light_kinds.plate import Sensor, see

LOOK_US = 50_000
DUTIES = (0.1, 0.3, 0.7, 0.9)
PWM_HZ = (100.0, 300.0, 1000.0, 2000.0, 5000.0)
LED_HZ = (50.0, 80.0, 250.0, 1000.0, 2000.0, 5000.0)
BICODE_HZ = (250.0, 500.0, 1000.0, 2000.0, 5000.0)
UART_HZ = (300.0, 600.0, 1200.0, 2400.0, 4800.0, 10_000.0)
INTERVAL_HZ = (1000.0, 5000.0, 10_000.0)
EVENTS = (1, 3, 10, 30, 300)
DISTANCES_M = (2.5, 5.0, 10.0, 15.0)
RATE_SHARE = 0.02  # a rate is right that is as near to the true one


@dataclass(frozen=True, kw_only=True)
class NameTrial:
    """What is looked at.

    Parameters
    ----------
    light : Light
    events_per_edge : float
        Events of an edge of a plate of pixels of `plate`; 0 for the project's camera.
    distance_m : float
        Distance of the project's camera [m]; 0 for the plate.
    """

    light: Light
    events_per_edge: float = 0.0
    distance_m: float = 0.0


def lights() -> list[Light]:
    """Return the lights of the table."""
    return [
        Light(kind="noise"),
        *(Light(kind="mains", rate_hz=rate, depth=depth) for rate in (100.0, 120.0) for depth in (0.5, 0.9)),
        *(Light(kind="pwm", rate_hz=rate, duty=duty) for rate in PWM_HZ for duty in DUTIES),
        *(Light(kind="constant_frequency", rate_hz=rate) for rate in LED_HZ),
        *(Light(kind="interval", rate_hz=rate) for rate in INTERVAL_HZ),
        *(Light(kind="bicode", rate_hz=rate) for rate in BICODE_HZ),
        *(Light(kind="uart", rate_hz=rate) for rate in UART_HZ),
    ]


def conditions() -> list[NameTrial]:
    """Return all conditions of the table: every light by events an edge, and some by distance of the camera."""
    plates = [NameTrial(light=light, events_per_edge=float(events)) for light in lights() for events in EVENTS]
    seen = [
        *(Light(kind="bicode", rate_hz=rate) for rate in BICODE_HZ),
        *(Light(kind="pwm", rate_hz=rate, duty=0.3) for rate in (300.0, 1000.0)),
        *(Light(kind="constant_frequency", rate_hz=rate) for rate in (250.0, 1000.0)),
        Light(kind="mains", rate_hz=100.0, depth=0.9),
    ]
    return plates + [NameTrial(light=light, distance_m=distance) for light in seen for distance in DISTANCES_M]


def draw_sensor(events_per_edge: float, rng: np.random.Generator) -> Sensor:
    """Draw a sensor whose low-pass, latencies, jitter, thresholds, noise and stray events are anything usual.

    Parameters
    ----------
    events_per_edge : float
    rng : numpy.random.Generator

    Returns
    -------
    Sensor
    """
    most = max(1, min(int(events_per_edge), 60))
    return Sensor(
        n_pixels=int(rng.integers(max(1, most // 8), most + 1)),
        events_per_edge=events_per_edge,
        low_pass_us=float(np.exp(rng.uniform(np.log(5), np.log(60)))),
        latency_on_us=float(rng.uniform(5, 40)),
        latency_off_us=float(rng.uniform(5, 60)),
        jitter_us=float(rng.uniform(1, 20)),
        edge_jitter_us=float(rng.choice([0, 5])),
        refractory_us=float(rng.uniform(0, 50)),
        spread=float(rng.uniform(0.02, 0.2)),
        noise=float(rng.uniform(0, 0.1)),
        stray_hz=float(np.exp(rng.uniform(np.log(10), np.log(1000)))),
    )


def events_of(trial: NameTrial, seed: int) -> Events:
    """Return 50 ms of the events of a trial.

    Parameters
    ----------
    trial : NameTrial
    seed : int

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
    """
    if trial.distance_m:
        return _by_camera(trial, seed)
    light = trial.light
    key = [seed, int(trial.events_per_edge), int(light.rate_hz), int(100 * light.duty), int(100 * light.depth)]
    rng = np.random.default_rng(key)
    sensor = draw_sensor(trial.events_per_edge, rng)
    if light.kind == "noise":
        sensor = Sensor(n_pixels=sensor.n_pixels, stray_hz=300 * trial.events_per_edge)
    return see(level_of(light, LOOK_US, rng), sensor, rng)


def _by_camera(trial: NameTrial, seed: int) -> Events:
    """Return the events of the project's camera, 20 ms after it was switched on."""
    light, rng = trial.light, np.random.default_rng([seed, 3])
    path = Still(Pose.facing(trial.distance_m))
    phase_us = float(rng.uniform(0, 20_000))
    if light.kind == "bicode":
        packet = PacketFormat(f_id_hz=light.rate_hz)
        marker = Marker(payload=int(rng.integers(256)), packet_format=packet, phase_us=phase_us)
        scene = Scene(markers=(PlacedMarker(marker=marker, path=path),))
    else:
        shape, depth = ("sine", light.depth) if light.kind == "mains" else ("square", 0.95)
        flicker = Flicker(rate_hz=light.rate_hz, shape=shape, depth=depth, duty=light.duty, phase_us=phase_us)  # type: ignore[arg-type]
        scene = Scene(markers=(), lamps=(Lamp(flicker=flicker, path=path),))
    events = record(scene, 0.07, np.random.default_rng([seed, 2]))
    x, y = scene.optics.width // 2, scene.optics.height // 2
    reach = max(3, round(0.04 / trial.distance_m * scene.optics.focal_px))
    near = (np.abs(events["x"].astype(int) - x) <= reach) & (np.abs(events["y"].astype(int) - y) <= reach)
    seen: Events = events[near & (events["t"] >= 20_000)]
    return seen


def is_right(light: Light, name: LightName) -> bool:
    """Return whether a name is right: kind, and rate within 2 %.

    A light of constant frequency is a dimmer of duty one half. So a dimmer is named right as such a light if its
    duty lies within what the name states.

    Parameters
    ----------
    light : Light
    name : LightName

    Returns
    -------
    bool
    """
    if light.kind in ("none", "noise"):
        return name.kind in ("none", "noise")
    if name.rate_hz is None or abs(name.rate_hz / light.rate_hz - 1) > RATE_SHARE:
        return False
    told = name.kind == "constant_frequency" and name.duty is not None and name.duty_error is not None
    if light.kind == "pwm" and told and name.duty is not None and name.duty_error is not None:
        return abs(name.duty - light.duty) <= 2.6 * name.duty_error
    return name.kind == light.kind


def name_once(trial: NameTrial, seed: int) -> list[dict[str, Any]]:
    """Name the light of a trial.

    Parameters
    ----------
    trial : NameTrial
    seed : int

    Returns
    -------
    list of dict
        One row.
    """
    events = events_of(trial, seed)
    name = name_light(events)
    light = trial.light
    return [
        {
            "kind": light.kind, "rate_hz": light.rate_hz, "duty": light.duty, "depth": light.depth,
            "events_per_edge": trial.events_per_edge, "distance_m": trial.distance_m, "seed": seed,
            "n_events": int(events.size), "name": name.kind, "likely": name.likely, "named_hz": name.rate_hz or 0.0,
            "margin": name.margin, "right": is_right(light, name),
        }
    ]  # fmt: skip
