"""Tests of `bicode decode`: standard input, external triggers, remarks, and a light whose times have another unit."""

import csv
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bad_files import evt3
from click.testing import CliRunner
from make_files import SIZE_PX, write_bag, write_text_with_size

from bicode_lab.events import make_events
from bicode_studies.cli.decode import decode

EVENTS = make_events(np.arange(200), np.arange(200), np.arange(200) % 2, 100 * np.arange(200))


def test_external_triggers_are_listed(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(evt3(0x8001, 0x6010, 0xA101, 0x0005, 0x2001, 0x6011, 0xA000))
    done = CliRunner().invoke(decode, [str(path), "--triggers", "--format", "csv"])
    assert list(csv.DictReader(io.StringIO(done.stdout))) == [
        {"t_us": "4112", "input": "1", "level": "1"},
        {"t_us": "4113", "input": "0", "level": "0"},
    ]
    done = CliRunner().invoke(decode, [str(path)])
    assert f"{path}: 2 external triggers (bicode decode --triggers lists them)\n" in done.stderr


def test_a_remark_on_the_clock_comes_once_and_the_table_all_the_same(tmp_path):
    path = tmp_path / "a.npz"
    n = 1000
    np.savez(path, x=np.zeros(n), y=np.zeros(n), p=np.zeros(n), t=2_500 * np.arange(n), width=9, height=9)
    done = CliRunner().invoke(decode, [str(path)])
    assert done.exit_code == 0
    assert done.stderr.count("nothing blinks at such a rate") == 1


@pytest.mark.parametrize("name", ["a.txt", "a.mcap", "a.bag"])
def test_standard_input(tmp_path, name):
    (write_text_with_size if name == "a.txt" else write_bag)(tmp_path / name, EVENTS)
    script = """from bicode_lab.recordings import open_recording
recording = open_recording("-")
print(recording.read().size, recording.width, recording.path.parent)"""
    with (tmp_path / name).open("rb") as file:
        done = subprocess.run([sys.executable, "-c", script], stdin=file, capture_output=True, text=True)
    size, width, folder = done.stdout.split()
    assert (int(size), int(width)) == (EVENTS.size, SIZE_PX[0])
    assert not Path(folder).exists(), "the copy is removed"


def test_an_empty_standard_input():
    script = "from bicode_lab.recordings import open_recording; open_recording('-')"
    done = subprocess.run([sys.executable, "-c", script], input="", capture_output=True, text=True)
    assert "standard-input: empty (0 bytes)" in done.stderr


def test_a_light_whose_times_span_more_bits_than_can_be_read(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, x=np.zeros(9), y=np.zeros(9), p=np.arange(9) % 2, t=10**13 * np.arange(9))
    done = CliRunner().invoke(decode, [str(path), "--line-code", "uart", "--rate-hz", "500"])
    assert isinstance(done.exception, ValueError)
    assert "9 events in 80,000,000 s, or 4e+10 bits at 500 Hz; at most 5,000,000 are read" in str(done.exception)
