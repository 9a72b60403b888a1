"""How each claim about an experiment is tested (IV).   id of a claim -> a test of the figures' trials

IDs are those of our receiver; in Figs 12 and 14, where the paper sees a near-range loss, of the one with the
authors' processing limit. 2D markers are those of the paper's 3-valued frames.
"""

from __future__ import annotations

import numpy as np

from bicode_lab import paper
from bicode_studies.claims.curves import DRAWS, Answer, Curve, Floats, Tables, Where, rows_where
from bicode_studies.claims.statistics import (
    Test,
    alike,
    all_of,
    better,
    further,
    longest,
    rising,
    worst,
)

NEAR = (0.0, 2.5)  # m: where the paper reads poses, and what IV-E calls short range
NEARLY_EQUAL = 0.1  # mean difference of two accuracies that IV-D may call "nearly equivalent"
APART = 0.9  # share of periods in which a marker read apart from the background is "effectively separated" (IV-E)
NOON_LUX = (1e4, 9e4)  # "tens of thousands of lux" (IV-D)


def blinker(figure: str, where: Where, receiver: str = "ours") -> Curve:
    """A figure and a condition in, its curve of IDs out."""
    return Curve(figure=figure, right="id_right", where={"receiver": receiver, "frame_rule_2d": "any", **where})


def plate(figure: str, where: Where) -> Curve:
    """A figure and a condition in, its curve of 2D markers out."""
    return Curve(figure=figure, right="marker_2d_right", where={"receiver": "ours", "frame_rule_2d": "any", **where})


LOW, STANDARD, HIGH = (f"{current:g}" for current in paper.FIG_8_CURRENTS_MA)
ID_8 = {f"{current:g}": blinker("08", {"current_ma": current}) for current in paper.FIG_8_CURRENTS_MA}
PLATE_8 = {f"{current:g}": plate("08", {"current_ma": current}) for current in paper.FIG_8_CURRENTS_MA}
ID_9 = [blinker("09", {"yaw_deg": yaw}) for yaw in paper.FIG_9_YAWS_DEG]
PLATE_9 = [plate("09", {"yaw_deg": yaw}) for yaw in paper.FIG_9_YAWS_DEG]
ID_10 = [blinker("10", {"size_m": size}) for size in paper.FIG_10_SIZES_M]
PLATE_10 = [plate("10", {"size_m": size}) for size in paper.FIG_10_SIZES_M]
RED_OUTDOORS: Where = {"band": "red", "illuminance_lux": paper.EVENING_LUX}
INFRARED: list[Where] = [{"band": "infrared", "illuminance_lux": lux} for lux in (paper.OFFICE_LUX, paper.EVENING_LUX)]
ID_11 = [blinker("11", where) for where in INFRARED]
PLATE_11 = [plate("11", where) for where in INFRARED]
ID_12 = [blinker("12", {"speed_m_per_s": speed}, "authors") for speed in paper.FIG_12_SPEEDS_M_PER_S]
PLATE_12 = [plate("12", {"speed_m_per_s": speed}) for speed in paper.FIG_12_SPEEDS_M_PER_S]
ID_14 = [blinker("14", {"rpm": rpm}, "authors") for rpm in paper.FIG_14_SPEEDS_RPM]
PLATE_14 = [plate("14", {"rpm": rpm}) for rpm in paper.FIG_14_SPEEDS_RPM]
FIG_14_DISTANCES_M = (0.5, 1.0, 2.5)


def area(tables: Tables, panel: str) -> Floats:
    """Tables and a panel of Fig. 13 in; pixels of the marker's region in its frame, one number a seed, out."""
    return rows_where(tables, "13", {"panel": panel}).sort_values("seed")["region_px"].to_numpy(float)


def _drawn(values: Floats, rng: np.random.Generator) -> Floats:
    """Numbers in, means of drawn ones out, shape (DRAWS,)."""
    return np.asarray(rng.choice(values, (DRAWS, values.size)).mean(axis=1))


