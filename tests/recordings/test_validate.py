"""Tests of bad files: each gives one line that says what is wrong, where, and the way out."""

import struct
import zipfile

import faery
import numpy as np
import pytest
from bad_files import (
    ES_HEAD,
    EVT3_HEAD,
    GOOD_FILES,
    LENIENT_HINT,
    SIZE_PX,
    complaint,
    dat,
    evt2,
    evt3,
    read_or_complain,
)

from bicode_lab.recordings import open_recording, write_recording


@pytest.mark.parametrize(
    ("name", "cuts"),
    [
        ("a.raw", (1, 3)),
        ("b.raw", (1, 3)),
        ("a.dat", (1, 7)),
        ("a.es", (1, 4)),
        ("a.npz", (1, 99)),
        ("a.aedat4", (999,)),
    ],
)
def test_cut_short_inside_an_event(good_files, name, cuts):
    whole = (good_files / name).read_bytes()
    for lost in cuts:  # the last 70 bytes of the AEDAT4 are a table of its packets: no event is lost with them
        assert "cut short" in complaint(good_files / name, whole[:-lost])


@pytest.mark.parametrize("name", GOOD_FILES)
def test_cut_anywhere_is_an_error_or_a_prefix_never_nonsense(good_files, name, some_events):
    whole = (good_files / name).read_bytes()
    expected = [row[:3] for row in some_events.tolist()]
    for length in [*range(min(200, len(whole))), *range(200, len(whole), 509)]:
        (good_files / name).write_bytes(whole[:length])
        recording, rows = read_or_complain(good_files / name, width=SIZE_PX[0], height=SIZE_PX[1])
        if recording is None:
            assert "\n" not in rows
            continue
        assert name not in ("a.npz", "a.h5")
        assert name != "a.aedat4" or rows.size == some_events.size
        got = [row[:3] for row in rows.tolist()]
        sure = max(len(got) - (name == "a.csv"), 0)  # a CSV's last number may have lost digits
        assert got[:sure] == expected[:sure]


def test_cut_inside_a_vector(tmp_path):
    assert complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x3008, 0x4003)).endswith(
        f"cut short at byte 43: inside a vector of events; copy it again, {LENIENT_HINT}"
    )


def test_coordinates_outside_the_sensor(tmp_path):
    at = len(EVT3_HEAD)
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x2001, 0x2280, 0x2281, 0x2002))
    place = f"the first is number 1 at byte {at + 6} (x = 640)"
    assert line.startswith(f"2 of 4 events have x outside the 640 px wide sensor; {place};")
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x01E0, 0x2001, 0x0005, 0x2001))
    assert line.startswith("1 of 2 events have y outside the 480 px high sensor; the first is number 0 at byte 39 (y =")
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x3000 | 636, 0x4FFF, 0x4001, 0x5000))
    assert line.startswith("9 of 13 events have x outside the 640 px wide sensor; the first is number 4 at byte")
    line = complaint(tmp_path / "a.raw", evt2(0x80000001, 0x00000000, 640 << 11))
    assert line.startswith("1 of 2 events have x outside the 640 px wide sensor; the first is number 1 at byte")
    line = complaint(tmp_path / "a.dat", dat((1, 1, 0, 5), (1, 480, 1, 6)))
    assert line.startswith("1 of 2 events have y outside the 480 px high sensor; the first is number 1 at byte")
    line = complaint(tmp_path / "a.es", ES_HEAD + bytes([2, 1, 0, 1, 0, 255, 2, 0x80, 2, 1, 0]))
    assert line.startswith("1 of 2 events have x outside the 640 px wide sensor; the first is number 1 at byte 26")
    line = complaint(tmp_path / "a.csv", b"t,x@640,y@480,on\n5,1,1,0\n6,-1,1,0\n7,640,1,0\n")
    assert line.startswith("2 of 3 events have x outside the 640 px wide sensor; the first is number 1 at line 3 (x =")


def test_a_row_outside_the_sensor_without_events_in_it_does_no_harm(tmp_path):
    (tmp_path / "a.raw").write_bytes(evt3(0x8001, 0x01FF, 0x0005, 0x2001))
    assert open_recording(tmp_path / "a.raw").read().tolist() == [(1, 5, 0, 4096)]


def test_coordinates_outside_a_size_the_file_does_not_tell(good_files):
    np.savez(good_files / "a.npz", x=[5, 1280], y=[0, 0], p=[0, 1], t=[1, 2])
    line = complaint(good_files / "a.npz")
    assert line.startswith("1 of 2 events have x outside the 1280 px wide sensor; the first is number 1 (x = 1280);")
    assert "width and height" in line


