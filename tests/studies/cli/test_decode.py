"""Tests of ``bicode decode``: its help, and the options for the pose."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bicode_studies.cli.main import main

NEAR = Path(__file__).resolve().parents[3] / "data" / "near_1m.npz"


def positions_m(capsys: pytest.CaptureFixture[str], *options: str) -> np.ndarray[Any, Any]:
    """Return the positions of the 2D marker that are read from a shipped recording, shape (n, 3) [m]."""
    with pytest.raises(SystemExit) as ended:
        main(["decode", str(NEAR), "--format", "jsonl", *options])
    assert ended.value.code == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    return np.array([row["tvec"] for row in rows if row["tvec"] is not None])


def test_focal_length_and_size_scale_the_distance(capsys: pytest.CaptureFixture[str]) -> None:
    plain = positions_m(capsys)
    assert len(plain) == 2
    assert plain[:, 2] == pytest.approx(1.0, rel=0.05)
    assert positions_m(capsys, "--focal-px", str(2 * 1646.09))[:, 2] == pytest.approx(2 * plain[:, 2], rel=0.01)
    assert positions_m(capsys, "--size-m", "0.15") == pytest.approx(3 * plain, rel=0.01, abs=1e-6)


def test_help_lists_one_reason_per_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["decode", "--help"])
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if line.strip()]
    first_words = [words[0] for words in lines]
    start = first_words.index("no_events")
    assert first_words[start : start + 6] == ["no_events", "no_start", "cut", "manchester", "checksum", "conflict"]
