"""What ``bicode bench`` measures with: fixed streams of events, and scenes for the generator.

The streams are made with NumPy alone, or by the generator with constants that are the bench's own, so that they stay
the same when a constant of the camera changes.
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

WIDTH, HEIGHT = 1280, 720
PAYLOADS = (0x25, 0x3C, 0x81, 0x5A, 0xE7, 0x12)
MARKER_SHARE, CLUTTER_SHARE = 0.6, 0.3  # of the events; the rest is noise everywhere
EVENTS_A_PIXEL = 1.2  # and edge, of a marker
CLUTTER_EDGES = 60
PATCH_PX, SQUARE_PX = 128, 64
BRIGHT = 5.0  # the square's signal lit is 6 against 1 dark
# What is measured must not change with the camera's constants, so these are the bench's own.
LIGHT, PIXEL = Light(led_to_ambient=0.78), PixelModel(time_constant_us=150.0)
FAST_READOUT = Readout(row_us=0.0, peak_mev_per_s=1e6, sustained_mev_per_s=1e6, buffer_events=2_000_000_000)


def six_markers(mev_per_s: float, seconds: float, seed: int = 0) -> Events:
    """A rate and a length in; six markers that blink among moving edges and noise on 1280x720 out, sorted."""
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
    """A square of pixels that answers to each edge of its LED."""
    wave = LedWaveform(payload=PAYLOADS[number], phase_us=1000.0 * number)
    edges_us, levels = wave.steps(0, length_us)
    an_edge = events / edges_us.size
    side = max(3, round(float(np.sqrt(an_edge / EVENTS_A_PIXEL))))
    counts = rng.poisson(an_edge, edges_us.size)
    n = int(counts.sum())
    t_us = np.repeat(edges_us, counts) + 60 + rng.exponential(50, n)
    x0, y0 = 213 + 427 * (number % 3) - side // 2, 180 + 360 * (number // 3) - side // 2
    p = np.repeat(levels > 0, counts)
    return x0 + rng.integers(side, size=n), y0 + rng.integers(side, size=n), p, t_us.astype(np.int64)


def _clutter(n: int, length_us: int, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Upright edges that move sideways, each with one polarity."""
    start_px = rng.uniform(0, WIDTH, CLUTTER_EDGES)
    speed_px_per_s = rng.uniform(-400, 400, CLUTTER_EDGES)
    top = rng.integers(0, HEIGHT - 200, CLUTTER_EDGES)
    edge = rng.integers(CLUTTER_EDGES, size=n)
    t_us = rng.integers(length_us, size=n)
    x = start_px[edge] + speed_px_per_s[edge] * t_us * 1e-6 + rng.normal(0, 0.7, n)
    return np.floor(x).astype(np.int64), top[edge] + rng.integers(200, size=n), edge % 2, t_us


def square_scene(*, whole_sensor: bool) -> Scene:
    """A 64x64 square, signal 1 dark and 6 lit, that blinks a packet; on 128x128 pixels, or on the whole sensor.

    All noise is on: threshold spread, bandwidth, dead time, noise of the level, background events
    and hot pixels (on the whole sensor 5 Hz a pixel), and the readout. The link is taken to be fast enough.
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
    """A marker at 5 m, and no more of the sensor than it lights."""
    placed = PlacedMarker(path=Still(Pose.facing(5.0)))
    return Scene(markers=(placed,), optics=Optics(width=96, height=96), light=Light())


def still_scene(distance_m: float, size_m: float = 0.05, current_ma: float = 10.7) -> Scene:
    """The paper's static marker."""
    marker = Marker(board=Board(size_m=size_m), current_ma=current_ma)
    return Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(distance_m))),))


def pan_scene(distance_m: float, tangential_m_per_s: float, wall: Wall) -> Scene:
    """The paper's moving camera, with a wall behind the marker."""
    return Scene(
        markers=(PlacedMarker(path=Still(Pose.facing(distance_m))),),
        camera=pan(tangential_m_per_s, distance_m, start_deg=-5.0),
        wall=wall,
    )


def near_scene() -> Scene:
    """Three markers near enough for ArUco in the upper half of the picture, before an even wall."""
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
    """Events in; the same and, in the lower half of the picture, moving edges up to a rate out."""
    rng = np.random.default_rng(0)
    length_us = round(seconds * 1e6)
    missing = max(round(mev_per_s * 1e6 * seconds) - events.size, 0)
    x, y, p, t_us = _clutter(missing, length_us, rng)
    inside = (x >= 0) & (x < WIDTH)
    lower = HEIGHT // 2 + y % (HEIGHT // 2)
    return merge(events, make_events(x[inside], lower[inside], p[inside], t_us[inside]))


def near_stream(mev_per_s: float, seconds: float) -> Events:
    """A rate and a length in; what the camera sees of the near scene, filled up to the rate, out."""
    return filled_up(record(near_scene(), seconds, rng=0), mev_per_s, seconds)
