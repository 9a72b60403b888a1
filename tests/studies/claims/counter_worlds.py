"""Made-up trials in which a claim is plainly true, and such in which it is plainly false; no camera is simulated.

A world says what share of the periods is right at each condition that a claim is about. At all other conditions 70 %
of the periods are right, and so a claim that is judged by the wrong trials is not reproduced where it should be. In
most false worlds a single condition, or a single step of an order, is other than in the true one. There are many seeds,
and they agree within 2 %, so that the interval of each share is narrow.

Where a sentence leaves two readings open, true worlds are true by both and false ones false by both; in a split world
one reading holds and the other does not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from itertools import pairwise

import numpy as np
import pandas as pd

from bicode_lab import paper
from bicode_studies.paper_experiments.grids import DISTANCES_M, FIGURES, NOON_LUX, conditions

SEEDS, PERIODS, ELSEWHERE = 300, 200, 0.7
FEW_M = {"11": (0.5, 1.0, 2.5, 20.0, 50.0), "12": (0.5, 1.0, 2.5, 20.0, 25.0)}  # where claims are about all distances
ID, PLATE, REGION = "id_right", "marker_2d_right", "region_px"
Where = Mapping[str, object]


@dataclass(frozen=True)
class Part:
    """What is so at the rows of a figure that have some values: the share of right periods, or a region [px]."""

    figure: str
    column: str
    where: Where
    value: float


@dataclass(frozen=True)
class Worlds:
    """The worlds of a claim.

    Each list of parts of `false` makes a false world of the first true one, and each of `split` one in which two
    readings of the claim differ.
    """

    true: list[list[Part]]
    false: list[list[Part]]
    split: list[list[Part]] = field(default_factory=list)
    excluding: bool = False  # the two readings cannot both hold, so `true` is where a false world begins


@cache
def base_tables() -> dict[str, pd.DataFrame]:
    """Return trials of the conditions of the full grids; the share of right periods is the same everywhere."""
    kinds = [("ours", "any"), ("ours", "count"), ("authors", "any")]
    tables = {}
    for figure in FIGURES:
        kept = [each for each in conditions(figure) if each.distance_m in FEW_M.get(figure, DISTANCES_M)]
        grid = pd.DataFrame([asdict(condition) for condition in kept])
        grid = grid.merge(pd.DataFrame(kinds, columns=["receiver", "frame_rule_2d"]), how="cross")
        table = grid.merge(pd.DataFrame({"seed": range(SEEDS), "periods": PERIODS}), how="cross")
        tables[figure] = table.assign(**{name: counts(table["seed"], ELSEWHERE) for name in (ID, PLATE)})
    panels = pd.DataFrame({"panel": list("abcdefghijk")}).merge(pd.DataFrame({"seed": range(SEEDS)}), how="cross")
    return {**tables, "13": panels.assign(region_px=500.0)}


def counts(seeds: pd.Series, share: float) -> pd.Series:
    """Return the number of right periods of each seed; the seeds differ by up to 2 %, except at 0 and at 1."""
    scatter = (seeds % 3 - 1) * (0.01 * PERIODS if 0 < share < 1 else 0)
    return (round(share * PERIODS) + scatter).clip(0, PERIODS)


@cache
def seeds_where(figure: str, where: frozenset[tuple[str, object]]) -> pd.Series:
    """Return the seeds of the rows of a figure that have some values; their index is that of the rows."""
    table = base_tables()[figure]
    seeds = table.loc[np.all([table[name] == value for name, value in where], axis=0), "seed"]
    assert seeds.size, (figure, where)
    return seeds


def tables_of(parts: Sequence[Part]) -> dict[str, pd.DataFrame]:
    """Return the trials of a world; of two parts about the same rows the later one counts."""
    tables = dict(base_tables())
    for figure in {part.figure for part in parts}:
        tables[figure] = tables[figure].copy()
    for part in parts:
        seeds = seeds_where(part.figure, frozenset(part.where.items()))
        value = part.value + seeds % 3 - 1 if part.column == REGION else counts(seeds, part.value)
        tables[part.figure].loc[seeds.index, part.column] = value
    return tables


def trials(receiver: str = "ours", **where: object) -> Where:
    """Return what rows of the claims' trials must have: those of one receiver on 3-valued frames."""
    return {"receiver": receiver, "frame_rule_2d": "any", **where}