def test_time_running_backwards(tmp_path):
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x6010, 0x2001, 0x600F, 0x2001, 0x6005, 0x2001))
    place = f"the first is number 1 at byte {len(EVT3_HEAD) + 10} (1 us back)"
    assert (
        line
        == f"2 of 3 events have a time before the event ahead of it; {place}; sort the events by time, {LENIENT_HINT}"
    )
    for content in (
        evt3(0x8005, 0x6000, 0x0005, 0x2001, 0x8004, 0x2001, 0x8005, 0x2002, 0x8006),
        evt2(0x80000005, 0x00000000, 0x80000004, 0x00000000, 0x80000005, 0x00000000, 0x80000006),
    ):
        line = complaint(tmp_path / "a.raw", content)
        assert "1 time words are contradicted by those after them; the first is at byte 4" in line, line
    line = complaint(tmp_path / "a.dat", dat((1, 1, 0, 9), (1, 1, 0, 3), (1, 1, 0, 2)))
    assert "2 of 3 events have a time before the event ahead of it; the first is number 1 at byte" in line
    line = complaint(tmp_path / "a.csv", b"t,x,y,p\n5,1,1,0\n4,1,1,0\n")
    assert "the first is number 1 at line 3 (1 us back)" in line
    np.savez(tmp_path / "a.npz", x=[0, 0], y=[0, 0], p=[0, 1], t=[2, 1])
    assert "1 of 2 events have a time before the event ahead of it; the first is number 1 (1" in complaint(
        tmp_path / "a.npz"
    )


def test_aedat4_that_breaks_a_rule(tmp_path):
    theirs = np.zeros(10, faery.EVENTS_DTYPE)
    theirs["t"] = 10**6 + 1000 * np.arange(10)
    path = tmp_path / "a.aedat4"
    faery.events_stream_from_array(theirs, SIZE_PX).to_file(str(path), compression=None)
    whole, event = path.read_bytes(), struct.pack("<qh", 1_003_000, 0)
    line = complaint(path, whole.replace(event, struct.pack("<qh", 1_003_000, 640)))
    assert line.startswith("1 of 10 events have x outside the 640 px wide sensor; the first is number 3 (x = 640)")
    path.write_bytes(whole.replace(event, struct.pack("<qh", 1_000_500, 0)))
    assert "1 of 10 events have a time before the event ahead of it; the first is number 3 (1,500" in complaint(path)
    assert open_recording(path, lenient=True).read()["t"].tolist()[2:4] == [1_002_000, 1_004_000]


def test_the_clock_wraps_without_a_step_back(tmp_path):
    (tmp_path / "a.raw").write_bytes(evt3(0x8FF0, 0x8FFF, 0x0005, 0x6FFF, 0x2001, 0x8000, 0x2001, 0x8001, 0x2001))
    assert open_recording(tmp_path / "a.raw").read()["t"].tolist() == [2**24 - 1, 2**24, 2**24 + 4096]
    (tmp_path / "a.raw").write_bytes(evt2(0x8FFFFFFF, 0x0FC00000, 0x80000000, 0x00000000))
    assert open_recording(tmp_path / "a.raw").read()["t"].tolist() == [2**34 - 1, 2**34]
    (tmp_path / "a.dat").write_bytes(dat((1, 1, 0, 2**32 - 1), (1, 1, 1, 0)))
    assert open_recording(tmp_path / "a.dat").read()["t"].tolist() == [2**32 - 1, 2**32]


def test_events_without_a_time(tmp_path):
    line = complaint(tmp_path / "a.raw", evt3(0x0005, 0x2001, 0x8005, 0x2001))
    assert line.startswith("1 of 2 events have no time word before them; the first is number 0 at byte 37")
    assert "no time word" in complaint(tmp_path / "a.raw", evt2(0x00000000, 0x80000005, 0x00000000))
    (tmp_path / "a.raw").write_bytes(evt3(0x8FFF, 0x0005, 0x2001))
    assert open_recording(tmp_path / "a.raw").read()["t"].tolist() == [0xFFF << 12], "the clock may begin anywhere"


def test_events_without_a_place(tmp_path):
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x2001, 0x0005, 0x2001))
    assert line.startswith("1 of 2 events have no row or column word before them; the first is number 0 at byte 37")
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x4003, 0x4000, 0x5000, 0x2001))
    assert line.startswith("2 of 3 events have no row or column word before them; the first is number 0 at byte 39")


def test_words_of_no_kind(tmp_path):
    line = complaint(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x2001, 0xC123, 0xB000))
    assert line.startswith(
        "2 words have no known kind; the first is at byte 41 (0xc123, after 1 events); copy it again"
    )
    assert "1 words have no known kind" in complaint(tmp_path / "a.raw", evt2(0x80000005, 0x00000000, 0x50000000))


