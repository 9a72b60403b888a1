"""Tests of ``bicode decode``: its help, the options for the pose, and the misuse of files of one light."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["decode", "nowhere.mat", "--line-code", "uart", "--rate-hz", "504"], "nowhere.mat"),
        (["decode", "{file}", "--line-code", "uart"], "--rate-hz"),
        (["decode", "{file}"], "--line-code uart"),
        (["decode", "{broken}", "--line-code", "uart", "--rate-hz", "504"], "event_t"),
        (["decode", "{other}", "--line-code", "uart", "--rate-hz", "504"], "polarities"),
    ],
)
def test_misuse_of_a_uart_light_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    names = {name: tmp_path / f"{name}.mat" for name in ("file", "broken", "other")}
    savemat(names["file"], {"event": [1.0, -1.0], "event_t": [0.1, 0.2]})
    names["broken"].write_bytes(names["file"].read_bytes()[:150])
    savemat(names["other"], {"event": [1.0, 0.0], "event_t": [0.1, 0.2]})
    with pytest.raises(SystemExit) as ended:
        main([a.format(**names) for a in arguments])
    captured = capsys.readouterr()
    assert ended.value.code == 2
    assert captured.err.count("\n") == 1
    assert words in captured.err


def test_a_camera_that_is_not_used_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "camera.yaml"
    file.write_text("K: [1646.09, 0, 639.5, 0, 1646.09, 359.5, 0, 0, 1]\n", encoding="utf-8")
    said = []
    for receiver in ("soft", "paper"):
        with pytest.raises(SystemExit):
            main(["decode", str(NEAR), "--receiver", receiver, "--camera", str(file)])
        said.append("--camera is for poses, and --receiver soft gives none" in capsys.readouterr().err)
    assert said == [True, False]
