"""Tests of EVT2.1 and EVT4: words as the formats are defined, vectors, clocks that wrap or are damaged."""

import numpy as np
import pytest
from bad_files import complaint
from make_files import GEOMETRY, evt4_words, evt21_words

from bicode_lab.events import make_events
from bicode_lab.recordings import open_recording

HEADS = {
    "EVT2.1": b"% format EVT21;endianness=little\n" + GEOMETRY + b"% end\n",
    "EVT4": b"% format EVT4\n" + GEOMETRY + b"% end\n",
}


def evt21(*words):
    """Return an EVT2.1 file of pairs: the upper half of a word and the lower."""
    return HEADS["EVT2.1"] + np.array([upper << 32 | lower for upper, lower in words], np.uint64).tobytes()


def evt4(*words):
    return HEADS["EVT4"] + np.array(words, np.uint32).tobytes()


def rows(path, content, lenient=False):
    path.write_bytes(content)
    recording = open_recording(path, lenient=lenient)
    return recording.read().tolist(), recording.dropped


def test_a_vector_of_32_columns(tmp_path):
    found, _ = rows(tmp_path / "a.raw", evt21((0x80000001, 0), (1 << 28 | 5 << 22 | 10 << 11 | 7, 0x80000005)))
    assert found == [(10, 7, 1, 69), (12, 7, 1, 69), (41, 7, 1, 69)]
    found, _ = rows(
        tmp_path / "a.raw", evt4(14 << 28 | 1, 13 << 28 | 5 << 22 | 10 << 11 | 7, 0x80000005, 10 << 28 | 6 << 22 | 3)
    )
    assert found == [(10, 7, 1, 69), (12, 7, 1, 69), (41, 7, 1, 69), (0, 3, 0, 70)]


def test_the_halves_may_be_swapped(tmp_path):
    """So says the header, or the half with the time words where it says nothing."""
    words = evt21_words(make_events([1, 2, 9], [3, 3, 4], [1, 1, 0], [100, 100, 900]))
    swapped = words.view("<u4").reshape(-1, 2)[:, ::-1].tobytes()
    expected = [(1, 3, 1, 100), (2, 3, 1, 100), (9, 4, 0, 900)]
    for head in (b"% evt 2.1\n", b"% format EVT21;endianness=legacy\n", b"% evt 2.1\n% endianness legacy\n"):
        assert rows(tmp_path / "a.raw", head + GEOMETRY + swapped)[0] == expected
    assert rows(tmp_path / "a.raw", b"% evt 2.1\n" + GEOMETRY + words.tobytes())[0] == expected


@pytest.mark.parametrize("name", HEADS)
def test_the_clock_wraps(tmp_path, name):
    encode, kind = (evt21_words, np.uint64) if name == "EVT2.1" else (evt4_words, np.uint32)
    late = encode(make_events([1], [2], [0], [(1 << 34) - 1]))
    early = encode(make_events([1], [2], [0], [64]))
    found, _ = rows(tmp_path / "a.raw", HEADS[name] + np.concatenate([late, early]).astype(kind).tobytes())
    assert [t for *_, t in found] == [(1 << 34) - 1, (1 << 34) + 64]


@pytest.mark.parametrize("name", HEADS)
def test_one_damaged_time_word_does_not_carry_the_clock_away(tmp_path, name):
    encode = evt21_words if name == "EVT2.1" else evt4_words
    events = make_events(np.arange(20), np.full(20, 3), np.zeros(20), 64 * np.arange(20) + 1)
    words = encode(events)
    words[2 * 8] ^= np.uint64(1 << 52) if name == "EVT2.1" else np.uint32(1 << 20)
    found, dropped = rows(tmp_path / "a.raw", HEADS[name] + words.tobytes(), lenient=True)
    assert found == events.tolist(), "its neighbours say what it was"
    assert dropped == {"time words that those after them contradict": 1}
    assert "1 time words are contradicted by those after them" in complaint(tmp_path / "a.raw")


@pytest.mark.parametrize("name", HEADS)
def test_one_damaged_event_time_costs_one_event(tmp_path, name):
    encode = evt21_words if name == "EVT2.1" else evt4_words
    events = make_events(np.arange(20), np.full(20, 3), np.zeros(20), 64 + np.arange(20))
    words = encode(events)
    words[8] ^= np.uint64(1 << 59) if name == "EVT2.1" else np.uint32(1 << 27)
    found, dropped = rows(tmp_path / "a.raw", HEADS[name] + words.tobytes(), lenient=True)
    assert found == [row for row in events.tolist() if row[0] != 7]
    assert dropped == {"events with a damaged time": 1}


def test_events_without_a_time_outside_the_sensor_and_words_of_no_kind(tmp_path):
    line = complaint(tmp_path / "a.raw", evt21((7, 1), (0x80000001, 0), (7, 1)))
    assert line.startswith("1 of 2 events have no time word before them; the first is number 0 at byte")
    line = complaint(tmp_path / "a.raw", evt4(14 << 28 | 1, 12 << 28 | 345 << 11, 3))
    assert line.startswith("1 of 2 events have x outside the 346 px wide sensor; the first is number 1 at byte")
    for content in (evt21((0x80000001, 0), (5 << 28, 1), (13 << 28, 1)), evt4(14 << 28 | 1, 5 << 28, 8 << 28)):
        assert complaint(tmp_path / "a.raw", content).startswith("2 words have no known kind; the first is at byte")
    for content in (evt21((0x80000001, 0), (0, 0), (0, 0)), evt4(14 << 28 | 1, 0, 0)):
        assert complaint(tmp_path / "a.raw", content).startswith("2 words are blank (all zero)")


def test_words_that_hold_no_events_are_passed_over(tmp_path):
    found, _ = rows(tmp_path / "a.raw", evt21((0x80000001, 0), (14 << 28, 9), (15 << 28, 9), (9 << 28, 9), (7, 1)))
    assert found == [(0, 7, 0, 64)]
    assert open_recording(tmp_path / "a.raw").read().size == 1
    found, _ = rows(tmp_path / "a.raw", evt4(14 << 28 | 1, 6 << 28, 7 << 28, 0xFFFFFFFF, 11 << 28 | 7))
    assert found == [(0, 7, 1, 64)]


def test_the_bits_of_a_vector_are_no_words(tmp_path):
    """They may look like a time word."""
    found, _ = rows(tmp_path / "a.raw", evt4(14 << 28 | 1, 12 << 28 | 7, 14 << 28 | 9, 10 << 28 | 7, 14 << 28 | 2))
    assert [x for x, *_ in found] == [0, 3, 29, 30, 31, 0]
    assert {t for *_, t in found} == {64}


def test_a_vector_cut_at_the_end(tmp_path):
    assert "cut short at byte" in complaint(tmp_path / "a.raw", evt4(14 << 28 | 1, 10 << 28, 12 << 28))
    found, dropped = rows(tmp_path / "a.raw", evt4(14 << 28 | 1, 10 << 28, 12 << 28), lenient=True)
    assert (len(found), dropped) == (1, {"bytes at the cut end": 4})


@pytest.mark.parametrize("name", HEADS)
def test_many_blocks(tmp_path, name):
    rng = np.random.default_rng(3)
    n = 60_000
    events = make_events(rng.integers(0, 340, n), rng.integers(0, 260, n), rng.integers(0, 2, n), np.arange(n) * 40)
    encode = evt21_words if name == "EVT2.1" else evt4_words
    assert np.array_equal(
        make_events(*zip(*rows(tmp_path / "a.raw", HEADS[name] + encode(events).tobytes())[0], strict=True)), events
    )
