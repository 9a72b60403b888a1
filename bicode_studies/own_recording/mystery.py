"""An exercise recording with hidden IDs, and a fingerprint to check an answer without revealing it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bicode_lab.camera import PlacedMarker, Pose, Scene, Still
from bicode_lab.marker import Board, Marker, PacketFormat

SECONDS = 0.2  # length of the recording
PLACES = ((3.0, 0.0), (4.0, 40.0), (6.0, 0.0), (12.0, 0.0))  # distance [m] and yaw [deg] of each marker
SALT = "bicode_lab mystery"


def make_mystery_scene(seed: int) -> Scene:
    """Make a scene of four markers with random IDs, patterns, places and phases.

    The markers hang side by side in random order. One of them uses the other Manchester convention.

    Parameters
    ----------
    seed : int
        Seed of all random draws.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng(seed)
    ids = rng.choice(np.arange(1, 256), len(PLACES), replace=False)
    patterns = rng.choice(50, len(PLACES), replace=False)
    columns = rng.permutation(len(PLACES)) - (len(PLACES) - 1) / 2  # quarters of the picture, counted from its middle
    odd_one = int(rng.integers(len(PLACES)))
    placed = []
    for number, (distance_m, yaw_deg) in enumerate(PLACES):
        focal_px, width = Scene().optics.focal_px, Scene().optics.width
        x_px = (columns[number] + rng.uniform(-0.25, 0.25)) * width / len(PLACES)
        x_m, y_m = x_px * distance_m / focal_px, rng.uniform(-150, 150) * distance_m / focal_px
        packet_format = PacketFormat(manchester="thomas" if number == odd_one else "ieee")
        marker = Marker(
            payload=int(ids[number]),
            board=Board(aruco_id=int(patterns[number])),
            packet_format=packet_format,
            phase_us=float(rng.uniform(0, packet_format.packet_us)),
        )
        pose = Pose.facing(distance_m, x_m=float(x_m), y_m=float(y_m), yaw_deg=yaw_deg)
        placed.append(PlacedMarker(marker=marker, path=Still(pose)))
    return replace(Scene(), markers=tuple(placed))


def fingerprint_ids(ids: Iterable[int]) -> str:
    """Return a fingerprint of IDs: the same IDs give the same fingerprint, and it does not reveal them.

    Parameters
    ----------
    ids : iterable of int
        IDs in any order.

    Returns
    -------
    str
        16 hexadecimal digits.

    Examples
    --------
    >>> fingerprint_ids([37, 200]) == fingerprint_ids({200, 37})
    True
    >>> len(fingerprint_ids([37]))
    16
    """
    text = f"{SALT} {sorted({int(one) for one in ids})}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]
