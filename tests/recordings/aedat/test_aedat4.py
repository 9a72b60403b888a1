"""Tests of AEDAT4: packets of every compression, triggers, damaged packets."""

import faery
import lz4.frame
import numpy as np
import pytest
from bad_files import complaint
from make_files import aedat4_events, aedat4_head, write_aedat4

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording

EVENTS = make_events(np.arange(90), np.arange(90) * 2, np.arange(90) % 2, 1 << 50 | 30 * np.arange(90))


@pytest.mark.parametrize("compression", [None, ("lz4", 1), ("lz4", 9), ("zstd", 1), ("zstd", 19)])
def test_what_faery_writes_is_read(tmp_path, compression):
    theirs = np.empty(EVENTS.size, faery.EVENTS_DTYPE)
    for name, ours in (("t", "t"), ("x", "x"), ("y", "y"), ("on", "p")):
        theirs[name] = EVENTS[ours]
    path = tmp_path / "a.aedat4"
    faery.events_stream_from_array(theirs, (346, 260)).to_file(str(path), compression=compression)
    assert open_recording(path).read().tolist() == EVENTS.tolist()


def test_a_real_recording_is_read_as_faery_reads_it(real_recordings):
    path = real_recordings / "davis346.aedat4"
    events = open_recording(path).read()
    packets = list(faery.events_stream_from_file(path))
    for ours, theirs in (("x", "x"), ("y", "y"), ("p", "on"), ("t", "t")):
        assert np.array_equal(np.concatenate([packet[theirs] for packet in packets]), events[ours])


@pytest.mark.parametrize(("compression", "pack"), [(0, bytes), (1, lz4.frame.compress)])
def test_triggers(tmp_path, compression, pack):
    """Rising and falling edges and pulses of the external signal are kept, other triggers are not external."""
    rows = [(7, 1), (8, 2), (9, 0), (1 << 50, 3), (11, 4)]
    write_aedat4(tmp_path / "a.aedat4", EVENTS, rows, compression, pack)
    recording = open_recording(tmp_path / "a.aedat4")
    assert recording.read().tolist() == EVENTS.tolist()
    assert recording.triggers.tolist() == [(1, 7, 0), (0, 8, 0), (1, 1 << 50, 0)]


def test_a_packet_without_events(tmp_path):
    write_aedat4(tmp_path / "a.aedat4", EVENTS[:1])
    assert open_recording(tmp_path / "a.aedat4").read().tolist() == EVENTS[:1].tolist()


@pytest.mark.parametrize(("at", "value"), [(4, 0xFF), (20, 0xFF), (27, 0xFF), (31, 0x7F)])
def test_a_damaged_packet_costs_its_own_events(tmp_path, at, value):
    """The place of the table, of its fields, of the list, and how many there are."""
    write_aedat4(tmp_path / "a.aedat4", EVENTS)
    whole = bytearray((tmp_path / "a.aedat4").read_bytes())
    second = len(aedat4_head()) + 8 + len(b"a frame") + 8 + len(aedat4_events(EVENTS[:30]))
    whole[second + 8 + at] = value
    line = complaint(tmp_path / "a.aedat4", bytes(whole))
    assert line.startswith(f"the packet at byte {second} is damaged (")
    recording = open_recording(tmp_path / "a.aedat4", lenient=True)
    assert recording.read().tolist() == EVENTS[:30].tolist() + EVENTS[60:].tolist()
    assert recording.dropped == {"packets that cannot be read, or the rest of the file": 1}


def test_a_compression_that_is_not_one(tmp_path):
    write_aedat4(tmp_path / "a.aedat4", EVENTS, compression=1)
    assert "is damaged (" in complaint(tmp_path / "a.aedat4")
    write_aedat4(tmp_path / "a.aedat4", EVENTS, compression=5)
    with pytest.raises(RecordingError, match="cut short or damaged in the header"):
        open_recording(tmp_path / "a.aedat4")
