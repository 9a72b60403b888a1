"""The scenes of `link_conditions`: a marker in a small window of the sensor, and the events of busy tiles."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bicode_lab.camera import Lamp, Moving, Optics, PlacedMarker, Pose, Recorder, Scene, Still, Wall, textured_wall
from bicode_lab.camera.motion import Floats, Trajectory
from bicode_lab.events import Events, copy_events, join, merge, slice_time
from bicode_lab.marker import Board, Marker
from bicode_lab.recognition import ReceiverSettings, settings_for
from bicode_studies.robustness.clutter import PICTURES, WINDOW_PX, clutter_scene
from bicode_studies.robustness.link_conditions import LinkCondition

WINDOW = (96, 72)  # [px]
EDGE_PX = 4  # the marker's plate comes no nearer to the edge of the window
WALL_BEHIND = 1.25  # distance of a wall in distances of the marker
CONTRAST = 0.3
# A window of this texture makes 40,000 events a second, as many as the busiest window of this size in a recording of an
# office that an EVK4 made.
TILE_PICTURES = ("gravel", "brick")
TILE_PX_PER_S = 30.0
TILE_S = 2.0
TILE_M = 5.0


def settings_of(condition: LinkCondition) -> ReceiverSettings:
    """Return the settings of the paper's receiver for a condition, without the search for 2D markers.

    Parameters
    ----------
    condition : LinkCondition

    Returns
    -------
    ReceiverSettings
        Its period fits the packet, see `recognition.settings_for`.
    """
    plain = settings_for(condition.packet_format, detect_2d=False)
    width, height = WINDOW_PX["mains and dimmer"] if condition.clutter == "lamps" else WINDOW
    travel_px = condition.speed_px_per_s * condition.periods * plain.delta_t_whole_us * 1e-6
    return settings_for(condition.packet_format, detect_2d=False, width=width + int(np.ceil(travel_px)), height=height)


def link_scene(condition: LinkCondition, seed: int) -> Scene:
    """Draw the scene of a trial.

    Parameters
    ----------
    condition : LinkCondition
    seed : int
        Seed of the payload (1 and more), of the phase of the packet, of the place in the window, of the direction in
        which the marker moves, and of the lamps and the wall.

    Returns
    -------
    Scene
        Its window is as wide as the path of the marker's image, and `WINDOW` beyond that.
    """
    rng = np.random.default_rng([seed, 1])
    settings = settings_of(condition)
    optics = Optics(width=settings.width, height=settings.height)
    px_m = condition.distance_m / optics.focal_px
    x, y = rng.uniform(-1, 1, 2) * _room_px(condition, px_m)
    direction = rng.choice([-1, 1])
    duration_s = condition.periods * settings.delta_t_whole_us * 1e-6
    start = Pose.facing(
        condition.distance_m,
        x_m=float((x - direction * condition.speed_px_per_s * duration_s / 2) * px_m),
        y_m=float(y * px_m),
    )
    speed_m_per_s = float(direction * condition.speed_px_per_s * px_m)
    camera_m_per_s = condition.amount * float(rng.choice([-1, 1])) if condition.clutter == "wall" else 0.0
    marker = Marker(
        payload=int(rng.integers(1, 2**condition.payload_bits)),
        packet_format=condition.packet_format,
        current_ma=condition.current_ma,
        phase_us=float(rng.uniform(0, condition.packet_format.packet_us)),
    )
    return Scene(
        markers=(PlacedMarker(marker=marker, path=_path(start, speed_m_per_s + camera_m_per_s)),),
        camera=_path(Pose(), camera_m_per_s),
        optics=optics,
        lamps=_lamps(round(condition.amount), rng) if condition.clutter == "lamps" else (),
        wall=_wall(condition.distance_m, optics, rng) if condition.clutter == "wall" else None,
    )


def _room_px(condition: LinkCondition, px_m: float) -> Floats:
    """Return how far the middle of the marker may lie from that of the window, across and down [px].

    A receiver that takes the whole window for one region has no marker in the middle of it.
    """
    window = WINDOW_PX["mains and dimmer"] if condition.clutter == "lamps" else WINDOW
    return np.asarray((np.array(window) - Board().size_m / px_m) / 2 - EDGE_PX)


def _path(start: Pose, speed_m_per_s: float) -> Trajectory:
    """Return a path to the right from a pose."""
    return Moving(start=start, velocity_m_per_s=(speed_m_per_s, 0.0, 0.0)) if speed_m_per_s else Still(start)


def _lamps(count: int, rng: np.random.Generator) -> tuple[Lamp, ...]:
    """Draw lamps, on the mains and behind dimmers in turn."""
    scenes = [clutter_scene("mains and dimmer", rng) for _ in range(-(-count // 2))]
    return tuple(lamp for scene in scenes for lamp in scene.lamps)[:count]


def _wall(distance_m: float, optics: Optics, rng: np.random.Generator) -> Wall:
    """Draw the wall behind a marker; a point of its texture is as wide as a pixel."""
    at = WALL_BEHIND * distance_m
    return textured_wall(str(rng.choice(PICTURES)), contrast=CONTRAST, distance_m=at, texel_m=at / optics.focal_px)


@lru_cache
def _tile(picture: str) -> Events:
    """Record a busy tile for `TILE_S`, `WINDOW` wide and high."""
    optics = Optics(width=WINDOW[0], height=WINDOW[1])
    px_m = TILE_M / optics.focal_px
    wall = textured_wall(picture, contrast=CONTRAST, distance_m=TILE_M, texel_m=px_m)
    scene = Scene(markers=(), optics=optics, wall=wall, camera=_path(Pose(), TILE_PX_PER_S * px_m))
    return join(Recorder(scene, TILE_S, np.random.default_rng(0)))


def add_tiles(
    events: Events, times: int, duration_us: int, width: int, height: int, rng: np.random.Generator
) -> Events:
    """Lay the events of busy tiles over all of the sensor.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    times : int
        How many tiles lie over each other; each begins at another moment and is mirrored by chance.
    duration_us : int
        Length of the recording [us].
    width, height : int
        Size of the sensor [px]; tiles lie beside each other where it is wider than one.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of EVENT_DTYPE
        All events, sorted by time.
    """
    length_us = int(TILE_S * 1e6)
    parts = [events]
    for left in range(0, width, WINDOW[0]):
        for _ in range(times):
            tile = _tile(str(rng.choice(TILE_PICTURES)))
            flips, late_us = rng.integers(2, size=2), int(rng.integers(length_us))
            for start_us in range(late_us - length_us, duration_us, length_us):
                part = copy_events(slice_time(tile, -start_us, duration_us - start_us))
                for axis, flip, side in zip("xy", flips, WINDOW, strict=True):
                    if flip:
                        part[axis] = side - 1 - part[axis]
                part["x"] += left
                part["t"] += start_us
                parts.append(part[(part["x"] < width) & (part["y"] < height)])
    return merge(*parts)