def every(figure: str, column: str, wheres: Sequence[Where], right: float, *wrong: float) -> Worlds:
    """Return worlds in which an accuracy is right at all conditions, and such in which it is wrong at one of them."""
    true = [Part(figure, column, where, right) for where in wheres]
    return Worlds([true], [[Part(figure, column, where, share)] for where in wheres for share in wrong])


def at(distances_m: Sequence[float], receiver: str = "ours", **where: object) -> list[Where]:
    """Return a condition for each distance."""
    return [trials(receiver, distance_m=distance, **where) for distance in distances_m]


def ends(figure: str, column: str, by: str, ranges_m: Mapping[float, float]) -> list[Part]:
    """Return the parts of curves that are 1 up to a distance and 0 beyond, by the level of another column."""
    most_m = {"09": 35.0}.get(figure, 50.0)
    return [
        Part(figure, column, trials(**{by: level, "distance_m": distance}), float(distance <= end_m))
        for level, end_m in ranges_m.items()
        for distance in DISTANCES_M
        if distance <= most_m
    ]


def range_end(figure: str, column: str, by: str, level: float, right_m: float, short_m: float, long_m: float) -> Worlds:
    """Return worlds of "up to D": a curve ends at D; it ends short of it; it ends beyond, where two readings differ."""
    parts = [ends(figure, column, by, {level: end_m}) for end_m in (right_m, short_m, long_m)]
    return Worlds(parts[:1], parts[1:2], parts[2:])


def range_order(figure: str, column: str, by: str, ranges_m: Mapping[float, float]) -> Worlds:
    """Return worlds in which ranges are these, from the shortest on, and such in which two neighbours are swapped."""
    swapped = [{a: ranges_m[b], b: ranges_m[a]} for a, b in pairwise(ranges_m)]
    true = ends(figure, column, by, ranges_m)
    return Worlds([true], [ends(figure, column, by, two) for two in swapped])


def best_range() -> Worlds:
    """Return worlds in which the 5 cm marker is read beyond 20 m, by some current or by 10.7 mA (A1)."""

    def currents(*ranges_m: float) -> list[Part]:
        return ends("08", ID, "current_ma", dict(zip(CURRENTS, ranges_m, strict=True)))

    return Worlds(
        [currents(15, 25, 30), currents(5, 25, 10)],
        [currents(15, 15, 15), currents(20, 20, 20)],
        [currents(15, 20, 30), currents(30, 15, 5)],
    )


Cell = tuple[int, int]


@dataclass(frozen=True)
class Grid:
    """An accuracy that rises with each level of `rows` and, by `along`, with each place of `columns`."""

    figure: str
    column: str
    rows: tuple[str, Sequence[float]]
    columns: tuple[str, Sequence[float]]
    along: float = 0.0
    receiver: str = "ours"

    def share(self, cell: Cell) -> float:
        """Return the accuracy in a cell, which holds the number of a level and of a place."""
        return 0.15 + 0.22 * cell[0] + self.along * cell[1]

    def part(self, cell: Cell, value: float) -> Part:
        """Return the part in which a cell has this accuracy."""
        (by, levels), (along, places) = self.rows, self.columns
        where = trials(self.receiver, **{by: levels[cell[0]], along: places[cell[1]]})
        return Part(self.figure, self.column, where, value)

    def cells(self) -> list[Cell]:
        """Return all cells."""
        return [(i, j) for i in range(len(self.rows[1])) for j in range(len(self.columns[1]))]

    def true(self) -> list[Part]:
        """Return the parts of a world in which accuracy rises."""
        return [self.part(cell, self.share(cell)) for cell in self.cells()]

    def turned(self) -> list[Part]:
        """Return the parts of a world in which it falls, from each level to the next and from place to place."""
        last = self.cells()[-1]
        return [self.part(cell, self.share((last[0] - cell[0], last[1] - cell[1]))) for cell in self.cells()]

    def swapped_levels(self) -> list[list[Part]]:
        """Return for each two neighbouring levels the parts in which they are swapped at all places."""
        places = range(len(self.columns[1]))
        return [[part for j in places for part in self._swap((i, j), (i + 1, j))] for i in range(len(self.rows[1]) - 1)]

    def swapped_cells(self) -> list[list[Part]]:
        """Return for each two neighbouring levels and each place the parts in which they are swapped there alone."""
        return [self._swap((i, j), (i + 1, j)) for i, j in self.cells() if (i + 1, j) in self.cells()]

    def _swap(self, one: Cell, two: Cell) -> list[Part]:
        return [self.part(one, self.share(two)), self.part(two, self.share(one))]


