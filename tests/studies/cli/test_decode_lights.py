"""``bicode decode`` reads the interval code and frequencies, and says what light it is where nothing was read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.lights.waveform import ChipWaveform, constant_frequency
from bicode_lab.recordings.writer import write_recording
from bicode_studies.cli.main import main
from bicode_studies.light_kinds.plate import SAMPLE_US, Sensor, see

NUMBER, RATE_HZ, LED_HZ = 165, 2000, 430


@pytest.fixture(scope="module")
def two_lights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One light sends a number by the interval code, the other has its own frequency."""
    word = ChipWaveform(chips=IntervalLine(rate_hz=RATE_HZ).encode(NUMBER), chip_us=1e6 / RATE_HZ)
    parts = []
    for k, waveform in enumerate((word, constant_frequency(LED_HZ))):
        times, levels = waveform.steps(0, 160_000)
        level = levels[np.searchsorted(times, np.arange(0, 160_000, SAMPLE_US), side="right") - 1]
        part = see(level, Sensor(n_pixels=64, events_per_edge=100), np.random.default_rng(k))
        part["x"] += 50 + 100 * k
        part["y"] += 50
        parts.append(part)
    both = np.concatenate(parts)
    both = both[np.argsort(both["t"], kind="stable")]
    path = tmp_path_factory.mktemp("lights") / "two.npz"
    write_recording(path, make_events(both["x"], both["y"], both["p"], both["t"]), width=320, height=240)
    return path


def call(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(words)
    return int(ended.value.code or 0)


def rows_of(path: Path, line_code: str, capsys: pytest.CaptureFixture[str], *more: str) -> list[dict[str, object]]:
    assert call("decode", str(path), "--line-code", line_code, "--format", "jsonl", *more) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


@pytest.mark.parametrize("more", [(), ("--rate-hz", str(RATE_HZ))])
def test_a_number_is_read_and_the_other_light_is_not(
    two_lights: Path, more: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    rows = rows_of(two_lights, "interval", capsys, *more)
    left = [row for row in rows if int(str(row["x"])) < 100]
    assert len(left) == len(rows) / 2 == 3
    assert {row["value"] for row in left} == {NUMBER}
    assert {(row["value"], row["reason"]) for row in rows if row not in left} == {(None, "other_light")}


def test_a_frequency_is_read(two_lights: Path, capsys: pytest.CaptureFixture[str]) -> None:
    right = [row for row in rows_of(two_lights, "frequency", capsys) if int(str(row["x"])) > 100]
    assert all(abs(float(str(row["rate_hz"])) - LED_HZ) < 1 for row in right)
    assert {row["reason"] for row in right} == {None}


def test_where_nothing_was_read_each_light_is_named(two_lights: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (("decode", str(two_lights), "--find"), ("inspect", str(two_lights))):
        assert call(*words) == 0
        said = "".join(capsys.readouterr())
        assert "--line-code interval --rate-hz 2000" in said
        assert "--line-code frequency" in said


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("--line-code", "frequency", "--rate-hz", "5"), "leave it out"),
        (("--line-code", "interval", "--packets"), "--packets is for Bicode"),
        (("--line-code", "interval", "--rate-hz", "0"), "rate_hz=0"),
    ],
)
def test_misuse_is_one_line(
    words: tuple[str, ...], answer: str, two_lights: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("decode", str(two_lights), *words) == 2
    assert answer in capsys.readouterr().err
