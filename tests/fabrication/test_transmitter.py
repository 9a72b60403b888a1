"""The transmitter's file runs on a stand-in board and blinks what `LedWaveform` says.

The stand-in (board/rp2.py) runs the PIO's program instruction by instruction. MicroPython itself is
used where it is there (`.ci/micropython` fetches it), CPython always.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from bicode_lab.camera import PlacedMarker, Pose, Recorder, Scene, Still
from bicode_lab.fabrication import transmitter_text
from bicode_lab.lights.interval_line import IntervalLine
from bicode_lab.lights.waveform import ChipWaveform, constant_frequency, text_waveform
from bicode_lab.marker import LedWaveform, Marker, PacketFormat
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.soft_receiver.line_code import UartLine

BOARD = Path(__file__).parent / "board"
FETCHED = Path(__file__).resolve().parents[2] / "build" / "micropython" / "micropython"
MICROPYTHON = shutil.which("micropython") or (str(FETCHED) if os.access(FETCHED, os.X_OK) else None)
CLOCK_MHZ = 125  # of the stand-in board

FORMATS = [
    PacketFormat(),
    PacketFormat(manchester="thomas"),
    PacketFormat(checksum="crc3"),
    PacketFormat(bit_order="lsb", checksum="crc3", manchester="thomas"),
    PacketFormat(bit_order="lsb", checksum_bits=5, start_bits=2),
    PacketFormat(payload_bits=9, checksum_bits=1, f_id_hz=2500),
    PacketFormat(payload_bits=13, start_bits=5, checksum_bits=8, f_id_hz=333.3, manchester="thomas"),
    PacketFormat(payload_bits=32, checksum="crc3", f_id_hz=100_000, bit_order="lsb"),
    PacketFormat(payload_bits=8, f_id_hz=4),
]


@pytest.fixture(params=["CPython", "MicroPython"])
def interpreter(request: pytest.FixtureRequest) -> str:
    """Return a Python interpreter that runs the file."""
    if request.param == "CPython":
        return sys.executable
    if MICROPYTHON is None:
        pytest.skip("no micropython here: .ci/micropython fetches Debian's")
    return MICROPYTHON


def run(interpreter: str, cases: list[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    """Return what the stand-in board saw for each ID of each case."""
    listed = folder / "cases.json"
    listed.write_text(json.dumps(cases))
    done = subprocess.run(
        [interpreter, str(BOARD / "run_cases.py"), str(listed)],
        capture_output=True, text=True, timeout=300, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr + done.stdout[-2000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


def times_us(seen: dict[str, Any]) -> npt.NDArray[np.float64]:
    """Moments at which the pin changed, from the first chip on [us]."""
    return np.array([edge[0] for edge in seen["edges"]], float) * seen["divider_256"] / 256 / CLOCK_MHZ


def levels(seen: dict[str, Any]) -> npt.NDArray[np.float64]:
    """States that it changed to."""
    return np.array([edge[1] for edge in seen["edges"]], float)


def ids_of(packet_format: PacketFormat) -> list[int]:
    """Return all 256 IDs of 8 bits; of more bits, 256 that use them all."""
    most = 2**packet_format.payload_bits - 1
    return [number * most // 255 for number in range(256)]


@pytest.mark.parametrize("packet_format", FORMATS, ids=range(len(FORMATS)))
def test_every_id_blinks_as_the_waveform_says(packet_format: PacketFormat, interpreter: str, tmp_path: Path) -> None:
    file = tmp_path / "bicode_tx.py"
    file.write_text(transmitter_text(0, packet_format))
    duration_us = 2.4 * packet_format.packet_us
    case = {"file": str(file), "name": "bicode_tx", "ids": ids_of(packet_format), "us": duration_us}
    seen = run(interpreter, [case], tmp_path)
    assert [each["id"] for each in seen] == ids_of(packet_format)
    until_us = duration_us - packet_format.chip_us / 2
    for each in seen:
        waveform = LedWaveform(payload=each["id"], packet_format=packet_format)
        wave_us, wave = (array[1:] for array in waveform.steps(0, until_us))
        real_us, real = times_us(each), levels(each)
        kept = real_us < until_us
        np.testing.assert_array_equal(real[kept], wave)
        # The divider of the clock is cut to 1/256, the frequency rounded to 1 Hz: a slower clock, no jitter.
        off = 1 / each["divider_256"] + 0.5 / (1000 * packet_format.f_id_hz)
        np.testing.assert_array_less(np.abs(real_us[kept] - wave_us), wave_us * off + 1e-6)
        if packet_format.f_id_hz == 1000:
            np.testing.assert_array_equal(real_us[kept], wave_us)


def test_the_edges_printed_for_the_oscilloscope_are_the_waveforms() -> None:
    text = (BOARD.parents[2] / "docs" / "build.md").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith("    3.0 3.5 ")]
    times, _ = LedWaveform(payload=37).steps(0, 14_001)
    np.testing.assert_array_equal(np.array(line.split(), float) * 1000, times[1:])


def test_settings_go_into_the_file_and_nothing_else_changes() -> None:
    one = transmitter_text(37, PacketFormat()).splitlines()
    other = transmitter_text(38, PacketFormat(f_id_hz=250.5), pin=3).splitlines()
    changed = [line.split("  #")[0] for line, before in zip(other, one, strict=True) if line != before]
    assert changed == ["ID = 38", "PIN = 3", "F_ID_HZ = 250.5"]


def test_the_file_alone_blinks_and_leaves_the_led_off(interpreter: str, tmp_path: Path) -> None:
    """The file starts by itself as main.py; Ctrl-C stops the state machine and switches the pin off."""
    file = tmp_path / "main.py"
    file.write_text(transmitter_text(0x25, PacketFormat(), pin=3))
    (seen,) = run(interpreter, [{"file": str(file), "name": "__main__", "ids": None, "us": 30_000}], tmp_path)
    assert (seen["pin"], seen["running"], seen["set_by_hand"]) == (3, 0, [[3, 0]])
    assert times_us(seen)[0] == 3000


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("ID = 256", "ID=256 does not fit PAYLOAD_BITS=8; choose 0 .. 255"),
        ("F_ID_HZ = 1", "F_ID_HZ=1 is not in 1.91"),
        ("F_ID_HZ = 200000", "F_ID_HZ=200000 is not in"),
        ('CHECKSUM = "crc"', "CHECKSUM is"),
        ("CHECKSUM_BITS = 4\nCHECKSUM = 'crc3'", "CHECKSUM is"),
        ('MANCHESTER = "Thomas"', "MANCHESTER is"),
        ('BIT_ORDER = "MSB"', 'MANCHESTER is "ieee" or "thomas", BIT_ORDER is'),
    ],
)
def test_a_setting_changed_by_hand_is_refused_with_words(
    line: str, words: str, interpreter: str, tmp_path: Path
) -> None:
    text = transmitter_text(0, PacketFormat())
    file = tmp_path / "main.py"
    file.write_text(text.replace("# ---- from the ID to chips", f"{line}\n# ---- from the ID to chips"))
    listed = tmp_path / "cases.json"
    listed.write_text(json.dumps([{"file": str(file), "name": "__main__", "ids": None, "us": 1000}]))
    done = subprocess.run(
        [interpreter, str(BOARD / "run_cases.py"), str(listed)],
        capture_output=True, text=True, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip
    assert done.returncode != 0
    assert f"ValueError: {words}" in done.stderr


@dataclass(frozen=True)
class Played:
    """A list of edges as a waveform."""

    times_us: npt.NDArray[np.float64]
    levels: npt.NDArray[np.float64]
    packet_us: float

    def steps(self, start_us: float, end_us: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Return the edges in a span, as `LedWaveform.steps` does."""
        before, until = np.searchsorted(self.times_us, start_us, "right"), np.searchsorted(self.times_us, end_us)
        first = self.levels[before - 1] if before else 0.0
        return np.append(start_us, self.times_us[before:until]), np.append(first, self.levels[before:until])


