"""Plain lines are read as all others are: the same events and the same errors, whatever the lines say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bicode_lab.recordings import RecordingError, open_recording
from bicode_lab.recordings.text import lines as module

ODD = ["", "12,3,1", "1,2,3,4", " 5,6,1,70", "+5,6,1,80", "5,6,true,90", "5,6,0,1e2", "9" * 19 + ",6,1,7", "5,6,-1,99",
       "-5,6,1,100", "a,b,c,d", "5,6,1,1000,extra", "5,6,1,", "5,,1,7", "5;6;1;7", "5,6,1,70\r"]  # fmt: skip


def outcome(path: Path, lenient: bool) -> tuple[object, ...]:
    """Return all that a reading of a file tells."""
    try:
        recording = open_recording(path, width=640, height=480, lenient=lenient)
        return ([event for part in recording for event in part.tolist()], recording.dropped, recording.remarks)
    except RecordingError as error:
        return (str(error),)


@pytest.mark.parametrize("lenient", [False, True])
@pytest.mark.parametrize("head", ["x,y,p,t\n", "", "t,p,y,x\n", "x,y,p,t,more\n"])
def test_any_lines_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, head: str, lenient: bool) -> None:
    path = tmp_path / "a.csv"
    monkeypatch.setattr(module, "_CLOSER_BYTES", 40)
    n_good = n_bad = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        t = np.sort(rng.integers(0, 5000, 200))
        rows = np.stack([rng.integers(0, 640, 200), rng.integers(0, 480, 200), rng.integers(0, 2, 200), t], axis=1)
        if head.startswith("t"):
            rows = rows[:, ::-1]
        text = [",".join(map(str, row)) for row in rows.tolist()]
        for _ in range(int(rng.integers(0, 3))):
            text.insert(int(rng.integers(0, 200)), ODD[int(rng.integers(0, len(ODD)))])
        end = "\r\n" if seed % 3 == 0 else "\n"
        path.write_bytes((head + end.join(text) + (end if seed % 2 else "")).encode())
        fast = outcome(path, lenient)
        with monkeypatch.context() as other:
            other.setattr(module, "_plain", lambda data, layout, rows: (0, 0))
            other.setattr(module, "_CLOSER_BYTES", 1 << 20)
            assert outcome(path, lenient) == fast, seed
        n_good, n_bad = n_good + (len(fast) > 1), n_bad + (len(fast) == 1)
    assert n_good >= 10
    assert lenient or n_bad >= 10
