"""Streams of events and scenes that ``bicode bench`` measures with.

The streams are made with NumPy alone, or by the generator with constants of the bench's own, so that they stay the same
when a constant of the camera changes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bicode_lab.camera import (
    Lamp,
    Light,
    Optics,
    PixelModel,
    PlacedMarker,
    Pose,
    Readout,
    Scene,
    Still,
    Wall,
    pan,
    record,
)
from bicode_lab.events import Events, make_events, merge
from bicode_lab.marker import Board, LedWaveform, Marker
from bicode_lab.paper import DELTA_T_WHOLE_US

PERIOD_US = DELTA_T_WHOLE_US
WIDTH, HEIGHT = 1280, 720
PAYLOADS = (0x25, 0x3C, 0x81, 0x5A, 0xE7, 0x12)
MARKER_SHARE, CLUTTER_SHARE = 0.6, 0.3  # of the events; the rest is noise on the whole sensor
EVENTS_PER_PIXEL = 1.2  # of a marker, at each edge of its LED
CLUTTER_EDGES = 60
PATCH_PX, SQUARE_PX = 128, 64
BRIGHT = 5.0  # what the LED adds to the square's signal of 1
# What is measured must not change with the camera's constants, so the bench has its own.
LIGHT, PIXEL = Light(led_to_ambient=0.78), PixelModel(time_constant_us=150.0)
FAST_READOUT = Readout(row_us=0.0, peak_mev_per_s=1e6, sustained_mev_per_s=1e6, buffer_events=2_000_000_000)


def six_markers(mev_per_s: float, seconds: float, seed: int = 0) -> Events:
    """Return the events of six blinking markers among moving edges and noise on 1280x720 pixels.

    Parameters
    ----------
    mev_per_s : float
        Events per microsecond.
    seconds : float
        Length of the stream [s].
    seed : int

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        Events sorted by time, from 0.
    """
    rng = np.random.default_rng(seed)
    total = mev_per_s * 1e6 * seconds
    length_us = round(seconds * 1e6)
    parts = [_marker(i, MARKER_SHARE * total / len(PAYLOADS), length_us, rng) for i in range(len(PAYLOADS))]
    parts += [_clutter(round(CLUTTER_SHARE * total), length_us, rng)]
    n_noise = round((1 - MARKER_SHARE - CLUTTER_SHARE) * total)
    parts += [(rng.integers(WIDTH, size=n_noise), rng.integers(HEIGHT, size=n_noise), rng.integers(2, size=n_noise),
               rng.integers(length_us, size=n_noise))]  # fmt: skip
    x, y, p, t_us = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    inside = (x >= 0) & (x < WIDTH) & (t_us < length_us)
    return make_events(x[inside], y[inside], p[inside], t_us[inside])


def _marker(number: int, events: float, length_us: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Return x, y, polarity and time of a square of pixels that responds to each edge of its LED."""
    wave = LedWaveform(payload=PAYLOADS[number], phase_us=1000.0 * number)
    edges_us, levels = wave.steps(0, length_us)
    events_per_edge = events / edges_us.size
    side = max(3, round(float(np.sqrt(events_per_edge / EVENTS_PER_PIXEL))))
    counts = rng.poisson(events_per_edge, edges_us.size)
    n = int(counts.sum())
    t_us = np.repeat(edges_us, counts) + 60 + rng.exponential(50, n)
    x0, y0 = 213 + 427 * (number % 3) - side // 2, 180 + 360 * (number // 3) - side // 2
    p = np.repeat(levels > 0, counts)
    return x0 + rng.integers(side, size=n), y0 + rng.integers(side, size=n), p, t_us.astype(np.int64)


