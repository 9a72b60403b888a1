"""How each claim about an experiment of section IV is tested: the claim's id and a test of the figures' trials.

IDs are those of our receiver. In Figs 12 and 14, where the paper sees a loss at short range, they are those of the
receiver with the authors' processing limit. 2D markers are those found in the paper's 3-valued frames.
"""

from __future__ import annotations

from dataclasses import replace

from bicode_lab import paper
from bicode_studies.claims.claim_result import ClaimResult, Tables
from bicode_studies.claims.curves import Curve, Where, rows_where
from bicode_studies.claims.differences import accuracy_rises
from bicode_studies.claims.orders import mean_rises, most_different, rises_at_each
from bicode_studies.claims.region_claims import region_exponent, region_ratio, region_rises
from bicode_studies.claims.statistics import (
    ClaimTest,
    least_favourable,
    longest_range,
    range_rises,
    worst_accuracy,
)

NEAR = (0.0, 2.5)  # m: the distances at which the paper reads poses, called short range in IV-E
SEPARATED = 0.9  # the share of periods in which a marker that is "effectively separated" (IV-E) must be read
NOON_LUX = (1e4, 9e4)  # "tens of thousands of lux" (IV-D)


def id_curve(figure: str, where: Where, receiver: str = "ours") -> Curve:
    """Return the curve of IDs of a figure under a condition.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    where : mapping
        Column to value.
    receiver : str
        "ours", or "authors" for the one with the authors' processing limit.

    Returns
    -------
    Curve
    """
    return Curve(figure=figure, right="id_right", where={"receiver": receiver, "frame_rule_2d": "any", **where})


def curve_2d(figure: str, where: Where) -> Curve:
    """Return the curve of 2D markers of a figure under a condition.

    Parameters
    ----------
    figure : str
        "08" .. "14".
    where : mapping
        Column to value.

    Returns
    -------
    Curve
    """
    return Curve(figure=figure, right="marker_2d_right", where={"receiver": "ours", "frame_rule_2d": "any", **where})


LOW, STANDARD, HIGH = (f"{current:g}" for current in paper.FIG_8_CURRENTS_MA)
ID_8 = {f"{current:g}": id_curve("08", {"current_ma": current}) for current in paper.FIG_8_CURRENTS_MA}
MARKER_2D_8 = {f"{current:g}": curve_2d("08", {"current_ma": current}) for current in paper.FIG_8_CURRENTS_MA}
ID_9 = [id_curve("09", {"yaw_deg": yaw}) for yaw in paper.FIG_9_YAWS_DEG]
MARKER_2D_9 = [curve_2d("09", {"yaw_deg": yaw}) for yaw in paper.FIG_9_YAWS_DEG]
ID_10 = [id_curve("10", {"size_m": size}) for size in paper.FIG_10_SIZES_M]
MARKER_2D_10 = [curve_2d("10", {"size_m": size}) for size in paper.FIG_10_SIZES_M]
RED_OUTDOORS: Where = {"band": "red", "illuminance_lux": paper.EVENING_LUX}
INFRARED: list[Where] = [{"band": "infrared", "illuminance_lux": lux} for lux in (paper.OFFICE_LUX, paper.EVENING_LUX)]
ID_11 = [id_curve("11", where) for where in INFRARED]
MARKER_2D_11 = [curve_2d("11", where) for where in INFRARED]
ID_12 = [id_curve("12", {"speed_m_per_s": speed}, "authors") for speed in paper.FIG_12_SPEEDS_M_PER_S]
MARKER_2D_12 = [curve_2d("12", {"speed_m_per_s": speed}) for speed in paper.FIG_12_SPEEDS_M_PER_S]
ID_14 = [id_curve("14", {"rpm": rpm}, "authors") for rpm in paper.FIG_14_SPEEDS_RPM]
MARKER_2D_14 = [curve_2d("14", {"rpm": rpm}) for rpm in paper.FIG_14_SPEEDS_RPM]
FIG_14_DISTANCES_M = (0.5, 1.0, 2.5)


