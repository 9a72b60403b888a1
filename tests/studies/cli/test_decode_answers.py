"""``bicode decode`` answers in words, takes every setting of a marker and of the receiver, and gives the pose."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bicode_lab.fabrication import marker_text
from bicode_lab.marker import Board, Marker, PacketFormat
from bicode_lab.recordings import write_npz
from bicode_studies.cli.helpers.reading import request_of
from bicode_studies.cli.main import main
from tests.studies.inspect.lights import HEIGHT, WIDTH, blinking, noise, together

NEAR = Path(__file__).resolve().parents[3] / "data" / "near_1m.npz"
Call = Callable[..., tuple[int, str, str]]
ODD = PacketFormat(
    f_id_hz=500, start_bits=4, payload_bits=9, checksum="sum", checksum_bits=4, manchester="thomas", bit_order="lsb"
)
OPTIONS = (
    "--f-id-hz 500 --start-bits 4 --payload-bits 9 --checksum sum --checksum-bits 4 --manchester thomas --bit-order lsb"
)


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Call:
    """Return a function that runs ``bicode`` and returns exit code, standard output and standard error."""

    def run(*words: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    """A recording of a light with no setting of the paper's."""
    write_npz(tmp_path / "odd.npz", together(blinking(ODD, 300, seconds=0.7), noise(3000, 0.7)), WIDTH, HEIGHT)
    return tmp_path / "odd.npz"


def ids(out: str) -> list[int | None]:
    """Return the IDs of rows of JSON."""
    return [json.loads(line)["id"] for line in out.splitlines()]


def test_all_settings_of_a_marker_can_be_given(call: Call, odd: Path) -> None:
    code, out, err = call("decode", odd, "--format", "jsonl", *shlex.split(OPTIONS), "--delta-t-whole-us", 80_000)
    assert code == 0
    assert ids(out)[:7] == [300] * 7
    assert "ID 300: in " in err
    assert "shorter than two packets" not in err


def test_a_markers_file_gives_them_all_at_once_and_options_change_single_ones(
    call: Call, odd: Path, tmp_path: Path
) -> None:
    file = tmp_path / "marker.toml"
    file.write_text(marker_text(Marker(payload=1, packet_format=ODD)), encoding="utf-8")
    words = ("decode", odd, "--format", "jsonl", "--delta-t-whole-us", 80_000, "--marker", file)
    assert ids(call(*words)[1])[:7] == [300] * 7
    wrong = call(*words, "--bit-order", "msb")[1]
    assert 300 not in ids(wrong)
    assert call("decode", odd, "--marker", tmp_path / "none.toml")[0] == 2


def test_where_nothing_is_read_it_says_what_was_tried_and_what_reads_it(call: Call, odd: Path) -> None:
    code, _, err = call("decode", odd, "--format", "csv")
    assert code == 0
    assert "no marker: tried 1000 Hz, 3 start + 8 payload + 3 checksum bits (sum), ieee, msb first" in err
    assert "regions blinked in" in err
    (advice,) = [line for line in err.splitlines() if OPTIONS.replace("--checksum sum ", "") in _sorted(line)] or [""]
    assert "(ID 300 in " in advice, err
    assert "bicode inspect" in err
    found = call("decode", odd, "--find")
    assert found[1] == ""
    assert "(ID 300 in " in found[2]


def _sorted(line: str) -> str:
    """Return a line with its options in the order of `OPTIONS`."""
    words = line.split()
    given = {word: words[k + 1] for k, word in enumerate(words[:-1]) if word.startswith("--")}
    named = [word for word in OPTIONS.split() if word.startswith("--")]
    return " ".join(f"{name} {given[name]}" for name in named if name in given)


def test_quiet_says_nothing_and_rows_are_the_same(call: Call, odd: Path) -> None:
    loud, quiet = (call("decode", odd, "--format", "csv", *more) for more in ((), ("--quiet",)))
    assert quiet[2] == ""
    assert quiet[1] == loud[1]


