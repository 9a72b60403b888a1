"""Does the link budget tell the truth?   distances -> its accuracy beside that of recordings"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from tqdm import tqdm

from bicode_lab.camera import record, truth_at
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_studies.link_budget.budget import link_budget
from bicode_studies.robustness.stressors import OPTICS, PERIOD_US, stress_scene
from bicode_studies.score import Periods, score
from bicode_studies.statistics import bootstrap

JUDGED = 15  # periods of each recording; one more comes first, so that tracks have begun


def recorded_accuracy(distance_m: float, seed: int) -> float:
    """A distance and a seed in, the share of periods with the right ID in one recording of the paper's marker out."""
    scene = stress_scene(distance_m, seed)
    events = record(scene, (JUDGED + 1) * PERIOD_US * 1e-6, np.random.default_rng([seed, 2]))
    settings = ReceiverSettings(width=OPTICS.width, height=OPTICS.height, detect_2d=False)
    sightings = recognise(events, settings, t0_us=0)
    rows = score(sightings, lambda t_us: truth_at(scene, t_us), Periods(start_us=PERIOD_US, count=JUDGED))
    return float(rows["id_right"].mean())


def budget_beside_recordings(distances_m: Sequence[float], seeds: int, seed: int = 0) -> pd.DataFrame:
    """Distances in; the budget's accuracy and that of recordings with its 95 % interval over seeds out, a row each.

    Returns
    -------
    DataFrame
        ``distance_m``, ``budget`` (expected), ``recorded``, ``low``, ``high``, ``events_on`` (of an edge).
    """
    rows = []
    for distance_m in tqdm(distances_m, desc="recordings", disable=None, leave=False):
        budget = link_budget(distance_m=distance_m, seed=seed)
        shares = np.array([recorded_accuracy(distance_m, seed * 1000 + number) for number in range(seeds)])
        low, high = bootstrap(shares, seeds * JUDGED, np.random.default_rng(seed))
        rows.append(
            {"distance_m": distance_m, "budget": budget.accuracy, "recorded": shares.mean(), "low": low, "high": high,
             "events_on": budget.events_on}
        )  # fmt: skip
    return pd.DataFrame(rows)