def test_a_tail_or_a_hole_of_zeros(tmp_path, some_events):
    for name, word in (("a.raw", 2), ("a.dat", 8)):
        write_recording(tmp_path / name, some_events, *SIZE_PX)
        whole = (tmp_path / name).read_bytes()
        line = complaint(tmp_path / name, whole + bytes(4096))
        place = f"the first is at byte {len(whole):,} (0x0, after 1,000 events)"
        assert line.startswith(f"{4096 // word:,} words are blank (all zero); {place}; copy it again")
    head = (0x80000005, 0x00400000)
    assert "2 words are blank" in complaint(tmp_path / "a.raw", evt2(*head, 0, 0))
    assert "3 words are blank" in complaint(tmp_path / "a.raw", evt2(*head, 0, 0, 0, 0x80000006, 0x00000000))
    assert "4 words are blank" in complaint(
        tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x2001, 0, 0, 0, 0, 0x6001, 0x2001)
    )
    assert "2 words are blank" in complaint(tmp_path / "a.es", ES_HEAD + bytes([2, 1, 0, 1, 0]) + bytes(10))


def test_polarity_neither_0_nor_1(tmp_path):
    rule = "1 of 2 events have a polarity that is neither 0 nor 1; the first is number 1"
    np.savez(tmp_path / "a.npz", x=[0, 0], y=[0, 0], p=[1, 3], t=[1, 2])
    assert complaint(tmp_path / "a.npz") == f"{rule} (p = 3); store OFF as 0 and ON as 1, {LENIENT_HINT}"
    assert complaint(tmp_path / "a.dat", dat((1, 1, 1, 1), (1, 1, 2, 2))).startswith(rule)
    assert complaint(tmp_path / "a.csv", b"t,x,y,p\n1,1,1,1\n2,1,1,-2\n").startswith(rule)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ("6,1,1", "line 3 is '6,1,1'; each line holds whole numbers"),
        ("6,1,1,", "line 3 is '6,1,1,'; each line holds whole numbers"),
        ("6.5,1,1,0", "line 3 is '6.5,1,1,0'; each line holds whole numbers"),
        ("nan,1,1,0", "line 3 is 'nan,1,1,0'; each line holds whole numbers"),
        ("\x00\xff\x01", "line 3 is "),
    ],
)
def test_a_csv_line_that_is_no_event(tmp_path, bad, words):
    content = b"t,x,y,p\n5,1,1,0\n" + bad.encode("latin-1") + b"\n7,1,1,1\n"
    assert complaint(tmp_path / "a.csv", content).startswith(words)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"x": [1], "y": [1], "t": [1]}, "arrays missing: p (found: t, x, y); give x, y, p, t"),
        ({"x": [1, 2], "y": [1], "p": [1], "t": [1]}, "arrays x, y, p, t have [2, 1, 1, 1] entries; give one of each"),
        (
            {"x": [1], "y": [1], "p": [1], "t": [1j]},
            "array t is complex128 of shape (1,); store whole microseconds, or",
        ),
        (
            {"x": [1], "y": [1], "p": [1], "t": [np.nan]},
            "1 of 1 events have a value that is no whole number; the first is number 0 (in t)",
        ),
        ({"x": ["a"], "y": [1], "p": [1], "t": [1]}, "array x is <U1 of shape (1,); store whole numbers in one dim"),
        ({"x": [[1, 2], [3, 4]], "y": [1], "p": [1], "t": [1]}, "array x is int64 of shape (2, 2); store whole num"),
        ({"x": np.array([None]), "y": [1], "p": [1], "t": [1]}, "array x cannot be read (Object arrays cannot be lo"),
        ({"x": [1], "y": [1], "p": [1], "t": [1], "width": 0, "height": 5}, "sensor of 0x5 px in the file; sides"),
        ({"x": [1], "y": [1], "p": [1], "t": [1], "width": 0.5, "height": 5}, "width and height are not whole num"),
    ],
)
def test_an_npz_with_wrong_arrays(tmp_path, arrays, words):
    np.savez(tmp_path / "a.npz", **arrays)
    assert complaint(tmp_path / "a.npz").startswith(words)


def test_an_npz_with_a_flipped_byte(good_files):
    content = bytearray((good_files / "a.npz").read_bytes())
    with zipfile.ZipFile(good_files / "a.npz") as archive:
        at = archive.getinfo("t.npy").header_offset + 200
    content[at] ^= 0xFF
    assert complaint(good_files / "a.npz", bytes(content)).startswith("array t cannot be read (")


@pytest.mark.parametrize("name", GOOD_FILES)
def test_flipped_bytes_give_events_inside_the_sensor_or_one_line(good_files, name):
    rng = np.random.default_rng(7)
    whole = (good_files / name).read_bytes()
    for _ in range(60):
        content = bytearray(whole)
        for at in rng.integers(0, len(whole), 3):
            content[at] ^= 1 << int(rng.integers(8))
        (good_files / name).write_bytes(content)
        recording, events = read_or_complain(good_files / name)
        if recording is None:
            assert "\n" not in events
            continue
        assert (events["x"] < recording.width).all()
        assert (events["y"] < recording.height).all()
        assert (np.diff(events["t"]) >= 0).all()