def regions(**areas_px: float) -> list[Part]:
    """Return the parts in which the regions of panels of Fig. 13 are these."""
    return [Part("13", REGION, {"panel": panel}, area) for panel, area in areas_px.items()]


def together(*worlds: Worlds) -> Worlds:
    """Return the worlds of a claim about several things: all are true, or a single one is false."""
    return Worlds([[part for each in worlds for part in each.true[0]]], [two for each in worlds for two in each.false])


def alike() -> Worlds:
    """Return worlds in which infrared light outdoors is about as good as red light indoors or not (F11.3)."""
    wheres = {"08": trials(current_ma=10.7), "11": trials(band="infrared", illuminance_lux=paper.EVENING_LUX)}

    def differ(figure: str, columns: Sequence[str], by: float) -> list[Part]:
        return [Part(figure, column, wheres[figure], ELSEWHERE + by) for column in columns]

    true = [differ("11", (ID, PLATE), by) for by in (0.0, -0.05, 0.06)]
    return Worlds(true, [differ(f, [column], by) for f in wheres for column in (ID, PLATE) for by in (-0.2, 0.2)])


def less_than_still() -> Worlds:
    """Return worlds in which the fastest pan costs IDs near the camera, or gains some at one distance (F12.5)."""
    still = [Part("08", ID, where, 0.85) for where in at(NEAR_M, "authors", **STANDARD)]
    pan = [Part("12", ID, where, 0.6) for where in at(NEAR_M, "authors", **FASTEST)]
    gains = [[Part("12", ID, where, 0.97)] for where in at(NEAR_M, "authors", **FASTEST)]
    return Worlds([still + pan], gains[:1], gains[1:])


def pan_order() -> Worlds:
    """Return worlds in which accuracy falls with the speed of the pan: that of 2D markers, and that of IDs (F12.3)."""
    plates, ids, late = (
        Grid("12", column, ("speed_m_per_s", SPEEDS[::-1]), ("distance_m", FEW_M["12"]), receiver=receiver)
        for column, receiver in ((PLATE, "ours"), (ID, "ours"), (ID, "authors"))
    )
    split = [a + b for a, b in zip(ids.swapped_cells(), late.swapped_cells(), strict=True)]
    return Worlds([plates.true() + ids.true() + late.true()], plates.swapped_cells(), split)


def spin_order() -> Worlds:
    """Return worlds in which 2D accuracy falls with speed and with distance, and such in which it rises (F14.2)."""
    one = Grid("14", PLATE, ("rpm", SPINS[::-1]), ("distance_m", NEAR_M[::-1]), along=0.1)
    return Worlds([one.true()], [one.turned()])


def mean_order(grid: Grid) -> Worlds:
    """Return worlds of an order that may be meant at each place or as a mean over places (F14.4, F14.7)."""
    return Worlds([grid.true()], grid.swapped_levels(), grid.swapped_cells())


def spun_region() -> Worlds:
    """Return worlds in which the spinning marker is larger from nearer and its pose is read at both places (F14.8)."""
    near, far = ([Part("14", PLATE, where, 0.9)] for where in at([0.5, 2.5], rpm=16.0))
    lost = [[Part("14", PLATE, where, 0.2)] for where in at([0.5, 2.5], rpm=16.0)]
    both_lost = [part for each in lost for part in each]
    return Worlds([regions(k=900, j=9000) + near + far], [regions(k=9000, j=900) + both_lost], lost)


NEAR_M = (0.5, 1.0, 2.5)
FAR_M = tuple(d for d in DISTANCES_M if d > 5)
CURRENTS, SPEEDS, SPINS = paper.FIG_8_CURRENTS_MA, paper.FIG_12_SPEEDS_M_PER_S, paper.FIG_14_SPEEDS_RPM
STANDARD, FASTEST = {"current_ma": 10.7}, {"speed_m_per_s": SPEEDS[-1]}
RED = {"band": "red", "illuminance_lux": paper.EVENING_LUX}
INFRARED = [{"band": "infrared", "illuminance_lux": lux} for lux in (paper.OFFICE_LUX, paper.EVENING_LUX)]
NOON = [{"band": "infrared", "illuminance_lux": lux} for lux in NOON_LUX]


