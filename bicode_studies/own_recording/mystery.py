"""A recording whose IDs are to be found: markers drawn from a seed, and a check that does not tell them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from bicode_lab.camera import PlacedMarker, Pose, Scene, Still
from bicode_lab.marker import Board, Marker, PacketFormat

SECONDS = 0.2
PLACES = ((3.0, 0.0), (4.0, 40.0), (6.0, 0.0), (12.0, 0.0))  # distance [m] and yaw [deg] of each marker
SALT = "bicode_lab mystery"


def mystery_scene(seed: int) -> Scene:
    """A seed in, four markers with IDs, patterns, places and phases of their own out.

    They hang side by side in an order left to chance. One of them sends Manchester bits the other way round.
    """
    rng = np.random.default_rng(seed)
    ids = rng.choice(np.arange(1, 256), len(PLACES), replace=False)
    patterns = rng.choice(50, len(PLACES), replace=False)
    columns = rng.permutation(len(PLACES)) - (len(PLACES) - 1) / 2  # quarters of the picture, from the left
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


def digest_of(ids: Iterable[int]) -> str:
    """IDs in any order in, a fingerprint out: equal IDs have equal ones, and it does not tell them.

    Examples
    --------
    >>> digest_of([37, 200]) == digest_of({200, 37})
    True
    >>> len(digest_of([37]))
    16
    """
    said = f"{SALT} {sorted({int(one) for one in ids})}"
    return hashlib.sha256(said.encode()).hexdigest()[:16]
