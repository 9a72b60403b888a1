"""Tests of text files: separators, names, orders, units, marks at the beginning, lines that hold no event."""

import numpy as np
import pytest
from bad_files import complaint

from bicode_lab.recordings import RecordingError, open_recording

EVENTS = [(1, 2, 1, 10), (3, 4, 0, 20), (5, 6, 1, 30)]


def read(path, content, lenient=False, **size):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    recording = open_recording(path, lenient=lenient, **(size or {"width": 8, "height": 9}))
    return recording.read().tolist()


@pytest.mark.parametrize(
    "content",
    [
        "x,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "x,y,p,t\r\n1,2,1,10\r\n3,4,0,20\r\n5,6,1,30\r\n",
        "\ufeffx,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "x,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30",
        "x,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30\n\n",
        "x,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30\r\n \r\n\r\n",
        "x,y,p,t\n\n1,2,1,10\n\n3,4,0,20\n5,6,1,30\n",
        "x;y;p;t\n1;2;1;10\n3;4;0;20\n5;6;1;30\n",
        "x\ty\tp\tt\n1\t2\t1\t10\n3\t4\t0\t20\n5\t6\t1\t30\n",
        '"x","y","polarity","timestamp"\n1,2,1,10\n3,4,0,20\n5,6,1,30\n',
        "# a comment, M\ufffdller\n#x,y,p,t\n1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "n,x,y,p,t\n0,1,2,1,10\n1,3,4,0,20\n2,5,6,1,30\n",
        "x,y,p,t\n1,2,True,10\n3,4,False,20\n5,6,TRUE,30\n",
        "x,y,p,t\n1,2,1,10\n3,4,-1,20\n5,6,1,30\n",
        "x,y,p,t\n1.0,2.0,1.0,10.0\n3.0,4.0,0.0,20.0\n5.0,6.0,1.0,30.0\n",
        "x,y,p,t_ns\n1,2,1,10999\n3,4,0,20000\n5,6,1,30000\n",
        "x,y,p,timestamp [ms]\n1,2,1,0.01\n3,4,0,0.02\n5,6,1,0.03\n",
        "x,y,p,t\n1,2,1,0.00001\n3,4,0,2e-05\n5,6,1,3.0E-5\n",
        "%geometry:8,9\n1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "% geometry: 8x9\n1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "1,2,1,10\n3,4,0,20\n5,6,1,30\n",
        "10,1,2,1\n20,3,4,0\n30,5,6,1\n",
    ],
)
def test_csv(tmp_path, content):
    assert read(tmp_path / "a.csv", content) == EVENTS
    assert read(tmp_path / "a.csv", content, lenient=True) == EVENTS
    assert open_recording(tmp_path / "a.csv").format == "CSV"


@pytest.mark.parametrize(
    "content",
    [
        "0.000010 1 2 1\n0.000020 3 4 0\n0.000030 5 6 1\n",
        "8 9\n0.000010 1 2 1\n0.000020 3 4 0\n0.000030 5 6 1\n",
        "# timestamp x y polarity\n0.000010 1 2 1\n0.000020 3 4 0\n0.000030 5 6 1\n",
        "10 1 2 1\n20 3 4 -1\n30 5 6 1\n",
        "t x y p\n10 1 2 1\n20 3 4 0\n30 5 6 1\n",
        "1 2 1 10\n3 4 0 20\n5 6 1 30\n",
    ],
)
def test_text_of_four_numbers_a_line(tmp_path, content):
    for name in ("a.txt", "events"):
        assert read(tmp_path / name, content) == EVENTS
        assert open_recording(tmp_path / name).format == "text"


def test_a_first_line_with_the_size(tmp_path):
    read(tmp_path / "a.txt", "8 9\n0.000010 1 2 1\n0.000020 3 4 0\n")
    assert (open_recording(tmp_path / "a.txt").width, open_recording(tmp_path / "a.txt").height) == (8, 9)
    read(tmp_path / "a.csv", "%geometry:8,9\n1,2,1,10\n", width=8, height=9)
    assert open_recording(tmp_path / "a.csv").size_from == "file"


