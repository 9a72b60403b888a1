"""Simulated coverage of the interval over seeds. ``python -m tests.studies.statistics.coverage`` writes its table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from tqdm import tqdm

from bicode_studies.statistics.seeds import interval_over_seeds, probability_up_to

TABLE = Path(__file__).with_name("coverage.csv")
REPEATS = 1000
ACCURACIES = (0.005, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.9, 0.995)  # the interval is the same seen from the other side
CORRELATIONS = (0.0, 0.02, 0.1, 0.3, 0.6, 0.9, 0.98)
SEEDS, PERIODS = (10, 20, 40), (5, 20, 200)
Counts = npt.NDArray[np.int64]


def by_degrees(m: int, n: int, accuracy: float, rho: float, repeats: int, rng: np.random.Generator) -> Counts:
    """Draw right periods of m seeds whose shares are beta distributed."""
    if rho == 0:
        return rng.binomial(n, accuracy, (repeats, m))
    total = 1 / rho - 1
    return rng.binomial(n, rng.beta(accuracy * total, (1 - accuracy) * total, (repeats, m)))


def all_or_nothing(m: int, n: int, accuracy: float, rho: float, repeats: int, rng: np.random.Generator) -> Counts:
    """Draw right periods of m seeds that are all right or all wrong with probability rho, else independent."""
    whole = rng.random((repeats, m)) < rho
    return np.where(whole, n * rng.binomial(1, accuracy, (repeats, m)), rng.binomial(n, accuracy, (repeats, m)))


WORLDS: dict[str, Callable[..., Counts]] = {"by degrees": by_degrees, "all or nothing": all_or_nothing}


def misses(world: str, m: int, n: int, accuracy: float, rho: float, repeats: int, seed: int) -> tuple[float, float]:
    """Return how often the accuracy lies below and above the 95 % interval, as shares of all repeats.

    Whether an accuracy is inside is seen from the tail probability at that accuracy, without finding the ends.
    """
    none, periods = interval_over_seeds(np.zeros(m), np.full(m, n))[1], np.full(m, float(n))
    rng = np.random.default_rng([seed, m, n, round(1000 * accuracy), round(1000 * rho), len(world)])
    drawn = np.sort(WORLDS[world](m, n, accuracy, rho, repeats, rng), axis=1)
    rows, times = np.unique(drawn, axis=0, return_counts=True)
    tails = np.array([probability_up_to(row.astype(float), periods)(accuracy) for row in rows])
    below = times[(tails > 0.975) & (accuracy < 1 - none)].sum()
    above = times[(tails < 0.025) & (accuracy > none)].sum()
    return float(below / repeats), float(above / repeats)


def coverage_table() -> pd.DataFrame:
    """Return the coverage of every condition: the share of intervals that hold the true accuracy."""
    cases = [
        (world, m, n, accuracy, rho)
        for world in WORLDS for m in SEEDS for n in PERIODS for rho in CORRELATIONS for accuracy in ACCURACIES
        if rho or world == "by degrees"
    ]  # fmt: skip
    rows = [(*case, *misses(*case, REPEATS, 0)) for case in tqdm(cases, disable=None)]
    table = pd.DataFrame(rows, columns=["world", "seeds", "periods", "accuracy", "rho", "below", "above"])
    return table.assign(coverage=1 - table["below"] - table["above"]).round(4)


if __name__ == "__main__":
    coverage_table().to_csv(TABLE, index=False)
