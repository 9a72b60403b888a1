"""The search for the constants: when a candidate is given up, and in which order candidates are tried."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from bicode_studies.calibration import search as calibration
from bicode_studies.calibration.candidates import (
    Candidate,
)
from bicode_studies.calibration.cells import CELLS, Cell, cell_name
from bicode_studies.calibration.search import FIRST_SEED, calibrate, try_candidate
from bicode_studies.sweep.sweep import Sweep

PLAIN = Candidate(
    led_to_ambient=0.8, blur_px=0.9, halo_fraction=0.03, time_constant_us=150.0, aruco_id=17, min_region_pixels=3
)


def test_a_candidate_that_lacks_too_much_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[Cell] = []

    def reads(_: Candidate, cell: Cell, seeds: range) -> float:
        tried.append(cell)
        assert seeds == range(FIRST_SEED + 2 * len(seeds), FIRST_SEED + 3 * len(seeds))
        assert len(seeds) == calibration.SEEDS[cell[0]]
        return CELLS[cell] if cell[0] == "ID" else 0.0

    monkeypatch.setattr(calibration, "cell_accuracy", reads)
    (row,) = try_candidate(PLAIN, 2)
    last = ("2D", 10.7, 2.5)
    assert tried[-1] == last
    assert tried == list(CELLS)[: len(tried)]
    assert row["ID 10.7 mA 20 m"] == 1.0
    assert row[cell_name(last)] == 0.0
    assert "2D 10.7 mA 5 m" not in row


def test_the_search_goes_on_from_the_best_and_judges_them_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[tuple[Candidate, int]] = []

    def run(_: object, trials: list[tuple[Candidate, int]], *__: object, **___: object) -> Sweep:
        asked.extend(trials)
        rows: list[dict[str, Any]] = []
        for candidate, block in trials:
            plate = max(0.0, 1 - abs(candidate.blur_px - 1.0)) * (1.0 if block == 0 else 0.9)
            cells = {**{cell_name(cell): accuracy for cell, accuracy in CELLS.items()}, "2D 10.7 mA 2.5 m": plate}
            rows.append({**vars(candidate), **cells})
        return Sweep(table=pd.DataFrame(rows))

    monkeypatch.setattr(calibration, "sweep", run)
    table = calibrate(tmp_path / "none.sqlite", jobs=1, draws=30)
    n = 30 + len(calibration.EARLIER)
    near, best = calibration.ROUNDS * calibration.BEST * calibration.NEIGHBOURS, calibration.LAST
    assert [block for _, block in asked] == [0] * (n + near) + list(calibration.AGAIN) * best
    assert len(table) == n + near
    assert list(table["blocks"][: best + 1]) == [4] * best + [1]
    first = table[table["blocks"] == 4]
    assert first["sum"].is_monotonic_increasing
    assert abs(first["blur_px"].iloc[0] - 1.0) == (table["blur_px"] - 1.0).abs().min()
    assert first["2D 10.7 mA 2.5 m"].max() <= 0.9  # of the last round alone
