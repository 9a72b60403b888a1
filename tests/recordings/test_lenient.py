"""Tests of lenient reading: every good event of a damaged file is read, and what is dropped is counted by cause."""

import numpy as np
import pytest
from click.testing import CliRunner

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording, write_recording
from bicode_lab.recordings.headers import read_header
from bicode_studies.cli.decode import decode
from bicode_studies.cli.simulate import simulate

SIZE_PX = (640, 480)
EVT3_HEAD = b"% evt 3.0\n% geometry 640x480\n% end\n"
EVT2_HEAD = b"% evt 2.0\n% geometry 640x480\n% end\n"


def lenient(path, content):
    """Return the good events of a file as rows, and what was dropped."""
    path.write_bytes(content)
    recording = open_recording(path, lenient=True, width=640, height=480)
    return recording.read().tolist(), recording.dropped


def evt3(*words):
    return EVT3_HEAD + np.array(words, "<u2").tobytes()


def evt2(*words):
    return EVT2_HEAD + np.array(words, "<u4").tobytes()


def test_a_bad_coordinate_costs_one_event_not_the_file(tmp_path):
    rows, dropped = lenient(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x2001, 0x2280, 0x01E0, 0x2002, 0x0006, 0x2003))
    assert rows == [(1, 5, 0, 4096), (3, 6, 0, 4096)]
    assert dropped == {"events outside the sensor": 2}


def test_words_before_the_first_time_and_place(tmp_path):
    rows, dropped = lenient(tmp_path / "a.raw", evt3(0x0005, 0x2001, 0x8001, 0x2002, 0x4001))
    assert rows == [(2, 5, 0, 4096)]
    assert dropped == {
        "events before the first time word": 1,
        "events without a row or column": 1,
        "vector of events cut at the end": 1,
    }


def test_one_false_time_high_does_not_carry_the_clock_away(tmp_path):
    highs = [0x8000 | high for high in range(12)]
    body = [word for high in highs for word in (high, 0x6001, 0x0005, 0x2001)]
    good, _ = lenient(tmp_path / "a.raw", evt3(*body))
    assert [t for *_, t in good] == [4096 * k + 1 for k in range(12)]
    body[4 * 5] ^= 0x400  # the sixth time word: 4 s ahead
    mended, dropped = lenient(tmp_path / "a.raw", evt3(*body))
    assert mended == good, "its neighbours say what it was"
    assert dropped == {"time words that those after them contradict": 1}
    with pytest.raises(RecordingError, match="1 time words are contradicted by those after them; the first is at byte"):
        open_recording(tmp_path / "a.raw").read()


@pytest.mark.parametrize("false", [0xFFF, 0xFFE, 0xF3F])
def test_a_false_first_time_high_costs_the_events_under_it(tmp_path, false):
    """No time word stands before it, so it cannot be mended. The last value of the clock is checked as all are."""
    body = [word for high in range(0xEFF, 0xF0B) for word in (0x8000 | high, 0x6001, 0x0005, 0x2001)]
    good, _ = lenient(tmp_path / "a.raw", evt3(*body))
    body[0] = 0x8000 | false
    rows, dropped = lenient(tmp_path / "a.raw", evt3(*body))
    assert rows == good[1:]
    assert dropped["time words that those after them contradict"] == 1


def test_two_false_time_words_side_by_side_do_not_agree(tmp_path):
    """Two damaged time words in one place must not outweigh the time words after them."""
    body = [word for high in range(12) for word in (0x8000 | high, 0x6001, 0x0005, 0x2001)]
    good, _ = lenient(tmp_path / "a.raw", evt3(*body))
    body[4 * 5 + 3 : 4 * 5 + 3] = [0x80F6, 0x2001, 0x8147]
    rows, dropped = lenient(tmp_path / "a.raw", evt3(*body))
    assert set(good) - set(rows) <= {(1, 5, 0, 4096 * 5 + 1)}
    assert set(rows) <= set(good)
    assert dropped["time words that those after them contradict"] == 2


def test_one_false_time_low_costs_the_events_under_it(tmp_path):
    body = [0x8001, 0x0005] + [word for low in range(20) for word in (0x6000 | low, 0x2001)]
    body[2 + 2 * 7] ^= 0x800
    rows, dropped = lenient(tmp_path / "a.raw", evt3(*body))
    assert [t - 4096 for *_, t in rows] == [low for low in range(20) if low != 7]
    assert dropped == {"events with a damaged time": 1}


def test_a_time_low_that_is_corrected_before_any_event_came_is_no_damage(tmp_path):
    rows, dropped = lenient(tmp_path / "a.raw", evt3(0x8001, 0x0005, 0x600B, 0x6001, 0x2001, 0x6002, 0x2002))
    assert ([t - 4096 for *_, t in rows], dropped) == ([1, 2], {})


def test_one_false_evt2_time_costs_one_event(tmp_path):
    events = [k << 22 | 5 for k in range(20)]
    events[7] |= 0x20 << 22
    rows, dropped = lenient(tmp_path / "a.raw", evt2(0x80000001, *events))
    assert [t - 64 for *_, t in rows] == [k for k in range(20) if k != 7]
    assert dropped == {"events with a damaged time": 1}


def test_zeros_cuts_and_unknown_words_are_counted(tmp_path):
    good = (0x8001, 0x0005, 0x2001)
    rows, dropped = lenient(tmp_path / "a.raw", evt3(*good, 0xB000, *[0] * 8) + b"\0")
    assert rows == [(1, 5, 0, 4096)]
    assert dropped == {"words of no known kind": 1, "words of zeros": 8, "bytes at the cut end": 1}