def _clutter(n: int, length_us: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Return x, y, polarity and time of upright edges that move sideways, each of one polarity."""
    start_px = rng.uniform(0, WIDTH, CLUTTER_EDGES)
    speed_px_per_s = rng.uniform(-400, 400, CLUTTER_EDGES)
    top = rng.integers(0, HEIGHT - 200, CLUTTER_EDGES)
    edge = rng.integers(CLUTTER_EDGES, size=n)
    t_us = rng.integers(length_us, size=n)
    x = start_px[edge] + speed_px_per_s[edge] * t_us * 1e-6 + rng.normal(0, 0.7, n)
    return np.floor(x).astype(np.int64), top[edge] + rng.integers(200, size=n), edge % 2, t_us


def square_scene(*, whole_sensor: bool) -> Scene:
    """Return a scene with a square of 64x64 pixels that blinks a packet, signal 1 dark and 6 lit.

    All noise is on: threshold spread, bandwidth, refractory period, noise of the level, background activity (on the
    whole sensor 5 Hz per pixel), hot pixels, and the readout. The link is fast enough for all events.

    Parameters
    ----------
    whole_sensor : bool
        True for 1280x720 pixels, False for a patch of 128x128.

    Returns
    -------
    Scene
    """
    optics = Optics(width=WIDTH, height=HEIGHT) if whole_sensor else Optics(width=PATCH_PX, height=PATCH_PX)
    side_m = SQUARE_PX / optics.focal_px
    lamp = Lamp(
        flicker=LedWaveform(payload=0x25), path=Still(Pose.facing(1.0)), width_m=side_m, height_m=side_m,
        brightness=BRIGHT,
    )  # fmt: skip
    model = replace(PIXEL, background_hz=5.0) if whole_sensor else PIXEL
    return Scene(markers=(), lamps=(lamp,), optics=optics, pixel_model=model, readout=FAST_READOUT)


def what_if_scene() -> Scene:
    """Return a scene with a marker at 5 m on a patch of 96x96 pixels."""
    placed = PlacedMarker(path=Still(Pose.facing(5.0)))
    return Scene(markers=(placed,), optics=Optics(width=96, height=96), light=Light())


def still_scene(distance_m: float, size_m: float = 0.05, current_ma: float = 10.7) -> Scene:
    """Return the paper's static marker.

    Parameters
    ----------
    distance_m : float
    size_m : float
        Side of the plate [m].
    current_ma : float
        LED current [mA].

    Returns
    -------
    Scene
    """
    marker = Marker(board=Board(size_m=size_m), current_ma=current_ma)
    return Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(distance_m))),))


def pan_scene(distance_m: float, tangential_m_per_s: float, wall: Wall) -> Scene:
    """Return the paper's panning camera, with a wall behind the marker.

    Parameters
    ----------
    distance_m : float
    tangential_m_per_s : float
        Speed of the marker across the view [m/s].
    wall : Wall

    Returns
    -------
    Scene
    """
    return Scene(
        markers=(PlacedMarker(path=Still(Pose.facing(distance_m))),),
        camera=pan(tangential_m_per_s, distance_m, start_deg=-5.0),
        wall=wall,
    )


def near_scene() -> Scene:
    """Return three markers, near enough for ArUco, in the upper half of the image before a plain wall."""
    places = ((1.0, -0.2, -0.1, 0x25, 7), (1.2, 0.0, -0.12, 0x3C, 11), (1.5, 0.3, -0.15, 0x81, 3))
    return Scene(
        markers=tuple(
            PlacedMarker(
                marker=Marker(payload=payload, board=Board(aruco_id=aruco), phase_us=500.0 * aruco),
                path=Still(Pose.facing(d, x_m=x, y_m=y)),
            )
            for d, x, y, payload, aruco in places
        ),
        optics=Optics(blur_px=0.9, halo_fraction=0.03), light=LIGHT, pixel_model=PIXEL,
    )  # fmt: skip


def filled_up(events: Events, mev_per_s: float, seconds: float) -> Events:
    """Add moving edges in the lower half of the image until a stream has a rate.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    mev_per_s : float
        The rate to reach, in events per microsecond; a stream that has it already stays as it is.
    seconds : float
        Length of the stream [s].

    Returns
    -------
    ndarray of EVENT_DTYPE
        Events sorted by time.
    """
    rng = np.random.default_rng(0)
    length_us = round(seconds * 1e6)
    missing = max(round(mev_per_s * 1e6 * seconds) - events.size, 0)
    x, y, p, t_us = _clutter(missing, length_us, rng)
    inside = (x >= 0) & (x < WIDTH)
    lower = HEIGHT // 2 + y % (HEIGHT // 2)
    return merge(events, make_events(x[inside], lower[inside], p[inside], t_us[inside]))


def near_stream(mev_per_s: float, seconds: float) -> Events:
    """Return the events of the near scene, filled up to a rate.

    Parameters
    ----------
    mev_per_s : float
        Events per microsecond.
    seconds : float
        Length of the stream [s].

    Returns
    -------
    ndarray of EVENT_DTYPE, shape (n,)
        Events sorted by time, from 0.
    """
    return filled_up(record(near_scene(), seconds, rng=0), mev_per_s, seconds)