def accuracy_at_noon(tables: Tables, lo: float, hi: float) -> ClaimResult:
    """Test IDs and 2D markers of the infrared marker at every noon light that was tried (F11.4).

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows of trials by figure.
    lo, hi : float
        Bounds of the claim.

    Returns
    -------
    ClaimResult
    """
    light: Where = {"band": "infrared", "illuminance_lux": NOON_LUX}
    levels = sorted(set(rows_where(tables, "11", light)["illuminance_lux"]))
    wheres: list[Where] = [{**light, "illuminance_lux": lux} for lux in levels]
    return worst_accuracy(*(make("11", where) for where in wheres for make in (id_curve, curve_2d)))(tables, lo, hi)


def read_apart_from_wall(tables: Tables, lo: float, hi: float) -> ClaimResult:
    """Test how often the marker is read apart from the moving wall, by our receiver without processing limit (F12.6).

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Rows of trials by figure.
    lo, hi : float
        Not used: the claim states no bounds, so `SEPARATED` is the lower one.

    Returns
    -------
    ClaimResult
    """
    speeds = (paper.FIG_12_SPEEDS_M_PER_S[0], paper.FIG_12_SPEEDS_M_PER_S[-1])
    curves = [id_curve("12", {"speed_m_per_s": speed, "distance_m": 2.5}) for speed in speeds]
    result = worst_accuracy(*curves)(tables, SEPARATED, 1.0)
    return replace(result, ours=f"ID read {result.ours}", lo=SEPARATED, hi=1.0)


def _spins_2d(distance_m: float, rpm: float) -> Curve:
    """Return the 2D markers of a single condition of Fig. 14, as a curve of one point."""
    return curve_2d("14", {"distance_m": distance_m, "rpm": rpm}).over("size_m")


