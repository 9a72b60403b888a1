"""Progress is shown on a terminal, after two seconds, and leaves nothing behind."""

from __future__ import annotations

import io
import sys
import time
import types
from pathlib import Path

import pytest

from bicode_lab.recordings import open_recording
from bicode_studies.cli.helpers import progress
from bicode_studies.cli.helpers.progress import chunks_with_progress, waiting

NEAR = Path(__file__).resolve().parents[4] / "data" / "far_10m.npz"


class Screen(io.StringIO):
    """Standard error that says whether it is a terminal."""

    def __init__(self, terminal: bool) -> None:
        super().__init__()
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


@pytest.mark.parametrize(("terminal", "takes_s"), [(True, 0.4), (True, 0.0), (False, 0.4)])
def test_waiting_is_told_where_it_is_seen_and_long(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, takes_s: float
) -> None:
    monkeypatch.setattr(progress, "DELAY_S", 0.1)
    screen = Screen(terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    with waiting("counting"):
        time.sleep(takes_s)
    said = screen.getvalue()
    assert ("\rcounting: 0 s" in said) == (terminal and takes_s > 0)
    assert said == "" or said.endswith(" \r")  # the line is cleared


def test_waiting_ends_with_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "DELAY_S", 0.05)
    screen = Screen(True)
    monkeypatch.setattr(sys, "stderr", screen)

    def fail() -> None:
        with waiting("counting"):
            time.sleep(0.2)
            raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fail()
    length = len(screen.getvalue())
    time.sleep(0.2)
    assert len(screen.getvalue()) == length


@pytest.mark.parametrize("terminal", [True, False])
def test_a_recording_shows_how_far_it_is(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    monkeypatch.setattr(progress, "DELAY_S", 0.0)
    screen = Screen(terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    recording = open_recording(NEAR)
    sizes = 0
    for chunk in chunks_with_progress(recording):
        sizes += chunk.size
        time.sleep(0.15)
    assert sizes == recording.read().size
    assert (" events" in screen.getvalue()) == terminal
    assert ("0.1 s" in screen.getvalue() or "0.2 s" in screen.getvalue()) == terminal


def test_what_a_recording_remarks_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    whole = list(open_recording(NEAR).chunks())
    recording = types.SimpleNamespace(remarks=["one"], chunks=lambda: iter(whole), path=NEAR)
    for chunk in chunks_with_progress(recording):  # type: ignore[arg-type]
        assert chunk.size
        recording.remarks = ["one", "two"]
    assert [line.rsplit(": ")[-1] for line in capsys.readouterr().err.splitlines()] == ["one", "two"]