def test_seconds_since_1970_keep_their_microseconds(tmp_path):
    lines = "".join(f"1468940145.{us:06d} 1 2 1\n" for us in range(123_456, 123_956, 7))
    found = read(tmp_path / "a.txt", lines)
    assert [t - 1_468_940_145_000_000 for *_, t in found] == list(range(123_456, 123_956, 7))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            "0.1 1 2 1\n0.2 1 2\n0.3 1 2 1\n",
            "line 2 is '0.1 1 2'|line 2 is '0.2 1 2'; each line holds whole numbers for x, y",
        ),
        (
            "8 9\n0.1 1 2 1\n0.2 1 2 1.5\n",
            "line 3 is '0.2 1 2 1.5'; each line holds whole numbers for x, y and p, and t in s",
        ),
        ("0.1 1 2 1\n\n0.2 x 2 1\n", "line 3 is '0.2 x 2 1'"),
        (
            "0.1 1 2 1\n0.2 1 2 7\n",
            "1 of 2 events have a polarity that is neither 0 nor 1; the first is number 1 at line 2",
        ),
        (
            "0.1 1 2 1\n0.05 1 2 0\n0.2 1 1 1\n",
            "1 of 3 events have a time before the event ahead of it; the first is numb",
        ),
    ],
)
def test_lines_that_hold_no_event(tmp_path, content, words):
    line = complaint(tmp_path / "a.txt", content.encode())
    assert any(line.startswith(each) for each in words.split("|")), line


def test_text_that_holds_no_events_at_all(tmp_path):
    line = complaint(tmp_path / "a.txt", b"time,reading\n1,2\n")
    assert line.startswith("line 1 is 'time,reading'; begin a CSV with its column names, such as t,x,y,p")
    assert complaint(tmp_path / "a.raw", b"Dear reader,\nhello\n").startswith("not an event file; give EVT2")
    assert complaint(tmp_path / "a.csv", "x,y,p,t\n".encode("utf-16")).startswith(
        "text of 16-bit letters (UTF-16); save"
    )
    assert complaint(tmp_path / "a.csv", b"x,y,p,t\n").startswith("ends after its header, at byte 8: no events")


def test_times_too_large_for_64_bits_are_no_events(tmp_path):
    content = f"t,x,y,p\n1,1,1,1\n{1 << 70},1,1,1\n{(1 << 62) + 5},1,1,1\n4,1,1,0\n"
    assert read(tmp_path / "a.csv", content, lenient=True) == [(1, 1, 1, 1), (1, 1, 0, 4)]
    with pytest.raises(RecordingError, match="line 3 is '1180591620717411303424,1,1,1'; each line holds whole numbers"):
        read(tmp_path / "a.csv", content)


def test_a_wide_sensor(tmp_path):
    assert read(tmp_path / "a.csv", "t,x,y,p\n1,65535,0,1\n", width=65536, height=1) == [(65535, 0, 1, 1)]


def test_many_lines_with_blank_ones_between_them(tmp_path):
    """Blocks end anywhere, and a line keeps its number."""
    t = np.arange(30_000)
    lines = [f"{k},{k % 8},{k % 9},{k % 2}" + ("\n\n" if k % 1000 == 0 else "\n") for k in t.tolist()]
    found = read(tmp_path / "a.csv", "t,x,y,p\n" + "".join(lines))
    assert found == [(k % 8, k % 9, k % 2, k) for k in t.tolist()]
    lines[25_500] = "25500,9,1,1\n"
    path = tmp_path / "a.csv"
    path.write_text("t,x@8,y@9,p\n" + "".join(lines))
    with pytest.raises(RecordingError, match="the first is number 25,500 at line 25,528 "):
        open_recording(path).read()
