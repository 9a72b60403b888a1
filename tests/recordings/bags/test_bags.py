"""Tests of ROS bags: both kinds of messages, all encodings, several topics, and what is refused."""

import sys

import numpy as np
import pytest
from bad_files import complaint
from make_files import HEIGHT, WIDTH, event_array, event_packet, write_bag, write_messages

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording, write_recording

EVENTS = make_events([1, 2, 300, 4], [5, 6, 250, 8], [0, 1, 1, 0], [1_000_001, 1_000_001, 1_999_999, 2_000_000])
PACKETS = "event_camera_msgs/msg/EventPacket"
ROWS = EVENTS.tolist()


@pytest.mark.parametrize("ending", [".bag", ".db3", ".mcap", ""])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_event_arrays_of_any_length(tmp_path, ending, n):
    path = tmp_path / f"a{ending}"
    write_messages(path, [event_array(part, ending != ".bag") for part in (EVENTS[:n], EVENTS[:0], EVENTS[n:])])
    recording = open_recording(path)
    assert recording.read().tolist() == ROWS
    assert (recording.width, recording.height, recording.size_from) == (WIDTH, HEIGHT, "file")
    assert recording.format == ("ROS 1 bag" if ending == ".bag" else "ROS 2 bag")


def mono(t0_ns):
    words = [(t * 1000 + 999 - t0_ns) | x << 32 | y << 48 | p << 63 for x, y, p, t in ROWS]
    return np.array(words, np.uint64).tobytes()


def libcaer(t0_us):
    words = [(1 | p << 1 | y << 2 | x << 17) | (t - t0_us) << 32 for x, y, p, t in ROWS]
    return np.array(words, np.uint64).tobytes()


def libcaer_cmp(t0_us):
    words = []
    for x, y, p, t in ROWS:
        dt = t - t0_us
        words += [dt >> 12, 1 << 12 | dt & 0xFFF, 2 << 12 | x]
        words += [3 << 12 | p << 11 | y] if p == 0 else [4 << 12 | p << 11 | y - 3, 5 << 12 | 1 << 3]
    return np.array(words, np.uint16).tobytes()


@pytest.mark.parametrize("ending", [".bag", ".mcap"])
@pytest.mark.parametrize(
    ("encoding", "data", "time_base"),
    [
        ("mono", mono(1_000_000_500), 1_000_000_500),
        ("libcaer", libcaer(999_000), 999_000_999),
        ("libcaer_cmp", libcaer_cmp(999_000), 999_000),
    ],
)
def test_event_packets(tmp_path, ending, encoding, data, time_base):
    path = tmp_path / f"a{ending}"
    write_messages(path, [event_packet(encoding, data, time_base, ending != ".bag")], PACKETS)
    assert open_recording(path).read().tolist() == ROWS


def test_two_neighbours_in_a_column_of_libcaer_cmp(tmp_path):
    words = np.array([1 << 12 | 7, 2 << 12 | 9, 4 << 12 | 1 << 11 | 10, 5 << 12 | 0x81, 5 << 12 | 2], np.uint16)
    write_messages(tmp_path / "a.mcap", [event_packet("libcaer_cmp", words.tobytes(), 5)], PACKETS)
    assert open_recording(tmp_path / "a.mcap").read().tolist() == [(9, 10, 1, 12), (9, 17, 1, 12), (9, 19, 1, 12)]
    write_messages(tmp_path / "b.mcap", [event_packet("libcaer_cmp", b"\0\x60")], PACKETS)
    with pytest.raises(RecordingError, match="a word of unknown kind 6 in a packet of libcaer_cmp"):
        open_recording(tmp_path / "b.mcap").read()


def test_a_clock_of_libcaer_that_turns_within_a_packet(tmp_path):
    words = np.array([1 | ((1 << 31) - 1) << 32, 1 | 4 << 32], np.uint64)
    write_messages(tmp_path / "a.mcap", [event_packet("libcaer", words.tobytes())], PACKETS)
    assert open_recording(tmp_path / "a.mcap").read()["t"].tolist() == [(1 << 31) - 1, (1 << 31) + 4]


def test_packets_of_evt3_go_on_where_the_last_one_ended(tmp_path):
    events = make_events(np.arange(300), np.full(300, 7), np.ones(300), 4000 + 50 * np.arange(300))
    write_recording(tmp_path / "a.raw", events, WIDTH, HEIGHT)
    words = (tmp_path / "a.raw").read_bytes().split(b"% end\n")[1]
    parts = [words[:100], words[100:111], words[111:]]
    write_messages(tmp_path / "a.db3", [event_packet("evt3", part) for part in parts], PACKETS)
    assert open_recording(tmp_path / "a.db3").read().tolist() == events.tolist()


def test_an_encoding_that_is_not_known(tmp_path):
    write_messages(tmp_path / "a.mcap", [event_packet("trigger", bytes(8))], PACKETS)
    line = complaint(tmp_path / "a.mcap")
    assert line == "event packets in the encoding 'trigger'; give one of evt3, mono, libcaer, libcaer_cmp"


def test_a_bag_without_events(tmp_path):
    write_messages(tmp_path / "a.bag", [], "sensor_msgs/msg/Image")
    assert complaint(tmp_path / "a.bag").startswith(
        "a ROS bag without messages of events (found: sensor_msgs/msg/Image); give one with dvs_msgs/EventArray or"
    )
    write_messages(tmp_path / "b.bag", [])
    assert complaint(tmp_path / "b.bag") == "topic /dvs/events holds no messages; record or copy it again"


@pytest.mark.parametrize("is_cdr", [False, True])
def test_a_message_cut_short(tmp_path, is_cdr):
    path = tmp_path / ("a.mcap" if is_cdr else "a.bag")
    write_messages(path, [event_array(EVENTS, is_cdr), event_array(EVENTS, is_cdr)[:-5]])
    with pytest.raises(
        RecordingError, match=r"that is damaged, cut short or still being written \(a message of \d+ bytes"
    ):
        open_recording(path).read()
    recording = open_recording(path, lenient=True)
    assert recording.read().tolist() == ROWS
    assert recording.dropped == {"packets that cannot be read, or the rest of the file": 1}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.bag", b"#ROSBAG V2.0\n" + bytes(4096)),
        ("a.db3", b"SQLite format 3\0" + bytes(4096)),
        ("a.mcap", b"\x89MCAP0\r\n"),
    ],
)
def test_a_bag_that_is_damaged(tmp_path, name, content):
    line = complaint(tmp_path / name, content)
    assert line.startswith(
        f"a ROS {1 if name == 'a.bag' else 2} bag that is damaged, cut short or still being written ("
    )
    assert line.endswith("; copy it again, or run: " + ("rosbag reindex" if name == "a.bag" else "ros2 bag reindex"))


def test_without_rosbags_the_container_is_named(tmp_path, monkeypatch):
    write_bag(tmp_path / "a.bag", EVENTS)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    assert complaint(tmp_path / "a.bag") == "a ROS bag, for which the package rosbags is needed; pip install rosbags"
