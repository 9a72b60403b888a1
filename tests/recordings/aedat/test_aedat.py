"""Tests of AEDAT 2 and 3.1: where each camera has its bits, what is passed over, what is refused."""

import numpy as np
import pytest
from bad_files import complaint
from make_files import AEDAT3_HEAD, aedat3_packet

from bicode_lab.recordings import RecordingError, open_recording

HEAD = b"#!AER-DAT2.0\r\n# This is a raw AE data file created by saveaerdat.m\r\n"
DVS128 = HEAD + b"# AEChip: ch.unizh.ini.jaer.chip.retina.DVS128\r\n"


def pairs(*rows):
    return np.array(rows, ">u4").tobytes()


def test_dvs128(tmp_path):
    """Bit 0 is set for OFF, then 7 bits of x and 7 of y, from the right and from the bottom."""
    path = tmp_path / "a.aedat"
    path.write_bytes(DVS128 + pairs((0, 5), (1 | 3 << 1 | 100 << 8, 6), (0x8000, 7), (127 << 1 | 127 << 8, 8)))
    recording = open_recording(path)
    assert recording.read().tolist() == [(127, 127, 1, 5), (124, 27, 0, 6), (0, 0, 1, 8)]
    assert (recording.width, recording.height, recording.triggers["t"].tolist()) == (128, 128, [7])
    path.write_bytes(HEAD + pairs((0, 5), (1 | 3 << 1 | 100 << 8, 6)))
    assert open_recording(path).width == 128, "without a name, the bits above the 16th tell the camera"


def test_davis(tmp_path):
    path = tmp_path / "a.aedat"
    chip = HEAD + b"# AEChip: eu.seebetter.ini.chips.davis.DAVIS240C\r\n"
    frame, motion = 1 << 31 | 5 << 12, 1 << 31 | 3 << 10
    path.write_bytes(chip + pairs((7 << 22 | 30 << 12 | 0x800, 5), (frame, 3), (motion, 9), (179 << 22 | 239 << 12, 6)))
    recording = open_recording(path)
    assert recording.read().tolist() == [(209, 172, 1, 5), (0, 0, 0, 6)]
    assert (recording.width, recording.height) == (240, 180)


def test_a_camera_that_is_not_named(tmp_path):
    path = tmp_path / "a.aedat"
    path.write_bytes(HEAD + pairs((7 << 22 | 30 << 12, 5)))
    with pytest.raises(
        RecordingError, match=r"the header names no camera of DVS128, DAVIS240, .* give --width and --height"
    ):
        open_recording(path)
    assert open_recording(path, width=100, height=50).read().tolist() == [(69, 42, 0, 5)]


def test_the_clock_of_aedat2_wraps(tmp_path):
    path = tmp_path / "a.aedat"
    path.write_bytes(DVS128 + pairs((0, 2**32 - 1), (0, 3)))
    assert open_recording(path).read()["t"].tolist() == [2**32 - 1, 2**32 + 3]


def test_data_that_begin_as_a_line_of_the_header_would(tmp_path):
    path = tmp_path / "a.aedat"
    path.write_bytes(DVS128 + pairs((0x2300_0000 | 9 << 1, 7)))
    assert open_recording(path).read()["t"].tolist() == [7]


def test_aedat2_cut_short(tmp_path):
    line = complaint(tmp_path / "a.aedat", DVS128 + bytes(8 + 3))
    assert line == f"cut short at byte {len(DVS128) + 8}: 3 of the 8 bytes of an event; copy it again"
    recording = open_recording(tmp_path / "a.aedat", lenient=True)
    assert recording.read().size == 1
    assert recording.dropped == {"bytes at the cut end": 3}
    assert complaint(tmp_path / "a.aedat", DVS128).startswith("ends after its header, at byte")


def polarity(x, y, p, valid=1):
    return valid | p << 1 | y << 2 | x << 17


def test_aedat3_packets(tmp_path):
    path = tmp_path / "a.aedat"
    frames = aedat3_packet([(1, 5)] * 3, kind=2)
    first = aedat3_packet([(polarity(3, 4, 1), 10), (polarity(5, 6, 0), 11), (polarity(9, 9, 0, valid=0), 12)], room=7)
    path.write_bytes(AEDAT3_HEAD + frames + first + aedat3_packet([(polarity(345, 259, 1), 2**32 + 5)]))
    recording = open_recording(path)
    assert recording.read().tolist() == [(3, 4, 1, 10), (5, 6, 0, 11), (345, 259, 1, 2**32 + 5)]
    assert (recording.format, recording.width, recording.height) == ("AEDAT3.1", 346, 260)


def test_aedat3_that_is_refused(tmp_path):
    path = tmp_path / "a.aedat"
    head = AEDAT3_HEAD.replace(b"RAW", b"SerializedTS")
    assert complaint(path, head + bytes(9)).startswith(
        "AER-DAT3.1 with packets of the format SerializedTS; give AER-DAT3.1"
    )
    assert complaint(path, AEDAT3_HEAD.replace(b"3.1", b"3.0") + bytes(9)).startswith("AER-DAT3.0 with packets")
    assert complaint(path, AEDAT3_HEAD[:30]).startswith("cut short or damaged in the header, before byte 30")
    assert complaint(path, AEDAT3_HEAD).startswith(f"ends after its header, at byte {len(AEDAT3_HEAD)}")
    packet = aedat3_packet([(polarity(3, 4, 1), 10), (polarity(3, 4, 1), 11)])
    damaged = packet[:4] + b"\0\0\0\0" + packet[8:]
    at = len(AEDAT3_HEAD) + len(packet)
    assert f"the head of the packet at byte {at} is damaged" in complaint(path, AEDAT3_HEAD + packet + damaged)
    assert f"cut short in the packet at byte {at}; copy it again, or" in complaint(
        path, AEDAT3_HEAD + packet + packet[:-9]
    )
    assert f"cut short in the head of a packet at byte {at}" in complaint(path, AEDAT3_HEAD + packet + packet[:9])
    path.write_bytes(AEDAT3_HEAD + packet + packet[:-9].replace(b"\x0a", b"\x0c"))
    recording = open_recording(path, lenient=True)
    assert (recording.read()["t"].tolist(), recording.dropped) == ([10, 11], {"bytes at the cut end": 7})