STILL_8 = id_curve("08", {"current_ma": paper.FIG_8_CURRENTS_MA[1]}, "authors")
RPM_ID = [id_curve("14", {"distance_m": at}, "authors").over("rpm") for at in FIG_14_DISTANCES_M]
RPM_2D = [curve_2d("14", {"distance_m": at}).over("rpm") for at in FIG_14_DISTANCES_M]
SIZES_M = paper.FIG_10_SIZES_M
TESTS: dict[str, ClaimTest] = {
    "F8.1": worst_accuracy(MARKER_2D_8[STANDARD].narrowed(distance_m=NEAR)),
    "F8.2": worst_accuracy(MARKER_2D_8[STANDARD].narrowed(distance_m=(5.01, 1e3))),
    "F8.3": worst_accuracy(ID_8[STANDARD].narrowed(distance_m=(0, 20))),
    "F8.4": worst_accuracy(ID_8[HIGH].narrowed(distance_m=(0, 30))),
    "F8.5": range_rises(ID_8[LOW], ID_8[STANDARD], ID_8[HIGH]),
    "F8.6": range_rises(MARKER_2D_8[HIGH], MARKER_2D_8[STANDARD], MARKER_2D_8[LOW]),
    "F8.7": region_rises("b", "c"),
    "A1": longest_range(*ID_8.values()),
    "A2": worst_accuracy(MARKER_2D_8[STANDARD].narrowed(distance_m=2.5)),
    "F9.1": worst_accuracy(*(curve.narrowed(distance_m=NEAR) for curve in MARKER_2D_9[:2])),
    "F9.2": worst_accuracy(MARKER_2D_9[2]),
    "F9.3": worst_accuracy(ID_9[2].narrowed(distance_m=(0, 10))),
    "F9.4": range_rises(*ID_9[::-1]),
    "F9.5": region_ratio("b", "e"),
    "F10.1": worst_accuracy(MARKER_2D_10[2].narrowed(distance_m=(0, 7.5))),
    "F10.2": range_rises(*MARKER_2D_10),
    "F10.3": worst_accuracy(ID_10[2].narrowed(distance_m=(0, 40))),
    "F10.4": range_rises(*ID_10),
    "F10.5": longest_range(ID_10[0]),
    "F10.6": worst_accuracy(MARKER_2D_10[0].narrowed(distance_m=1.0)),
    "F10.7": region_exponent("fbg", [size_m**2 for size_m in SIZES_M]),
    "F11.0": worst_accuracy(id_curve("11", RED_OUTDOORS), curve_2d("11", RED_OUTDOORS)),
    "F11.1": worst_accuracy(*(curve.narrowed(distance_m=NEAR) for curve in (*ID_11, *MARKER_2D_11))),
    "F11.2": worst_accuracy(*(curve.narrowed(distance_m=20.0) for curve in ID_11)),
    "F11.3": most_different((ID_11[1], ID_8[STANDARD]), (MARKER_2D_11[1], MARKER_2D_8[STANDARD])),
    "F11.4": accuracy_at_noon,
    "F12.1": worst_accuracy(MARKER_2D_12[2].narrowed(distance_m=1.0)),
    "F12.2": worst_accuracy(MARKER_2D_12[2].narrowed(distance_m=2.5)),
    "F12.3": rises_at_each(*MARKER_2D_12[::-1]),
    "F12.4": worst_accuracy(ID_12[2].narrowed(distance_m=20.0)),
    "F12.5": rises_at_each(ID_12[2].narrowed(distance_m=NEAR), STILL_8.narrowed(distance_m=NEAR)),
    "F12.6": read_apart_from_wall,
    "F14.1": worst_accuracy(*(curve.narrowed(distance_m=(0, 1)) for curve in MARKER_2D_14)),
    "F14.2": least_favourable(
        rises_at_each(*RPM_2D[::-1]),
        accuracy_rises(*(curve.narrowed(distance_m=2.5) for curve in MARKER_2D_14[::-1])),
    ),
    "F14.3": worst_accuracy(MARKER_2D_14[2].narrowed(distance_m=2.5)),
    "F14.4": rises_at_each(*ID_14[::-1]),
    "F14.5": worst_accuracy(ID_14[2]),
    "F14.6": worst_accuracy(ID_14[0]),
    "F14.7": rises_at_each(*RPM_ID),
    "F14.8": region_rises("k", "j"),
}
"""The test of each claim; where a sentence leaves two readings open, that of its reading a."""
SECOND: dict[str, ClaimTest] = {
    "F8.3": longest_range(ID_8[STANDARD]),
    "F8.4": longest_range(ID_8[HIGH]),
    "F8.7": region_rises("a", "c"),
    "A1": longest_range(ID_8[STANDARD]),
    "A2": longest_range(MARKER_2D_8[STANDARD]),
    "F9.3": longest_range(ID_9[2]),
    "F9.5": region_ratio("e", "b"),
    "F10.5": longest_range(ID_10[0]),
    "F10.6": longest_range(MARKER_2D_10[0]),
    "F10.7": region_exponent("fbg", SIZES_M),
    "F12.3": least_favourable(rises_at_each(*MARKER_2D_12[::-1]), rises_at_each(*ID_12[::-1])),
    "F12.5": rises_at_each(ID_12[2].narrowed(distance_m=0.5), STILL_8.narrowed(distance_m=0.5)),
    "F14.2": accuracy_rises(_spins_2d(2.5, 64), _spins_2d(1.0, 32), _spins_2d(0.5, 16)),
    "F14.4": mean_rises(*ID_14[::-1]),
    "F14.7": mean_rises(*RPM_ID),
    "F14.8": least_favourable(
        region_rises("k", "j"), worst_accuracy(*(MARKER_2D_14[0].narrowed(distance_m=at) for at in (0.5, 2.5)))
    ),
}
"""The test of reading b, of the claims that have one."""
