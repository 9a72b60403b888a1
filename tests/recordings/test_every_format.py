"""Tests that hold for every format: events come back, one bad time costs one event, broken files end in words."""

import zlib

import numpy as np
import pytest
from make_files import FILES, SIZE_PX

from bicode_lab.events import check_events, make_events
from bicode_lab.recordings import RecordingError, open_recording

BROKEN_PER_FORMAT = 60
NO_TIMES_OF_THEIR_OWN = ("evt21.raw", "evt21_swapped.raw", "evt4.raw")  # their times come in words, tested in raw/


def scattered(n=300, seed=0):
    """Return events all over the sensor of a DAVIS346, some of them in rows that switch at once."""
    rng = np.random.default_rng(seed)
    columns = [rng.integers(0, side, n) for side in (*SIZE_PX, 2)]
    row = np.flatnonzero(rng.random(60) < 0.5) + 40
    columns = [
        np.concatenate(pair) for pair in zip(columns, (row, np.full(row.size, 9), np.ones(row.size)), strict=True)
    ]
    return make_events(*columns, np.concatenate([rng.integers(5000, 900_000, n), np.full(row.size, 70_000)]))


def opened(path, lenient=False):
    return open_recording(path, lenient=lenient, width=SIZE_PX[0], height=SIZE_PX[1])


@pytest.mark.parametrize("name", FILES)
def test_the_events_come_back(tmp_path, name):
    events = scattered()
    FILES[name](tmp_path / name, events)
    recording = opened(tmp_path / name)
    assert recording.read().tolist() == events.tolist()
    assert recording.read().tolist() == events.tolist(), "a recording can be read again"
    assert (recording.dropped, recording.remarks, recording.triggers.size) == ({}, [], 0)
    lenient = opened(tmp_path / name, lenient=True)
    assert lenient.read().tolist() == events.tolist()
    assert lenient.dropped == {}


@pytest.mark.parametrize("name", [name for name in FILES if name not in NO_TIMES_OF_THEIR_OWN])
@pytest.mark.parametrize("far_us", [10_000_000, 3_600_000_000, 1 << 31])
def test_one_time_far_ahead_costs_one_event(tmp_path, name, far_us, monkeypatch):
    if name == "davis31.aedat" and far_us >= 1 << 31:
        pytest.skip("31 bits of its times stand beside an event, the others only in the head of a packet")
    events = scattered()
    damaged = events.copy()
    damaged["t"][160] += far_us
    monkeypatch.setattr("bicode_lab.recordings.writer.check_events", lambda *_: None)
    monkeypatch.setattr("bicode_lab.recordings.tables.npz.check_events", lambda *_: None)
    FILES[name](tmp_path / name, damaged)
    recording = opened(tmp_path / name, lenient=True)
    kept = recording.read()
    assert kept.tolist() == np.delete(events, 160).tolist()
    assert recording.dropped == {"events with a damaged time": 1}


def broken(whole, rng):
    """Return a file with bytes flipped, cut, put in, left out or doubled."""
    content = bytearray(whole)
    kind = rng.integers(6)
    at = int(rng.integers(0, len(content)))
    length = int(rng.integers(1, 60))
    if kind == 0:
        for place in rng.integers(0, len(content), rng.integers(1, 8)):
            content[place] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del content[at:]
    elif kind == 2:
        content[at : at + length] = bytes(length)
    elif kind == 3:
        del content[at : at + length]
    elif kind == 4:
        content[at:at] = rng.bytes(length)
    else:
        content[at : at + length] = b"\xff" * length
    return bytes(content)


def outcome(path, content):
    """Return what a broken file gives strictly, events or an error, after checking the rules of both ways to read."""
    path.write_bytes(content)
    found = []
    for lenient in (False, True):
        try:
            recording = opened(path, lenient)
            events = recording.read()
            check_events(events, recording.width, recording.height)
            found.append((events.tolist(), recording.dropped))
        except RecordingError as error:
            line = str(error)
            assert line.startswith(f"{path}: ")
            assert "\n" not in line
            assert len(line) < 500
            found.append(line)
    if not isinstance(found[0], str):
        assert not isinstance(found[1], str), f"read strictly, but not leniently: {found[1]}"
        assert found[1][1] == {}, "what is read strictly has nothing to drop"
        assert found[0][0] == found[1][0]
    return found[0]


@pytest.mark.parametrize("name", FILES)
def test_broken_files_end_in_words(tmp_path, name):
    FILES[name](tmp_path / name, scattered(60))
    whole = (tmp_path / name).read_bytes()
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    found = [outcome(tmp_path / name, broken(whole, rng)) for _ in range(BROKEN_PER_FORMAT)]
    assert any(isinstance(each, str) for each in found), "some of them are refused"