@pytest.mark.parametrize("name", ["whole", "2d", "blinker", "id"])
def test_every_time_of_the_receiver_can_be_given(name: str) -> None:
    options = dict.fromkeys(
        ("camera", "focal_px", "size_m", "marker_file", "manchester", "delta_t_whole_us", "delta_t_2d_us",
         "delta_t_blinker_us", "delta_t_id_us")
    )  # fmt: skip
    usual = request_of({**options, "receiver": "paper"}, 640, 480).settings
    times = (usual.delta_t_whole_us, usual.delta_t_2d_us, usual.delta_t_blinker_us, usual.delta_t_id_us)
    assert times == (33_000, 13_200, 2_000, 250)
    field = f"delta_t_{name}_us"
    value = {"whole": 50_000, "2d": 9_000, "blinker": 3_000, "id": 200}[name]
    changed = request_of({**options, "receiver": "paper", field: value}, 640, 480).settings
    assert getattr(changed, field) == value
    assert changed.delta_t_2d_us == {"whole": 20_000, "2d": 9_000}.get(name, 13_200)


def test_the_pose_has_columns_of_its_own(call: Call) -> None:
    rows = [json.loads(line) for line in call("decode", NEAR, "--format", "jsonl")[1].splitlines()]
    posed = [row for row in rows if row["rvec"] is not None]
    assert len(posed) == 2
    for row in posed:
        assert [row["x_m"], row["y_m"], row["z_m"]] == row["tvec"]
        assert abs(row["yaw_deg"]) < 15
        assert np.hypot(np.hypot(row["qw"], row["qx"]), np.hypot(row["qy"], row["qz"])) == pytest.approx(1)
    head, *lines = call("decode", NEAR, "--format", "csv")[1].splitlines()
    assert head.endswith("rvec,tvec,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg,qw,qx,qy,qz,margin,evidence_periods")
    assert all(line.count(",") == head.count(",") for line in lines)
    table = call("decode", NEAR)[1].splitlines()[0].split()
    assert table[-6:] == ["x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"]


def camera(tmp_path: Path, focal: float, k1: float = 0.0, width: int = 1280) -> Path:
    """Write the calibration of a camera."""
    file = tmp_path / "camera.yaml"
    matrix = f"[{focal}, 0, 639.5, 0, {focal}, 359.5, 0, 0, 1]"
    text = f"image_width: {width}\nimage_height: 720\ncamera_matrix:\n  data: {matrix}\n"
    file.write_text(text + f"distortion_coefficients:\n  data: [{k1}, 0, 0, 0, 0]\n", encoding="utf-8")
    return file


def tvec(call: Call, *more: object) -> np.ndarray[Any, Any]:
    """Return the first place of the marker at 1 m."""
    _, out, err = call("decode", NEAR, "--format", "jsonl", *more)
    places = [json.loads(line)["tvec"] for line in out.splitlines()]
    return np.array(next(place for place in places if place)), err


def test_the_camera_gives_focal_length_principal_point_and_distortion(call: Call, tmp_path: Path) -> None:
    plain, _ = tvec(call)
    assert tvec(call, "--camera", camera(tmp_path, 1646.09))[0] == pytest.approx(plain, abs=1e-6)
    assert tvec(call, "--camera", camera(tmp_path, 2 * 1646.09))[0][2] == pytest.approx(2 * plain[2], rel=0.01)
    bent, _ = tvec(call, "--camera", camera(tmp_path, 1646.09, k1=-50.0))
    assert bent[2] < 0.99 * plain[2]  # a barrel makes the plate smaller than it is, so it is nearer


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--camera", "{camera}", "--focal-px", "1000"], "both state the focal length"),
        (["--camera", "{other}"], "is the calibration of a sensor of 640x720 px, and the recording has 1280x720 px"),
        (
            ["--f-id-hz", "300", "--receiver", "paper"],
            "is never whole in 33 ms and cannot be read; choose --f-id-hz 425 or more, --delta-t-wh",
        ),
        (["--delta-t-id-us", "600"], "delta_t_id_us=600 is longer than one chip"),
        (["--delta-t-2d-us", "40000"], "delta_t_2d_us=40000 is longer than delta_t_whole_us=33000"),
        (["--dictionary", "DICT_3X3"], "is not one of OpenCV's"),
        (["--start-bits", "1"], "start_bits=1 is not in 2 .. 64"),
        (["--checksum", "crc3", "--checksum-bits", "4"], "choose 3"),
        (["--payload-bits", "7", "--manchester", "auto"], "manchester='auto' cannot work"),
    ],
)
def test_misuse_is_one_line(call: Call, tmp_path: Path, words: list[str], said: str) -> None:
    (tmp_path / "other").mkdir()
    files = {"camera": camera(tmp_path, 1000), "other": camera(tmp_path / "other", 1000, width=640)}
    code, out, err = call("decode", NEAR, *(word.format(**files) for word in words))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_a_period_of_less_than_two_packets_is_told_before_the_rows(call: Call, odd: Path) -> None:
    said = "so only 18% of the periods hold a whole one; choose --delta-t-whole-us 66000"
    assert said in call("decode", odd, "--f-id-hz", 500, "--receiver", "paper")[2].splitlines()[0]
    assert said not in call("decode", odd, "--f-id-hz", 500, "--delta-t-whole-us", 66_000)[2]
    assert said not in call("decode", odd, "--f-id-hz", 500, "--receiver", "soft")[2]
    assert said not in call("decode", odd, "--f-id-hz", 500, "--packets")[2]