def larger(*panels: str) -> Test:
    """Panels of Fig. 13, the smallest region first, in; a test of that order out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        areas = [area(tables, panel) for panel in panels]
        return rising([float(each.mean()) for each in areas], [_drawn(each, rng) for each in areas], "px")

    return test


def area_ratio(above: str, below: str) -> Test:
    """Two panels of Fig. 13 in, a test of the ratio of their regions out."""

    def test(tables: Tables, lo: float, hi: float) -> Answer:
        rng = np.random.default_rng(0)
        a, b = area(tables, above), area(tables, below)
        low, high = np.quantile(_drawn(a, rng) / _drawn(b, rng), [0.025, 0.975])
        value = float(a.mean() / b.mean())
        return Answer(ours=f"{a.mean():.4g} px / {b.mean():.4g} px", value=value, low=float(low), high=float(high))

    return test


def noon(tables: Tables, lo: float, hi: float) -> Answer:
    """F11.4: IDs and 2D markers of the infrared marker at every noon light that was tried."""
    light: Where = {"band": "infrared", "illuminance_lux": NOON_LUX}
    levels = sorted(set(rows_where(tables, "11", light)["illuminance_lux"]))
    wheres: list[Where] = [{**light, "illuminance_lux": lux} for lux in levels]
    return worst(*(make("11", where) for where in wheres for make in (blinker, plate)))(tables, lo, hi)


def separated(tables: Tables, lo: float, hi: float) -> Answer:
    """F12.6: how often our receiver, that has no processing limit, reads the panned marker apart from the wall."""
    speeds = (paper.FIG_12_SPEEDS_M_PER_S[0], paper.FIG_12_SPEEDS_M_PER_S[-1])
    curves = [blinker("12", {"speed_m_per_s": speed, "distance_m": 2.5}) for speed in speeds]
    answer = worst(*curves)(tables, APART, 1.0)
    return Answer(
        ours=f"ID read {answer.ours}", value=answer.value, low=answer.low, high=answer.high, lo=APART, hi=1.0
    )  # fmt: skip


TESTS: dict[str, Test] = {
    "F8.1": worst(PLATE_8[STANDARD].with_(distance_m=NEAR)),
    "F8.2": worst(PLATE_8[STANDARD].with_(distance_m=(5.01, 1e3))),
    "F8.3": longest(ID_8[STANDARD]),
    "F8.4": longest(ID_8[HIGH]),
    "F8.5": further(ID_8[LOW], ID_8[STANDARD], ID_8[HIGH]),
    "F8.6": further(PLATE_8[HIGH], PLATE_8[STANDARD], PLATE_8[LOW]),
    "F8.7": larger("b", "c"),
    "A1": longest(*ID_8.values()),
    "A2": longest(PLATE_8[STANDARD]),
    "F9.1": worst(*(curve.with_(distance_m=NEAR) for curve in PLATE_9[:2])),
    "F9.2": worst(PLATE_9[2]),
    "F9.3": longest(ID_9[2]),
    "F9.4": further(*ID_9[::-1]),
    "F9.5": area_ratio("e", "b"),
    "F10.1": worst(PLATE_10[2].with_(distance_m=(0, 7.5))),
    "F10.2": further(*PLATE_10),
    "F10.3": worst(ID_10[2].with_(distance_m=(0, 40))),
    "F10.4": further(*ID_10),
    "F10.5": longest(ID_10[0]),
    "F10.6": worst(PLATE_10[0].with_(distance_m=1.0)),
    "F10.7": larger("f", "b", "g"),
    "F11.0": worst(blinker("11", RED_OUTDOORS), plate("11", RED_OUTDOORS)),
    "F11.1": worst(*(curve.with_(distance_m=NEAR) for curve in (*ID_11, *PLATE_11))),
    "F11.2": worst(*(curve.with_(distance_m=20.0) for curve in ID_11)),
    "F11.3": all_of(alike(ID_11[1], ID_8[STANDARD], NEARLY_EQUAL), alike(PLATE_11[1], PLATE_8[STANDARD], NEARLY_EQUAL)),
    "F11.4": noon,
    "F12.1": worst(PLATE_12[2].with_(distance_m=1.0)),
    "F12.2": worst(PLATE_12[2].with_(distance_m=2.5)),
    "F12.3": better(*PLATE_12[::-1]),
    "F12.4": worst(ID_12[2].with_(distance_m=20.0)),
    "F12.5": all_of(
        *(better(curve.with_(distance_m=NEAR), blinker("08", {"current_ma": 10.7}, "authors")) for curve in ID_12)
    ),
    "F12.6": separated,
    "F14.1": worst(*(curve.with_(distance_m=(0, 1)) for curve in PLATE_14)),
    "F14.2": all_of(
        better(*PLATE_14[::-1]),
        better(*(plate("14", {"distance_m": at}).over("rpm") for at in FIG_14_DISTANCES_M[::-1])),
    ),
    "F14.3": worst(PLATE_14[2].with_(distance_m=2.5)),
    "F14.4": better(*ID_14[::-1]),
    "F14.5": worst(ID_14[2]),
    "F14.6": worst(ID_14[0]),
    "F14.7": better(*(blinker("14", {"distance_m": at}, "authors").over("rpm") for at in FIG_14_DISTANCES_M)),
    "F14.8": larger("k", "j"),
}
