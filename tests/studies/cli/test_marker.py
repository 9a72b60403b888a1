"""Tests of ``bicode marker``: it writes all files of a marker, and explains every misuse in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bicode_studies.cli.main import main

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Return a function that runs ``bicode marker`` and returns exit code, standard output and standard error."""

    def run(*words: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["marker", *map(str, words)])
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return run


FILES = ["bicode_tx.py", "marker.toml", "paper.pdf", "paper.svg", "parts.md", "plate.pdf", "plate.svg"]


def test_writes_everything_with_the_id_filled_in(call: Call, tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    code, said, _ = call("--id", 37, "--aruco-id", 7, "--size-m", 0.05, "--out", out)
    assert code == 0
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert all(name in said for name in FILES)
    assert "270 ohm: 10.37 mA" in said
    assert re.search(r"(?m)^ID = 37 ", (out / "bicode_tx.py").read_text())
    assert "glows in its black cells" in (out / "plate.svg").read_text()
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    call("--id", 37, "--out", out)  # the defaults; and again over what is there
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_options_reach_the_files(call: Call, tmp_path: Path) -> None:
    words = "--id 0x1FF --payload-bits 9 --checksum crc3 --manchester thomas --bit-order lsb --start-bits 4 --pin 3 "
    words += "--f-id-hz 500 --glow white --size-m 0.1 --aruco-id 12 --led ir --current-ma 50 --max-current-ma 100 "
    words += "--led-forward-v 1.35 --supply-v 9"
    code, _, said = call(*words.split(), "--out", tmp_path)
    assert (code, said) == (0, "")
    transmitter = (tmp_path / "bicode_tx.py").read_text()
    for line in ("ID = 511", "PIN = 3", "F_ID_HZ = 500", "START_BITS = 4", "PAYLOAD_BITS = 9", 'CHECKSUM = "crc3"',
                 'MANCHESTER = "thomas"', 'BIT_ORDER = "lsb"'):  # fmt: skip
        assert f"\n{line} " in transmitter
    parts = (tmp_path / "parts.md").read_text()
    for word in ("150 ohm", "50.33 mA", "OSI5LA5A33A-B", "as given", "GPIO 3", "(9 V - 1.35 V - 0.1 V)"):
        assert word in parts
    assert "Pattern, frame to frame (for the pose): 75.000 mm" in (tmp_path / "plate.svg").read_text()


@pytest.mark.parametrize(("size_m", "ohm"), [(0.025, 1000), (0.05, 270), (0.1, 75)])
def test_default_current_makes_plates_equally_bright(call: Call, tmp_path: Path, size_m: float, ohm: int) -> None:
    """The paper's currents are 2.7, 10.7 and 40.9 mA (IV-C)."""
    code, said, _ = call("--id", 1, "--size-m", size_m, "--out", tmp_path)
    assert code == 0
    assert f"LED resistor {ohm} ohm" in said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--id 256", "payload=256 does not fit payload_bits=8; choose 0 .. 255, or more bits"),
        ("--id -1", "choose 0 .. 255"),
        ("--id abc", "write for example 37"),
        ("--id 1 --aruco-id 50", "aruco_id=50 is not in DICT_4X4_50; choose 0 .. 49"),
        ("--id 1 --dictionary DICT_3X3", "choose for example 'DICT_4X4_50'"),
        ("--id 1 --size-m 0.02", "0.025 or more"),
        ("--id 1 --size-m 50", "in metres"),
        ("--id 1 --current-ma 60", "--max-current-ma"),
        ("--id 1 --led ir --current-ma 25", "20.4 mA"),
        ("--id 1 --max-current-ma 0", "current_ma=0"),
        ("--id 1 --supply-v 2", "choose a supply"),
        ("--id 1 --pin 30", "choose 0 .. 29"),
        ("--id 1 --f-id-hz 1", "choose 4 .. 100000"),
        ("--id 1 --checksum crc3 --checksum-bits 4", "choose 3"),
        ("--id 1 --glow grey", "'black', 'white'"),
        ("", "--id"),
    ],
)
def test_misuse_is_one_line_with_a_way_out(call: Call, tmp_path: Path, words: str, says: str) -> None:
    out = tmp_path / "out"
    code, _, said = call(*words.split(), "--out", out)
    assert code == 2
    assert said.count("\n") == 1
    assert says in said
    assert not out.exists()


def test_a_folder_that_cannot_be_written_is_one_line(call: Call, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "full" / "plate.svg").mkdir(parents=True)
    for out in (tmp_path / "file", tmp_path / "file" / "below", tmp_path / "full"):
        code, _, said = call("--id", 1, "--out", out)
        assert code == 2
        assert said.count("\n") == 1
        assert "choose a folder of yours with --out" in said
