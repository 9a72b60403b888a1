"""The calibration: the search for the free constants, which are fitted to Fig. 8 and to nothing else (IV-A).

Free are the brightness of the LED, the blur of the lens and its halo, the speed of a pixel, the pattern of the plate,
and the minimum size of a region. The search was laid down here before any result was seen:

    1. `DRAWS` candidates are drawn, each constant uniformly from its range in `constants.csv`. `EARLIER` is added, the
       best candidate of each pattern in an earlier search.
    2. Around each of the `BEST` candidates, `NEIGHBOURS` more are drawn, with a standard deviation of a tenth of the
       range. This is done `ROUNDS` times.
    3. The `LAST` best are tried again, with other seeds and four times as many. The one with the least misfit is taken.

A candidate is tried on the cells of `cells.CELLS`, over the accumulation times of the experiments, with seeds that no
figure uses. While the search runs, ranges get a margin, so that it stays in the middle of what agrees with the paper.
The last round is judged by the claims' own bounds, as `claims` does. A candidate whose misfit passes `GIVE_UP` is not
tried on the remaining cells.

Other searches came before this one. Without a minimum region size, none of 90 candidates had a misfit below 0.6: an LED
so faint that its ID ends at 20 m left holes in the near plate at half of the current, where the paper reads it best.
With a larger opening in its place (3 .. 5 px), the best of 1,300 had a misfit of 0.6, nearly all of it in F8.4: an
opening removes small regions rather than faint ones, so the brighter marker was lost at 30 m. With a margin of 0.2 the
ID's range depended on the seeds. With the margin in the last round as well, three patterns had the same misfit, and the
first was the one whose plate was lost most often at 2.5 m, where the paper says 100 %: a margin that the paper does not
state had outweighed a number that it states.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bicode_studies.calibration.candidates import (
    EARLIER,
    NAMES,
    Candidate,
    candidate_of,
    draw_candidates,
    draw_neighbours,
)
from bicode_studies.calibration.cells import CELLS, MARGIN, Cell, cell_accuracy, cell_name, misfit
from bicode_studies.sweep.sweep import sweep

DRAWS, BEST, NEIGHBOURS, ROUNDS = 500, 8, 5, 2
SEEDS = {"ID": 8, "2D": 4}  # of a cell, each time that a candidate is tried; far away seeds differ much
FIRST_SEED = 1000  # figures use lower seeds
LAST, AGAIN = 8, (1, 2, 3, 4)  # how many are tried again, with these blocks of seeds
GIVE_UP = 1.0


def try_candidate(candidate: Candidate, seed: int) -> list[dict[str, Any]]:
    """Try a candidate on the cells, in the order of `CELLS`, until its misfit passes `GIVE_UP`.

    Parameters
    ----------
    candidate : Candidate
    seed : int
        Number of the block of seeds, 0 or more.

    Returns
    -------
    list of dict
        One row: the constants, and the accuracy in each cell that was tried, by `cell_name`.
    """
    found: dict[Cell, float] = {}
    for cell in CELLS:
        many = SEEDS[cell[0]]
        first = FIRST_SEED + seed * many
        found[cell] = cell_accuracy(candidate, cell, range(first, first + many))
        if misfit(found)["sum"] > GIVE_UP:
            break
    return [{**vars(candidate), **{cell_name(cell): accuracy for cell, accuracy in found.items()}}]


def calibrate(store: str | Path, jobs: int, draws: int = DRAWS) -> pd.DataFrame:
    """Search for the constants with the least misfit.

    Parameters
    ----------
    store : path
        The file that finished candidates are kept in.
    jobs : int
        Number of candidates that are tried at the same time.
    draws : int
        Number of candidates in the first round.

    Returns
    -------
    DataFrame
        One row for each candidate, the best first, those of the last round before the others: the constants;
        ``blocks``, the number of blocks of seeds that it was tried with; its accuracy in each cell (nan where it was
        given up before); the misfit of each claim, and ``sum``.

    Raises
    ------
    RuntimeError
        If candidates failed; the others are kept in the store.
    """
    rng = np.random.default_rng(0)
    once = _candidate_rows([*draw_candidates(draws, rng), *EARLIER], (0,), store, jobs)
    for _ in range(ROUNDS):
        near = [one for best in _best(once, BEST) for one in draw_neighbours(best, NEIGHBOURS, rng)]
        once = pd.concat([once, _candidate_rows(near, (0,), store, jobs)], ignore_index=True).drop_duplicates([*NAMES])
    again = _candidate_rows(_best(once, LAST), AGAIN, store, jobs, margin=0.0)
    left = once.merge(again[[*NAMES]], on=[*NAMES], how="left", indicator=True)["_merge"] == "left_only"
    return pd.concat([_sorted(again), _sorted(once[left.to_numpy()])], ignore_index=True)


def candidate_row(candidate: Candidate, store: str | Path, jobs: int) -> pd.DataFrame:
    """Try one candidate as in the last round of `calibrate`.

    Parameters
    ----------
    candidate : Candidate
    store : path
        The file that finished blocks are kept in.
    jobs : int
        Number of blocks of seeds that are tried at the same time.

    Returns
    -------
    DataFrame
        One row, with the columns of `calibrate`.
    """
    return _candidate_rows([candidate], AGAIN, store, jobs, margin=0.0)


def _candidate_rows(
    candidates: list[Candidate], blocks: tuple[int, ...], store: str | Path, jobs: int, margin: float = MARGIN
) -> pd.DataFrame:
    """Try each candidate with these blocks of seeds and return its means over the blocks and its misfit."""
    trials = [(candidate, block) for candidate in candidates for block in blocks]
    result = sweep(try_candidate, trials, store, jobs=jobs, data_files=("bicode_lab/constants.csv",))
    if result.failures:
        raise RuntimeError(result.failure_line())
    rows = []
    for values, group in result.table.groupby([*NAMES], sort=False):
        found = {cell: group[cell_name(cell)].mean() for cell in CELLS if cell_name(cell) in group}
        known = {cell: float(accuracy) for cell, accuracy in found.items() if not np.isnan(accuracy)}
        by_name = {cell_name(cell): known.get(cell, np.nan) for cell in CELLS}
        constants = dict(zip(NAMES, values, strict=True))
        rows.append({**constants, "blocks": len(blocks), **by_name, **misfit(known, margin)})
    return pd.DataFrame(rows)


def _sorted(table: pd.DataFrame) -> pd.DataFrame:
    """Sort the rows: those with the most cells first and, among these, those with the least misfit."""
    missing = table.isna().sum(axis=1)
    return table.assign(missing=missing).sort_values(["missing", "sum"], kind="stable").drop(columns="missing")


def _best(table: pd.DataFrame, n: int) -> list[Candidate]:
    """Return the `n` best candidates of a table."""
    return [candidate_of(row) for row in _sorted(table).head(n)[[*NAMES]].to_dict("records")]  # type: ignore[arg-type]
