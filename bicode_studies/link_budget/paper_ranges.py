"""How far does an ID carry?   conditions of the paper -> its ranges beside those of the link budget

Far away a marker is smaller than the lens's blur, and only the light it sends counts: current times
the share of the face that is seen, over distance squared. So ranges go as the root of that light.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from bicode_lab.camera import Optics, Pose
from bicode_lab.marker import Board
from bicode_lab.paper import RANGES
from bicode_studies.link_budget.budget import image_area_px, link_budget
from bicode_studies.paper_experiments.scenes import Condition
from bicode_studies.paper_experiments.trial_rows import receiver_settings

STEP, WIDEST = 1.25, 5.0  # of the search for a range


def range_m(of: Callable[[float], float], guess_m: float, share: float = 0.5) -> float:
    """A falling function of distance [m], such as accuracy, in; the distance at which it crosses `share` out [m].

    Walks from the guess in steps of a quarter, then halves the last step's logarithm to 3 %.

    Raises
    ------
    ValueError
        Where it does not cross between a fifth of the guess and five times it.

    Examples
    --------
    >>> round(range_m(lambda distance_m: 10 / distance_m, guess_m=30))
    20
    """
    low = high = guess_m
    if of(guess_m) >= share:
        while of(high := high * STEP) >= share and high < WIDEST * guess_m:
            low = high
    else:
        while of(low := low / STEP) < share and low > guess_m / WIDEST:
            high = low
    if not guess_m / WIDEST < low < high < WIDEST * guess_m:
        raise ValueError(f"it does not fall through {share} between {low:g} and {high:g} m; give another guess_m")
    while high / low > 1.03:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if of(middle) >= share else (low, middle)
    return float(np.sqrt(low * high))


def paper_ranges(seed: int = 0) -> pd.DataFrame:
    """Nothing but a seed in; the paper's five ranges beside those of the budget out, a row each.

    The receiver is that of the reproduced figures: it drops small regions (`trials.receiver_settings`).

    Returns
    -------
    DataFrame
        Condition (``section``, ``current_ma``, ``size_m``, ``yaw_deg``), ``paper_m``, ``budget_m`` (half of the
        periods right), ``share`` (projected over face area there) and ``light_ma`` (current times share).
    """
    receiver = receiver_settings(Condition(figure="08", distance_m=1.0))
    rows = []
    for stated in RANGES:
        condition = stated._asdict()
        section, paper_m = condition.pop("section"), condition.pop("distance_m")

        def accuracy(distance_m: float, condition: dict[str, float] = condition) -> float:
            budget = link_budget(**condition, distance_m=distance_m, receiver=receiver, seed=seed)  # type: ignore[arg-type]
            return budget.accuracy

        board = Board(size_m=stated.size_m)
        area_px = image_area_px(board, Pose.facing(paper_m, yaw_deg=stated.yaw_deg), Optics())
        share = area_px / (stated.size_m * Optics().focal_px / paper_m) ** 2
        budget_m = range_m(accuracy, paper_m)
        light_ma = stated.current_ma * share
        rows.append(
            {"section": section, **condition, "paper_m": paper_m, "budget_m": budget_m, "share": share,
             "light_ma": light_ma}
        )  # fmt: skip
    return pd.DataFrame(rows)
