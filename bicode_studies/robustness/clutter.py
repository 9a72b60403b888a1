"""Clutter: scenes of things that blink or move and are no marker.

A scene is a small window of the sensor with lamps on the mains (100 and 120 Hz ripple), a second lamp behind a 1 kHz
dimmer, or textured edges that slide by.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from bicode_lab.camera import Flicker, Lamp, Moving, Optics, Pose, Scene, Still, textured_wall

ClutterKind = Literal["mains lamps", "mains and dimmer", "moving edges"]
CLUTTER_KINDS: tuple[ClutterKind, ...] = ("mains lamps", "mains and dimmer", "moving edges")
WINDOW_PX = {"mains lamps": (160, 120), "mains and dimmer": (160, 120), "moving edges": (80, 60)}
LAMP_M = 5.0  # distance of the lamps and the wall [m]
PICTURES = ("gravel", "brick", "camera", "coins", "text")


def clutter_scene(kind: ClutterKind, rng: np.random.Generator) -> Scene:
    """Draw a scene of clutter, without a marker.

    There are one or two lamps on the mains, 2 .. 8 px wide, up to 50 times as bright as the wall, with a ripple of
    20 .. 100 %, smooth or square; a dimmer has 1 kHz within 2 %. A wall slides at 10 .. 60 px/s.

    Parameters
    ----------
    kind : {"mains lamps", "mains and dimmer", "moving edges"}
    rng : numpy.random.Generator
        Chance for all that is drawn.

    Returns
    -------
    Scene
        160 x 120 pixels, or 80 x 60 where edges move.
    """
    width, height = WINDOW_PX[kind]
    optics = Optics(width=width, height=height)
    dimmers = {"mains lamps": 0, "mains and dimmer": 1, "moving edges": int(rng.random() < 0.5)}[kind]
    lamps = [_lamp(_mains(rng), 50, optics, rng) for _ in range(1 + int(kind == "mains lamps" and rng.random() < 0.5))]
    lamps += [_lamp(_dimmer(rng), 5, optics, rng) for _ in range(dimmers)]
    if kind != "moving edges":
        return Scene(markers=(), optics=optics, lamps=tuple(lamps))
    speed = float(np.exp(rng.uniform(np.log(10), np.log(60)))) * LAMP_M / optics.focal_px * rng.choice([-1, 1])
    camera = Moving(velocity_m_per_s=(float(speed), 0.0, 0.0))
    wall = textured_wall(str(rng.choice(PICTURES)), contrast=float(rng.uniform(0.2, 0.6)), distance_m=LAMP_M)
    # Half of the lamps move along with the camera; the others pass by.
    riding = tuple(
        replace(lamp, path=Moving(start=lamp.path.pose_at(0), velocity_m_per_s=camera.velocity_m_per_s))
        if rng.random() < 0.5 else lamp
        for lamp in lamps
    )  # fmt: skip
    return Scene(markers=(), optics=optics, lamps=riding, camera=camera, wall=wall)


def _mains(rng: np.random.Generator) -> Flicker:
    """Draw the ripple of a lamp on a mains of 50 or 60 Hz, which keeps its rate to two parts in a thousand."""
    return Flicker(
        rate_hz=float(rng.choice([100, 120]) * rng.uniform(0.998, 1.002)),
        shape="sine" if rng.random() < 0.4 else "square",
        depth=float(np.exp(rng.uniform(np.log(0.2), 0))),
        duty=float(0.04 + 0.92 * rng.beta(0.5, 0.5)),  # short pulses or gaps: both edges within delta_t_blinker
        phase_us=float(rng.uniform(0, 1e4)),
    )


def _dimmer(rng: np.random.Generator) -> Flicker:
    """Draw the pulses of a dimmer: about 1 kHz, with any duty."""
    return Flicker(
        rate_hz=float(1000 * rng.uniform(0.98, 1.02)),
        shape="square",
        depth=float(rng.uniform(0.5, 1)),
        duty=float(rng.uniform(0.1, 0.9)),
        phase_us=float(rng.uniform(0, 1e3)),
    )


def _lamp(flicker: Flicker, brightest: float, optics: Optics, rng: np.random.Generator) -> Lamp:
    """Draw size, place and brightness (up to `brightest`) of a lamp with a given flicker."""
    px = LAMP_M / optics.focal_px
    x, y = (rng.uniform(-0.42, 0.42) * side for side in (optics.width, optics.height))
    width, height = np.exp(rng.uniform(np.log(2), np.log(8), 2))
    return Lamp(
        flicker=flicker,
        path=Still(Pose.facing(LAMP_M, x_m=float(x * px), y_m=float(y * px))),
        width_m=float(width * px),
        height_m=float(height * px),
        brightness=float(np.exp(rng.uniform(0, np.log(brightest)))),
    )
