"""The link budget beside the ranges that the paper states, and beside recordings of the paper's marker.

A distant marker is smaller than the lens's blur, and only the light that it sends counts: current times the visible
share of the face, over distance squared. So the range is proportional to the square root of that light.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab.camera import Optics, Pose
from bicode_lab.marker import Board
from bicode_lab.paper import RANGES
from bicode_studies.link_budget.budget import image_area_px, link_budget
from bicode_studies.paper_experiments.conditions import Condition, receiver_settings
from bicode_studies.paper_experiments.scenes import WINDOW_RECEIVER, window_scene
from bicode_studies.statistics import interval_over_seeds
from bicode_studies.trial import run

STEP, WIDEST = 1.25, 5.0  # of the search for a crossing: factor between two distances, largest factor from the guess
JUDGED_PERIODS = 15  # of each recording; one period comes before them, so that tracks have begun


def crossing_distance_m(function: Callable[[float], float], guess_m: float, level: float = 0.5) -> float:
    """Find the distance at which a falling function of distance crosses a level.

    The search goes from the guess in steps of a quarter, then halves the last step on a logarithmic scale until it is
    less than 3 %.

    Parameters
    ----------
    function : callable
        Takes a distance [m] and returns a number that falls with distance, such as the accuracy of a link budget.
    guess_m : float
        Where the search begins [m].
    level : float
        The level that is crossed.

    Returns
    -------
    float
        Distance [m].

    Raises
    ------
    ValueError
        If the function does not cross the level between a fifth of the guess and five times the guess.

    Examples
    --------
    >>> round(crossing_distance_m(lambda distance_m: 10 / distance_m, guess_m=30))
    20
    """
    low = high = guess_m
    if function(guess_m) >= level:
        while function(high := high * STEP) >= level and high < WIDEST * guess_m:
            low = high
    else:
        while function(low := low / STEP) < level and low > guess_m / WIDEST:
            high = low
    if not guess_m / WIDEST < low < high < WIDEST * guess_m:
        raise ValueError(
            f"the function does not fall through {level} between {low:g} and {high:g} m; give another guess_m"
        )
    while high / low > 1.03:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if function(middle) >= level else (low, middle)
    return float(np.sqrt(low * high))


def paper_ranges(seed: int = 0) -> pd.DataFrame:
    """Compute the ranges of the link budget under the five conditions for which the paper states one.

    The receiver is that of the reproduced figures, which drops small regions (`receiver_settings`).

    Parameters
    ----------
    seed : int
        Seed of the pixels' thresholds and noise.

    Returns
    -------
    DataFrame
        One row for each condition (``section``, ``current_ma``, ``size_m``, ``yaw_deg``): ``paper_m``; ``budget_m``,
        where half of the periods are expected to be right; ``share``, projected over face area at the paper's
        distance; ``light_ma``, current times share.
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
        budget_m = crossing_distance_m(accuracy, paper_m)
        light_ma = stated.current_ma * share
        rows.append(
            {"section": section, **condition, "paper_m": paper_m, "budget_m": budget_m, "share": share,
             "light_ma": light_ma}
        )  # fmt: skip
    return pd.DataFrame(rows)


def recorded_accuracy(distance_m: float, seed: int) -> float:
    """Return the share of periods with the right ID in one recording of the paper's marker.

    Parameters
    ----------
    distance_m : float
        Distance from camera to marker [m].
    seed : int
        Seed of the marker's payload, phase and place, and of the camera.

    Returns
    -------
    float
        0 .. 1, over `JUDGED_PERIODS` periods.
    """
    scene = window_scene(distance_m, seed)
    (row,) = run(scene, {"paper": WINDOW_RECEIVER}, periods=JUDGED_PERIODS, seed=seed, warm_up=1).to_dict("records")
    return float(row["id_right"] / row["periods"])


def budget_beside_recordings(distances_m: Sequence[float], seeds: int, seed: int = 0) -> pd.DataFrame:
    """Compare the accuracy that the link budget expects with that of recordings.

    Parameters
    ----------
    distances_m : sequence of float
        Distances from camera to marker [m].
    seeds : int
        Number of recordings at each distance.
    seed : int
        Seed of the budget, and of the recordings' seeds.

    Returns
    -------
    DataFrame
        One row for each distance: ``distance_m``; ``budget``, the expected accuracy; ``recorded``, the mean accuracy
        of the recordings, with ``low`` and ``high``, its 95 % interval over seeds; ``events_on``, the mean number of
        events of an ON edge.
    """
    rows = []
    for distance_m in tqdm(distances_m, desc="recordings", disable=None, leave=False):
        budget = link_budget(distance_m=distance_m, seed=seed)
        shares = np.array([recorded_accuracy(distance_m, seed * 1000 + number) for number in range(seeds)])
        low, high = interval_over_seeds(shares * JUDGED_PERIODS, np.full(seeds, JUDGED_PERIODS))
        rows.append(
            {"distance_m": distance_m, "budget": budget.accuracy, "recorded": shares.mean(), "low": low, "high": high,
             "events_on": budget.events_on}
        )  # fmt: skip
    return pd.DataFrame(rows)
