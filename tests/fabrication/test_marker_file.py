"""A marker's file says all of it, and a wrong one is refused in one line."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.fabrication import marker_text, read_marker
from bicode_lab.fabrication.marker_file import OWN
from bicode_lab.marker import Board, Marker, PacketFormat

PACKETS = st.builds(
    PacketFormat,
    start_bits=st.integers(2, 64),
    payload_bits=st.integers(8, 32),
    checksum_bits=st.integers(1, 8),
    f_id_hz=st.floats(1, 1e5),
    manchester=st.sampled_from(["ieee", "thomas"]),
    bit_order=st.sampled_from(["msb", "lsb"]),
)
BOARDS = st.builds(
    Board,
    aruco_id=st.integers(0, 49),
    dictionary=st.sampled_from(["DICT_4X4_50", "DICT_5X5_100"]),
    size_m=st.floats(0.01, 1),
    glow=st.sampled_from(["black", "white"]),
    thickness_m=st.floats(0.001, 0.01),
)


@given(PACKETS, BOARDS, st.integers(0, 255), st.floats(0, 50), st.sampled_from(["visible", "infrared"]))
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, packet: PacketFormat, board: Board, payload: int, ma: float, band: str
) -> None:
    file = tmp_path_factory.mktemp("marker") / "marker.toml"
    marker = Marker(payload=payload, board=board, packet_format=packet, current_ma=ma, band=band)  # type: ignore[arg-type]
    file.write_text(marker_text(marker), encoding="utf-8")
    assert read_marker(file) == marker


def test_every_field_of_a_marker_is_in_the_file_but_its_phase() -> None:
    text = marker_text(Marker())
    for part in (Board(), PacketFormat()):
        for each in fields(part):
            assert f"\n{each.name} = " in text
    assert {each.name for each in fields(Marker)} - set(OWN) == {"board", "packet_format", "phase_us"}


def test_what_is_left_out_has_its_default(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text("\ufeff[packet]\nf_id_hz = 500\n", encoding="utf-8")
    assert read_marker(tmp_path / "m.toml") == Marker(packet_format=PacketFormat(f_id_hz=500))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("payload = ", "is not a marker's settings in TOML"),
        ("payload = true", "payload=True is not a whole number"),
        ("payload = 1.5", "payload=1.5 is not a whole number"),
        ("payload = 256", "payload=256 does not fit payload_bits=8"),
        ("band = 3", "band=3 is not a text in quotes"),
        ("current_ma = '9'", "current_ma='9' is not a number"),
        ("paylod = 3", r"paylod is no setting of the top; write payload"),
        ("phase_us = 3", "phase_us is no setting"),
        ("[board]\nglow = 'grey'", "glow='grey' is not known"),
        ("[packet]\nsize_m = 1", r"size_m is no setting of \[packet\]"),
        ("packet = 3", r"\[packet\] is 3 and not a table"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "m.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=said) as error:
        read_marker(file)
    assert str(file) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_names_the_command_that_writes_one(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="No such file or directory; bicode marker --id 37 --out DIR writes"):
        read_marker(tmp_path / "m.toml")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match="is not a marker's settings"):
        read_marker(tmp_path / "b.toml")
