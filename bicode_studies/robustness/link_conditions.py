"""Conditions in which receivers are compared on the same recordings: a link of one marker, and what disturbs it.

The grid of `FACTORS` has 2160 conditions. `balanced_conditions` takes every level of each factor equally often, with
levels of different factors put together by chance from a fixed seed, and adds the lines through `HOME`, on which one
factor alone changes. No condition is chosen by hand.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from bicode_lab.marker import PacketFormat
from bicode_lab.marker.packet import ChecksumKind

Clutter = Literal["none", "tiles", "lamps", "wall"]

GRID_CONDITIONS = 200
GRID_SEED = 20261127
PERIODS = 10


@dataclass(frozen=True, kw_only=True)
class LinkCondition:
    """A marker that sends an ID, and what else the camera sees.

    Attributes
    ----------
    f_id_hz : float
        Bit rate [Hz].
    payload_bits : int
    checksum : {"sum", "crc3"}
    distance_m : float
        Distance of the marker, which faces the camera [m].
    speed_px_per_s : float
        Speed of its image [px/s].
    clutter : {"none", "tiles", "lamps", "wall"}
        Busy tiles: events of a textured scene that moves, laid over the marker's, `amount` times.
        Lamps: `amount` of them, one half on the mains, the other half behind 1 kHz dimmers (pulse width modulation).
        A wall: a texture behind the marker that moves with `amount` m/s.
    amount : float
        How much clutter, see above; 0 without clutter.
    current_ma : float
        LED current [mA].
    periods : int
        Number of periods of the recording.

    Raises
    ------
    ValueError
        If there is no such clutter.
    """

    f_id_hz: float = 1000.0
    payload_bits: int = 8
    checksum: ChecksumKind = "sum"
    distance_m: float = 10.0
    speed_px_per_s: float = 0.0
    clutter: Clutter = "none"
    amount: float = 0.0
    current_ma: float = 10.7
    periods: int = PERIODS

    def __post_init__(self) -> None:
        if self.clutter not in ("none", "tiles", "lamps", "wall"):
            raise ValueError(f"clutter={self.clutter!r} is not known; choose none, tiles, lamps or wall")

    @property
    def packet_format(self) -> PacketFormat:
        """Format of the marker's packets."""
        return PacketFormat(f_id_hz=self.f_id_hz, payload_bits=self.payload_bits, checksum=self.checksum)


COLUMNS = tuple(asdict(LinkCondition()))
"""The columns of a table that tell conditions apart."""

HOME = LinkCondition()

FACTORS: tuple[tuple[dict[str, Any], ...], ...] = (
    tuple({"f_id_hz": float(rate)} for rate in (500, 1000, 2000, 3000, 4000)),
    (
        {"payload_bits": 8, "checksum": "sum"},
        {"payload_bits": 8, "checksum": "crc3"},
        {"payload_bits": 16, "checksum": "sum"},
        {"payload_bits": 32, "checksum": "sum"},
    ),
    tuple({"distance_m": float(at)} for at in (2.5, 5, 10, 20, 30, 40)),
    tuple({"speed_px_per_s": float(speed)} for speed in (0, 100, 300)),
    (
        {"clutter": "none", "amount": 0.0},
        {"clutter": "tiles", "amount": 20.0},
        {"clutter": "lamps", "amount": 4.0},
    ),
    tuple({"current_ma": current} for current in (10.7, 21.3)),
)
"""The levels of each factor; a level sets one field of `LinkCondition`, or two that belong together."""


def balanced_conditions(count: int = GRID_CONDITIONS, seed: int = GRID_SEED) -> list[LinkCondition]:
    """Return conditions that hold all levels of each factor equally often, then the lines through `HOME`.

    Parameters
    ----------
    count : int
        Number of conditions before the lines are added.
    seed : int
        Decides which levels of different factors come together.

    Returns
    -------
    list of LinkCondition
        All different. A level comes once more than another one of its factor where their number does not divide
        `count`, and may come less often where a condition came twice.
    """
    rng = np.random.default_rng(seed)
    columns = [rng.permutation(np.arange(count) % len(levels)) for levels in FACTORS]
    grid = [
        replace(
            HOME, **{name: value for levels, k in zip(FACTORS, row, strict=True) for name, value in levels[k].items()}
        )
        for row in zip(*columns, strict=True)
    ]
    lines = [replace(HOME, **level) for levels in FACTORS for level in levels]
    return list(dict.fromkeys([*grid, *lines]))


def clutter_conditions() -> list[LinkCondition]:
    """Return the conditions of the table of clutter: tiles, walls and lamps at three distances."""
    kinds: Iterable[tuple[Clutter, float]] = [
        ("none", 0.0),
        *(("tiles", times) for times in (5.0, 20.0, 60.0)),
        *(("wall", speed) for speed in (1.0, 3.0, 5.0)),
        ("lamps", 12.0),
    ]
    return [
        LinkCondition(clutter=clutter, amount=amount, distance_m=at)
        for clutter, amount in kinds
        for at in (5.0, 10.0, 20.0)
    ]