WORLDS: dict[str, Worlds] = {
    "F8.1": every("08", PLATE, at(NEAR_M, **STANDARD), 1.0, 0.9),
    "F8.2": every("08", PLATE, at(FAR_M, **STANDARD), 0.0, 0.8),
    "F8.3": range_end("08", ID, "current_ma", 10.7, 20.0, 15.0, 25.0),
    "F8.4": range_end("08", ID, "current_ma", 21.3, 30.0, 25.0, 35.0),
    "F8.5": range_order("08", ID, "current_ma", {5.5: 15.0, 10.7: 20.0, 21.3: 30.0}),
    "F8.6": range_order("08", PLATE, "current_ma", {21.3: 1.0, 10.7: 2.5, 5.5: 5.0}),
    "F8.7": Worlds([regions(a=900, b=1000, c=1300)], [regions(c=700)], [regions(a=1500), regions(b=1500)]),
    "A1": best_range(),
    "A2": range_end("08", PLATE, "current_ma", 10.7, 2.5, 1.0, 5.0),
    "F9.1": together(*(every("09", PLATE, at(NEAR_M, yaw_deg=yaw), 0.97, 0.8) for yaw in paper.FIG_9_YAWS_DEG[:2])),
    "F9.2": every("09", PLATE, at([d for d in DISTANCES_M if d <= 35], yaw_deg=80.0), 0.0, 0.8),
    "F9.3": range_end("09", ID, "yaw_deg", 80.0, 10.0, 7.5, 15.0),
    "F9.4": range_order("09", ID, "yaw_deg", {80.0: 10.0, 40.0: 20.0, 0.0: 25.0}),
    "F9.5": Worlds([regions(e=700, b=1000)], [regions(e=1000)], [regions(e=4000), regions(e=250)], excluding=True),
    "F10.1": every("10", PLATE, at([*NEAR_M, 5.0, 7.5], size_m=0.1), 1.0, 0.9),
    "F10.2": range_order("10", PLATE, "size_m", {0.025: 1.0, 0.05: 2.5, 0.1: 7.5}),
    "F10.3": every("10", ID, at([d for d in DISTANCES_M if d <= 40], size_m=0.1), 0.9, 0.7),
    "F10.4": range_order("10", ID, "size_m", {0.025: 7.5, 0.05: 20.0, 0.1: 40.0}),
    "F10.5": range_end("10", ID, "size_m", 0.025, 7.5, 5.0, 10.0),
    "F10.6": range_end("10", PLATE, "size_m", 0.025, 1.0, 0.5, 2.5),
    "F10.7": Worlds(
        [regions(f=1000, b=1000, g=1000)],
        [regions(g=1100), regions(f=4000)],
        [regions(f=250, g=4000), regions(f=500, g=2000)],
        excluding=True,
    ),
    "F11.0": together(*(every("11", column, at(FEW_M["11"], **RED), 0.0, 0.1) for column in (ID, PLATE))),
    "F11.1": together(
        *(every("11", column, at(NEAR_M, **light), 1.0, 0.85) for light in INFRARED for column in (ID, PLATE))
    ),
    "F11.2": together(*(every("11", ID, at([20.0], **light), 0.5, 0.2, 0.8) for light in INFRARED)),
    "F11.3": alike(),
    "F11.4": together(
        *(every("11", column, at(FEW_M["11"], **light), 0.0, 0.8) for light in NOON for column in (ID, PLATE))
    ),
    "F12.1": every("12", PLATE, at([1.0], **FASTEST), 0.5, 0.2, 0.8),
    "F12.2": every("12", PLATE, at([2.5], **FASTEST), 0.0, 0.1),
    "F12.3": pan_order(),
    "F12.4": every("12", ID, at([20.0], "authors", **FASTEST), 0.97, 0.8),
    "F12.5": less_than_still(),
    "F12.6": together(*(every("12", ID, at([2.5], speed_m_per_s=v), 0.97, 0.8) for v in (SPEEDS[0], SPEEDS[-1]))),
    "F14.1": together(*(every("14", PLATE, at(NEAR_M[:2], rpm=rpm), 1.0, 0.9) for rpm in SPINS)),
    "F14.2": spin_order(),
    "F14.3": every("14", PLATE, at([2.5], rpm=64.0), 0.5, 0.2, 0.8),
    "F14.4": mean_order(Grid("14", ID, ("rpm", SPINS[::-1]), ("distance_m", NEAR_M), receiver="authors")),
    "F14.5": every("14", ID, at(NEAR_M, "authors", rpm=64.0), 0.8, 0.6),
    "F14.6": every("14", ID, at(NEAR_M, "authors", rpm=16.0), 0.9, 0.7),
    "F14.7": mean_order(Grid("14", ID, ("distance_m", NEAR_M), ("rpm", SPINS), receiver="authors")),
    "F14.8": spun_region(),
}
