"""Judge the claims by the trials of many sets of constants: inside or outside of the paper's bounds, set by set.

For a single set, a claim is judged by its value alone: inside if it lies within the bounds, widened by the band that
the claim itself has, or if an order goes the right way. Chance within a set is part of the spread over sets.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bicode_studies.calibration.candidates import NAMES, Candidate, candidate_of, other_constants
from bicode_studies.calibration.prior import candidates_at, prior_of_constants
from bicode_studies.claims.claim_result import ClaimResult, NoTrials
from bicode_studies.claims.figure_claims import SECOND, TESTS
from bicode_studies.claims.readings import Reading, readings_of
from bicode_studies.claims.verdicts import REPRODUCED, order_verdict, verdict
from bicode_studies.predictions.trials_of_set import FIGURES, FigureOfSet, run_figure_of_set, seeds_of
from bicode_studies.sweep.sweep import sweep
from bicode_studies.sweep.workers import Trial

PRIOR_SEED = 20261128  # of the sets of the prior
INSIDE, OUTSIDE, NO_VALUE = "inside", "outside", "no value"
COLUMNS = ["origin", "set", "weight", "claim", "reading", "value", "verdict"]


def sets_of_posterior(table: pd.DataFrame, n: int) -> list[tuple[Candidate, float]]:
    """Return the heaviest sets of a posterior with their weights.

    Parameters
    ----------
    table : DataFrame
        ``results/posterior.csv``.
    n : int
        Largest number of sets.

    Returns
    -------
    list of (Candidate, float)
        The weights sum to 1.
    """
    kept = table.sort_values("weight", ascending=False, kind="stable").head(n)
    weights = kept["weight"] / kept["weight"].sum()
    return [(candidate_of(row), float(w)) for row, w in zip(kept[[*NAMES]].to_dict("records"), weights, strict=True)]  # type: ignore[arg-type]


def sets_of_prior(n: int) -> list[tuple[Candidate, float]]:
    """Draw sets from the prior, each with the weight ``1 / n``.

    Parameters
    ----------
    n : int

    Returns
    -------
    list of (Candidate, float)
    """
    points = prior_of_constants().draw(n, np.random.default_rng(PRIOR_SEED))
    return [(candidate, 1 / n) for candidate in candidates_at(points)]


def predict(
    claims: pd.DataFrame,
    sets: Mapping[str, Sequence[tuple[Candidate, float]]],
    store: str | Path,
    *,
    figures: Sequence[str] = FIGURES,
    jobs: int | None = None,
    cluster: str | None = None,
) -> pd.DataFrame:
    """Run the figures with each set that the store lacks, and judge the claims.

    Parameters
    ----------
    claims : DataFrame
        ``data/paper_claims.csv``, all columns as text.
    sets : mapping of str to sequence of (Candidate, float)
        Sets with their weights, by origin ("posterior", "prior").
    store : path
        The file that finished figures are kept in.
    figures : sequence of str
        Those that are run; claims that need others are left out.
    jobs, cluster
        See `sweep.sweep`.

    Returns
    -------
    DataFrame
        One row for each set, claim and reading: `COLUMNS`; ``set`` is the number of the set among those of its origin.

    Raises
    ------
    RuntimeError
        If trials fail; the others are kept in the store.
    """
    asked = [trial for each in sets.values() for candidate, _ in each for trial in _trials(candidate, figures)]
    ran = sweep(run_figure_of_set, asked, store, jobs=jobs, cluster=cluster)
    if ran.failures:
        raise RuntimeError(ran.failure_line())
    rows: list[dict[str, Any]] = []
    for origin, each in sets.items():
        for number, (candidate, weight) in enumerate(each):
            of_set = sweep(run_figure_of_set, _trials(candidate, figures), store, jobs=jobs, cluster=cluster).table
            about = {"origin": origin, "set": number, "weight": weight}
            rows += [{**about, **row} for row in judge_set(claims, _tables(of_set))]
    return pd.DataFrame(rows, columns=COLUMNS)


def _trials(candidate: Candidate, figures: Sequence[str]) -> list[Trial]:
    """Return the trials of a set."""
    others = other_constants(NAMES)
    return [
        (FigureOfSet(figure=figure, candidate=candidate, others=others), seed)
        for figure in figures
        for seed in seeds_of(figure)
    ]  # fmt: skip


def _tables(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Split rows of trials by figure."""
    return {str(figure): table.reset_index(drop=True) for figure, table in rows.groupby("figure", sort=False)}


def judge_set(claims: pd.DataFrame, tables: Mapping[str, pd.DataFrame]) -> list[dict[str, Any]]:
    """Judge the claims about figures by the trials of one set.

    Parameters
    ----------
    claims : DataFrame
    tables : mapping of str to DataFrame
        Rows of trials by figure.

    Returns
    -------
    list of dict
        ``claim``, ``reading``, ``value`` (nan where there is none) and ``verdict`` (`INSIDE`, `OUTSIDE`, or
        `NO_VALUE` where the set makes no value, so that it is not inside).
    """
    rows = []
    for claim in claims.to_dict("records"):
        for reading in readings_of(claim):
            test = (TESTS if reading.name == "a" else SECOND).get(claim["id"])
            if test is None:
                continue
            try:
                result = test(tables, reading.lo, reading.hi)
            except NoTrials:
                continue
            value = math.nan if result.value is None else float(result.value)
            rows.append({"claim": claim["id"], "reading": reading.name, "value": value,
                         "verdict": verdict_of_value(result, reading)})  # fmt: skip
    return rows


def verdict_of_value(result: ClaimResult, reading: Reading) -> str:
    """Tell whether the value of a result is inside the bounds of a reading.

    Parameters
    ----------
    result : ClaimResult
    reading : Reading

    Returns
    -------
    str
        `INSIDE`, `OUTSIDE` or `NO_VALUE`.
    """
    value = result.value
    if value is None or math.isnan(value):
        return NO_VALUE
    if result.is_order:
        found = order_verdict(value, value, bool(result.broken))
    else:
        above, below = reading.lo_open, reading.hi_open
        found = verdict(
            value, value, *result.bounds(reading.lo, reading.hi), above=above, below=below, band=result.band
        )
    return INSIDE if found == REPRODUCED else OUTSIDE


def shares(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the weighted share of sets that are inside, for each claim and reading.

    Parameters
    ----------
    predictions : DataFrame
        As `predict` returns it.

    Returns
    -------
    DataFrame
        ``claim``, ``reading``, and a column for each origin, 0 .. 1.
    """
    inside = predictions.assign(inside=(predictions["verdict"] == INSIDE) * predictions["weight"])
    sums = inside.groupby(["claim", "reading", "origin"], sort=False)[["inside", "weight"]].sum()
    return (sums["inside"] / sums["weight"]).unstack("origin").reset_index()