def test_the_plate_of_the_marker_reaches_the_receiver(tmp_path: Path) -> None:
    file = tmp_path / "m.toml"
    board = Board(dictionary="DICT_5X5_100", glow="white", size_m=0.1)
    file.write_text(marker_text(Marker(board=board)), encoding="utf-8")
    names = (
        "camera",
        "focal_px",
        "size_m",
        "manchester",
        *(f"delta_t_{n}_us" for n in ("whole", "2d", "blinker", "id")),
    )
    options = {**dict.fromkeys(names), "receiver": "paper", "marker_file": file}
    settings = request_of(options, 640, 480).settings
    assert (settings.dictionary, settings.glow) == ("DICT_5X5_100", "white")
    assert settings.pattern_size_m == pytest.approx(board.pattern_size_m)
    given = request_of({**options, "size_m": 0.3, "glow": "black", "dictionary": "DICT_4X4_50"}, 640, 480).settings
    assert (given.pattern_size_m, given.glow, given.dictionary) == (0.3, "black", "DICT_4X4_50")


def test_simulate_and_decode_take_the_file_that_marker_writes(call: Call, tmp_path: Path) -> None:
    words = ["--id", "300", "--size-m", "0.1", "--current-ma", "40", "--glow", "white"] + shlex.split(OPTIONS)
    assert call("marker", *words, "--out", tmp_path / "parts")[0] == 0
    file = tmp_path / "parts" / "marker.toml"
    out = tmp_path / "m.npz"
    assert call("simulate", out, "--marker", file, "--distance-m", 4, "--seconds", 0.2)[0] == 0
    truth = json.loads((tmp_path / "m.npz.truth.json").read_text(encoding="utf-8"))
    assert truth["markers"][0]["id"] == 300
    err = call("decode", out, "--marker", file, "--delta-t-whole-us", 90_000)[2]
    assert "ID 300: in 3 of 3 periods" in err


def test_marker_keeps_what_is_there(call: Call, tmp_path: Path) -> None:
    assert call("marker", "--id", 37, "--out", tmp_path)[0] == 0
    code, _, err = call("marker", "--id", 38, "--out", tmp_path)
    assert (code, err.count("\n")) == (2, 1)
    assert "are there already and are not replaced" in err
    assert "payload = 37" in (tmp_path / "marker.toml").read_text(encoding="utf-8")
    assert call("marker", "--id", 38, "--out", tmp_path, "--force")[0] == 0
    assert "payload = 38" in (tmp_path / "marker.toml").read_text(encoding="utf-8")


def test_inspect_reads_what_it_can(call: Call, odd: Path, tmp_path: Path) -> None:
    code, out, err = call("inspect", odd)
    assert (code, err) == (0, "")
    first, *lines = out.splitlines()
    assert f"npz, {WIDTH}x{HEIGHT} px (file)" in first
    assert {line.split()[0] for line in lines} <= {"ok", "look", "bad"}
    assert [line.split(":")[0].split(None, 1)[1] for line in lines] == [
        "times", "rate", "balance", "hot pixels", "rows", "holes", "flicker", "blinking", "light",
    ]  # fmt: skip
    assert call("inspect", tmp_path / "none.raw")[0] == 2