@pytest.mark.parametrize("content", [EVT3_HEAD, EVT3_HEAD + b"\1", b"% evt 3.0\n% geom", b"t,x,y,p\n"])
def test_a_header_and_no_whole_event_holds_no_events(tmp_path, content):
    assert lenient(tmp_path / "a.bin", content)[0] == []


def test_a_wrong_name_does_not_matter(tmp_path):
    assert lenient(tmp_path / "a.dat", evt3(0x8001, 0x0005, 0x2001)) == ([(1, 5, 0, 4096)], {})


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n", b"% evt 2", b"\xa7\x00\x01" * 99, b"PK\x03\x04junk"])
def test_where_nothing_can_be_read_it_is_an_error_all_the_same(tmp_path, content):
    (tmp_path / "a.raw").write_bytes(content)
    with pytest.raises(RecordingError, match=r"a\.raw: "):
        open_recording(tmp_path / "a.raw", lenient=True)


def test_lines_of_a_csv(tmp_path):
    rows, dropped = lenient(tmp_path / "a.csv", b"t,x,y,p\n5,1,1,0\nsix,1,1,0\n7,900,1,0\n8,1,1,2\n4,1,1,1\n9,1,1,1\n8")
    assert rows == [(1, 1, 0, 5), (1, 1, 1, 9)]
    assert dropped == {
        "events outside the sensor": 1,
        "events of no polarity": 1,
        "events that step back in time": 1,
        "lines that hold no event": 2,
    }


def test_columns(tmp_path):
    np.savez(tmp_path / "a.npz", x=[0, 700, 0], y=[0, 0, 0], p=[0, 1, 1], t=[1, 2, 3])
    recording = open_recording(tmp_path / "a.npz", lenient=True, width=640, height=480)
    assert recording.dropped == {}, "nothing was read yet"
    assert recording.read()["t"].tolist() == [1, 3]
    assert recording.dropped == {"events outside the sensor": 1}


@pytest.mark.parametrize("name", ["evk4_scene_evt3.raw", "sparklers_evt2.raw"])
def test_of_a_real_file_with_one_byte_in_a_thousand_flipped_99_percent_are_read(tmp_path, real_recordings, name):
    rng = np.random.default_rng(0)
    head = read_header(real_recordings / name).offset
    whole = (real_recordings / name).read_bytes()[: head + 400_000]
    (tmp_path / "a.raw").write_bytes(whole)
    good = open_recording(tmp_path / "a.raw", lenient=True).read()
    damaged = np.frombuffer(whole, "u1").copy()
    hit = head + np.flatnonzero(rng.random(len(whole) - head) < 0.001)
    damaged[hit] ^= (1 << rng.integers(0, 8, hit.size)).astype("u1")
    (tmp_path / "a.raw").write_bytes(damaged.tobytes())
    found = open_recording(tmp_path / "a.raw", lenient=True).read()
    kept = len(set(good.tolist()) & set(found.tolist())) / good.size
    assert kept > 0.99
    with pytest.raises(RecordingError):
        open_recording(tmp_path / "a.raw").read()


def test_the_command_line_says_what_was_dropped_and_what_was_assumed(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(evt3(0x8001, 0x0005, 0x2001, 0x2280))
    strict = CliRunner().invoke(decode, [str(path)])
    assert strict.exit_code != 0
    done = CliRunner().invoke(decode, ["--lenient", str(path)])
    assert done.exit_code == 0
    assert f"{path}: dropped 1 events outside the sensor\n" in done.stderr
    path.write_bytes(evt3(0x8001, 0x0005, 0x2001).replace(b"% geometry 640x480\n", b""))
    done = CliRunner().invoke(decode, [str(path)])
    assert f"{path}: does not state its sensor size; 1280x720 px assumed (--width, --height)\n" in done.stderr


def test_the_command_line_writes_every_format(tmp_path):
    arguments = ["--seconds", "0.02", "--distance-m", "8"]
    found = []
    for suffix in (".npz", ".raw", ".h5"):
        out = tmp_path / f"marker{suffix}"
        done = CliRunner().invoke(simulate, [str(out), *arguments])
        assert done.exit_code == 0, done.output
        found.append(open_recording(out).read())
    assert found[0].size
    assert all(np.array_equal(found[0], other) for other in found[1:])


def test_hdf5_is_read_from_its_root_too_and_told_where_columns_are_wrong(tmp_path):
    import h5py

    events = make_events([1, 2], [3, 4], [0, 1], [5, 6])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xypt":
            file[name] = events[name]
    assert open_recording(tmp_path / "a.h5").read().tolist() == events.tolist()
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["t"]
    with pytest.raises(RecordingError, match=r"columns missing: t \(found: p, x, y\); give x, y, p, t"):
        open_recording(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["t"] = ["a", "b"]
    with pytest.raises(RecordingError, match=r"column t is object of shape \(2,\); store whole microseconds, or sec"):
        open_recording(tmp_path / "a.h5")
    write_recording(tmp_path / "b.h5", events, *SIZE_PX)
    with h5py.File(tmp_path / "b.h5") as file:
        assert sorted(file["events"]) == ["p", "t", "x", "y"]
        assert dict(file["events"].attrs) == {"width": 640, "height": 480}
