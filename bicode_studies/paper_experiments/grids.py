"""IV: the paper's experiments as declared grids.   figure -> conditions; condition -> seeds

Distances are those of DISTANCES_M, each figure's clipped to the paper's range. A condition has about 200 periods,
spread over at least ten seeds; a seed has its own payload, phase, pixels, sub-pixel place and, where something
moves, its own stretch of the pan or start of the turn. Far away a handful of pixels at one place between them
decide, so that no two seeds are alike and their periods are; there it is forty seeds of five periods. Everything
else comes from `constants.csv`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bicode_lab import paper
from bicode_studies.paper_experiments.scenes import Condition
from bicode_studies.paper_experiments.trial_rows import run_trial

__all__ = ["Condition", "conditions", "run_trial", "seeds"]

DISTANCES_M = (0.5, 1.0, 2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0)
QUICK_M = (1.0, 2.5, 10.0, 20.0, 30.0)
PERIOD_S = paper.DELTA_T_WHOLE_US * 1e-6
PERIODS = 20  # of a seed; ten seeds make the paper's 200
FAR_M, FAR_PERIODS = 10.0, 5  # from here on it is more seeds, each shorter
SEEDS = 10
QUICK_PERIODS = 3
QUICK_SEEDS = 2
NOON_LUX = (10_000.0, 90_000.0)  # "tens of thousands" (IV-D)
SHORT_RANGE_M = 2.5  # Fig. 14 ends here


def conditions(figure: str, quick: bool = False) -> list[Condition]:
    """A figure, "08" .. "14", and a scale in; its grid out.

    Raises
    ------
    ValueError
        A figure without a grid.
    """
    if figure not in _GRIDS:
        raise ValueError(f"figure {figure!r} has no grid; choose one of {', '.join(_GRIDS)}")
    least, most, settings = _GRIDS[figure]
    distances = [d for d in (QUICK_M if quick else DISTANCES_M) if least <= d <= most]
    return [
        _timed(Condition(figure=figure, distance_m=distance, **setting), quick)
        for setting in settings
        for distance in distances
    ]


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


def _timed(condition: Condition, quick: bool) -> Condition:
    """A condition with the time that one seed of it is recorded."""
    periods = QUICK_PERIODS if quick else FAR_PERIODS if condition.distance_m >= FAR_M else PERIODS
    if condition.rpm and not quick:
        return replace(condition, duration_s=30 / condition.rpm)  # half a turn
    return replace(condition, duration_s=periods * PERIOD_S)


def seeds(condition: Condition, quick: bool = False) -> range:
    """A condition in, the seeds that it is tried with out: at least ten, and about 200 periods together."""
    if quick:
        return range(QUICK_SEEDS)
    return range(max(SEEDS, round(SEEDS * PERIODS * PERIOD_S / condition.duration_s)))
