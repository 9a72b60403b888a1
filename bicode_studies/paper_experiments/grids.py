"""The experiments of section IV as grids: the conditions of each figure, and the seeds of each condition.

Distances are those of `DISTANCES_M` that lie in the figure's range in the paper. Each condition has about 200 periods,
as in the paper, spread over at least ten seeds. A seed has its own payload, phase of the packet, pixels and place
within a pixel and, where something moves, its own part of the pan or start of the turn. Far away a handful of pixels
decide, and they stay the same for a whole recording: seeds differ much and periods of one seed hardly. There a
condition has forty seeds of five periods each. All other values come from `constants.csv`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bicode_lab import paper
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.trial import PERIOD_S

DISTANCES_M = (0.5, 1.0, 2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0)
QUICK_M = (1.0, 2.5, 10.0, 20.0, 30.0)
PERIODS = 20  # of each seed; ten seeds make the paper's 200
FAR_M, FAR_PERIODS = 10.0, 5  # from this distance on there are more seeds, and each is shorter
SEEDS = 10
QUICK_PERIODS = 3
QUICK_SEEDS = 2
NOON_LUX = (10_000.0, 90_000.0)  # "tens of thousands" (IV-D)
SHORT_RANGE_M = 2.5  # last distance of Fig. 14


def conditions(figure: str, quick: bool = False) -> list[Condition]:
    """Return the conditions of a figure.

    Parameters
    ----------
    figure : str
        "08" .. "12" or "14".
    quick : bool
        True for the short grid: fewer distances, and fewer periods of each seed.

    Returns
    -------
    list of Condition
        All distances of the first setting, then those of the next.

    Raises
    ------
    ValueError
        If the figure has no grid.

    Examples
    --------
    >>> [condition.distance_m for condition in conditions("14") if condition.rpm == 16]
    [0.5, 1.0, 2.5]
    """
    if figure not in _GRIDS:
        raise ValueError(f"figure {figure!r} has no grid; choose one of {', '.join(_GRIDS)}")
    least, most, settings = _GRIDS[figure]
    distances = [d for d in (QUICK_M if quick else DISTANCES_M) if least <= d <= most]
    return [
        _with_duration(Condition(figure=figure, distance_m=distance, **setting), quick)
        for setting in settings
        for distance in distances
    ]


# Of each figure: the least and the largest distance [m], and what is set beside the distance.
_GRIDS: dict[str, tuple[float, float, tuple[dict[str, Any], ...]]] = {
    "08": (0.5, 50.0, tuple({"current_ma": current} for current in paper.FIG_8_CURRENTS_MA)),
    "09": (0.5, 35.0, tuple({"yaw_deg": yaw} for yaw in paper.FIG_9_YAWS_DEG)),
    "10": (
        0.5, 50.0,
        tuple(
            {"size_m": size_m, "current_ma": current_ma}
            for size_m, current_ma in zip(paper.FIG_10_SIZES_M, paper.FIG_10_CURRENTS_MA, strict=True)
        ),
    ),
    "11": (
        0.5, 50.0,
        (
            {"band": "red", "illuminance_lux": paper.EVENING_LUX},
            *(
                {"band": "infrared", "current_ma": paper.FIG_11_CURRENT_MA, "illuminance_lux": lux}
                for lux in (paper.OFFICE_LUX, paper.EVENING_LUX, *NOON_LUX)
            ),
        ),
    ),
    "12": (0.5, 25.0, tuple({"speed_m_per_s": speed} for speed in paper.FIG_12_SPEEDS_M_PER_S)),
    "14": (0.5, SHORT_RANGE_M, tuple({"rpm": rpm} for rpm in paper.FIG_14_SPEEDS_RPM)),
}  # fmt: skip
FIGURES = tuple(_GRIDS)


def _with_duration(condition: Condition, quick: bool) -> Condition:
    """Return the condition with the time that one seed of it is recorded."""
    periods = QUICK_PERIODS if quick else FAR_PERIODS if condition.distance_m >= FAR_M else PERIODS
    if condition.rpm and not quick:
        return replace(condition, duration_s=30 / condition.rpm)  # half a turn
    return replace(condition, duration_s=periods * PERIOD_S)


def seeds(condition: Condition, quick: bool = False) -> range:
    """Return the seeds of a condition.

    Parameters
    ----------
    condition : Condition
        Its `duration_s` decides how many seeds make about 200 periods.
    quick : bool
        True for `QUICK_SEEDS` seeds.

    Returns
    -------
    range
        From 0; at least `SEEDS` of them on the full grid.
    """
    if quick:
        return range(QUICK_SEEDS)
    return range(max(SEEDS, round(SEEDS * PERIODS * PERIOD_S / condition.duration_s)))