@pytest.mark.parametrize("payload", [0x25, 0xC3])
def test_the_receiver_reads_what_the_transmitter_blinks(payload: int, interpreter: str, tmp_path: Path) -> None:
    """Record the edges of the file with the synthetic camera and decode them, with no `LedWaveform` in between."""
    file = tmp_path / "main.py"
    file.write_text(transmitter_text(payload, PacketFormat()))
    (seen,) = run(interpreter, [{"file": str(file), "name": "__main__", "ids": None, "us": 180_000}], tmp_path)
    played = Played(times_us(seen), levels(seen), 14_000.0)

    class Built(Marker):
        @property
        def waveform(self) -> Any:
            return played

    marker = Built(payload=0)  # the scene does not know what is blinked
    scene = Scene(markers=(PlacedMarker(marker=marker, path=Still(Pose.facing(1.0))),))
    rng = np.random.default_rng(7)
    sightings = list(recognise(Recorder(scene, 5 * 0.033, rng), ReceiverSettings(), t0_us=0))
    assert [sighting.id for sighting in sightings] == [payload] * 5


@pytest.mark.parametrize(
    ("code", "rate_hz", "waveform"),
    [
        ("interval", 5000.0, ChipWaveform(chips=IntervalLine().encode(0xA5), chip_us=200)),
        ("interval", 1000.0, ChipWaveform(chips=IntervalLine(rate_hz=1000).encode(0xA5), chip_us=1000)),
        ("uart", 3125.0, text_waveform('Say "hi" \\ 7', UartLine(rate_hz=3125))),
        ("frequency", 777.0, constant_frequency(777)),
    ],
)
def test_other_codes_blink_as_their_waveforms_say(
    code: Any, rate_hz: float, waveform: ChipWaveform, interpreter: str, tmp_path: Path
) -> None:
    file = tmp_path / "bicode_tx.py"
    file.write_text(transmitter_text(0xA5, PacketFormat(f_id_hz=rate_hz), code=code, text='Say "hi" \\ 7'))
    until_us = 2.3 * waveform.packet_us
    case = {"file": str(file), "name": "bicode_tx", "ids": [0xA5], "us": until_us + 500}
    (seen,) = run(interpreter, [case], tmp_path)
    wave_us, wave = (array[1:] for array in waveform.steps(0, until_us))
    real_us, real = times_us(seen), levels(seen)
    if waveform.chips[0]:  # the board counts from before the first chip, when the pin is low
        real_us, real = real_us[real_us > 0], real[real_us > 0]
    kept = real_us < until_us - waveform.chip_us / 2
    n = int(kept.sum())
    np.testing.assert_array_equal(real[kept], wave[:n])
    assert n >= np.count_nonzero(wave_us < until_us - waveform.chip_us)
    np.testing.assert_allclose(real_us[kept], wave_us[:n], rtol=1 / seen["divider_256"] + 1e-6)


@pytest.mark.parametrize(("given", "word"), [({"code": "morse"}, "morse"), ({"code": "uart", "text": "\n"}, "text=")])
def test_another_code_or_text_is_refused(given: Any, word: str) -> None:
    with pytest.raises(ValueError, match=word):
        transmitter_text(1, PacketFormat(), **given)
