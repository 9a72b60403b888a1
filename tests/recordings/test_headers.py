"""Tests of headers: a file that is not an event file, or whose header cannot be used, gives one clear line."""

import os

import numpy as np
import pytest
from bad_files import (
    DAT_HEAD,
    ES_HEAD,
    EVT2_HEAD,
    EVT3_HEAD,
    GOOD_FILES,
    complaint,
    evt3,
)

from bicode_lab.recordings import open_recording


def test_missing_and_not_a_file(tmp_path):
    assert complaint(tmp_path / "none.raw") == "no such file; check the path"
    assert complaint(tmp_path).startswith("a directory; give one event file (EVT2, EVT2.1, EVT3 or EVT4 RAW")
    os.mkfifo(tmp_path / "pipe.raw")
    assert complaint(tmp_path / "pipe.raw").startswith("not a regular file; give one event file")


@pytest.mark.parametrize("name", GOOD_FILES)
def test_empty(tmp_path, name):
    assert complaint(tmp_path / name, b"") == "empty (0 bytes); record or copy it again"


@pytest.mark.parametrize("name", [*GOOD_FILES, "a.bin"])
@pytest.mark.parametrize("what", ["random", "png", "text", "mat", "zeros"])
def test_not_an_event_file(tmp_path, name, what):
    content = {
        "random": b"\xa7" + np.random.default_rng(1).bytes(5000),
        "png": b"\x89PNG\r\n\x1a\n" + bytes(range(256)),
        "text": b"Shall I compare thee to a summer's day?\nThou art more lovely\n",
        "mat": b"MATLAB 5.0 MAT-file, Platform: GLNXA64",
        "zeros": bytes(4096),
    }[what]
    expected = {"mat": "damaged or cut short"}.get(what, "not an event file")
    expected = "line 1 is" if (name, what) == ("a.csv", "text") else expected
    assert complaint(tmp_path / name, content).startswith(expected)


@pytest.mark.parametrize("name", GOOD_FILES)
def test_named_as_another_format(good_files, name):
    wrong = good_files / ("wrong.dat" if name != "a.dat" else "wrong.raw")
    line = complaint((good_files / name).rename(wrong))
    suffix = "." + name.split(".")[1]
    assert line.startswith(f"named {wrong.suffix} but holds ")
    assert line.endswith(f"; rename it to end in {suffix}")


@pytest.mark.parametrize(
    ("name", "header"),
    [("a.raw", EVT2_HEAD), ("a.raw", EVT3_HEAD), ("a.dat", DAT_HEAD), ("a.es", ES_HEAD), ("a.csv", b"t,x,y,p\n")],
)
def test_a_header_and_nothing_else(tmp_path, name, header):
    assert complaint(tmp_path / name, header).startswith(f"ends after its header, at byte {len(header)}: no events;")


@pytest.mark.parametrize(("name", "word_bytes"), [("a.raw", 4), ("b.raw", 2), ("a.dat", 8)])
def test_the_byte_at_which_a_word_is_cut_short(good_files, name, word_bytes):
    whole = (good_files / name).read_bytes()
    for rest in range(1, word_bytes):
        words = f"cut short at byte {len(whole)}: {rest} of the {word_bytes} bytes of a word; copy it again"
        assert complaint(good_files / name, whole + bytes(rest)) == words


def test_a_clock_of_the_header_that_is_no_number(tmp_path):
    content = evt3(0x8001, 0x0005, 0x2001).replace(b"% end", b"% t0 -3")
    line = complaint(tmp_path / "a.raw", content)
    assert line == "the header's t0 is '-3', not whole microseconds; correct it or leave it out"
    assert open_recording(tmp_path / "a.raw", lenient=True).read()["t"].tolist() == [4096]
    (tmp_path / "a.raw").write_bytes(content.replace(b"-3", b"7000000"))
    assert open_recording(tmp_path / "a.raw").read()["t"].tolist() == [7_004_096]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        (
            "a.raw",
            b"% format EVT9;width=640;height=480\n\0\0\0\0\0\0\0\0",
            "the header says EVT9; give EVT2, EVT2.1, EVT3, EVT4 or DAT",
        ),
        ("a.raw", b"% date 2020-09-25\n\0\0", "the header names no event format; give EVT2, EVT2.1, EVT3, EVT4 or"),
        ("a.raw", b"% evt 3.0\n% date 2020", "cut short in the header, at byte 21; copy it again"),
        ("a.dat", b"% Version 2\n\x07\x08" + bytes(8), "no CD events of 8 bytes announced at byte 12; give a DAT fi"),
        ("a.dat", b"% Version 2\n\x0c\x10" + bytes(8), "no CD events of 8 bytes announced at byte 12; give a DAT fi"),
        ("a.dat", b"% Version 2\n\x0e\x08" + bytes(8), "holds external triggers and no events; give the file of CD"),
        ("a.dat", b"% Version 1\n\x0c\x08" + bytes(8), "the header says DAT version 1; give EVT2, EVT2.1, EVT3"),
        ("a.es", ES_HEAD[:15] + b"\x04" + ES_HEAD[16:], "Event Stream version 2, type 4; give version 2, type 1"),
        ("a.aedat4", b"#!AER-DAT4.0\r\n\xff\xff\xff\xff" + bytes(50), "cut short or damaged in the header, before"),
        ("a.aedat4", b"#!AER-DAT4.0\r\n\x08\0\0\0\x18\0\0\0IOHE", "cut short or damaged in the header, before"),
        ("a.aedat4", b"#!AER-DAT1.0\r\n", "not an event file but an AEDAT file of version 1; convert it"),
    ],
)
def test_a_header_that_cannot_be_used(tmp_path, name, content, words):
    assert complaint(tmp_path / name, content).startswith(words)
