"""Tests with thousands of broken files: each gives good events or an error of one line that says where.

Each file is read strictly and leniently, and must keep the rules of both (see `survive`).
"""

import re

import numpy as np
import pytest

from bicode_lab.events import check_events, make_events
from bicode_lab.recordings import RecordingError, open_recording, write_recording
from bicode_lab.recordings.raw.evt3_write import evt3_header

SIZE_PX = (640, 480)
EVT2_HEAD = b"% evt 2.0\n% geometry 640x480\n% end\n"
EVT3_HEAD = evt3_header(*SIZE_PX)
FORMATS = ["EVT2", "EVT3", "DAT", "CSV", "AEDAT4", "HDF5", "npz"]
SUFFIX = {
    "EVT2": ".raw",
    "EVT3": ".raw",
    "DAT": ".dat",
    "CSV": ".csv",
    "AEDAT4": ".aedat4",
    "HDF5": ".h5",
    "npz": ".npz",
}
COUNTED = {"random bytes": 1200, "random words": 1500, "flipped bytes": 1500, "cut and zeros": 600}


def few_events(seed=0, n=40):
    """Return events with rows that switch at once, over two time words and a turn of the 24-bit clock."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(3):
        x = np.flatnonzero(rng.random(48) < 0.5) + 64 * k
        rows.append(np.stack([x, np.full(x.size, 7 * k), np.full(x.size, k % 2), np.full(x.size, 90 * k)]))
    single = [rng.integers(0, side, n) for side in (*SIZE_PX, 2)]
    rows.append(np.stack([*single, np.sort(rng.integers(300, 12_000, n))]))
    return make_events(*np.concatenate(rows, axis=1))


def evt2_bytes(events):
    """Return events as EVT2 words, with one time word for each event."""
    words = []
    for x, y, p, t in events.tolist():
        words += [0x80000000 | t >> 6, p << 28 | (t & 63) << 22 | x << 11 | y]
    return EVT2_HEAD + np.array(words, "<u4").tobytes()


@pytest.fixture(scope="module")
def small_files(tmp_path_factory):
    """Return the bytes of a small good file of each format."""
    folder = tmp_path_factory.mktemp("small")
    events = few_events()
    files = {"EVT2": evt2_bytes(events)}
    for name in FORMATS[1:]:
        path = folder / f"a{SUFFIX[name]}"
        write_recording(path, events, *SIZE_PX)
        files[name] = path.read_bytes()
    return files


def read(path, lenient):
    """Return a recording and its events; if it cannot be read, None and the error message."""
    try:
        recording = open_recording(path, lenient=lenient)
        return recording, recording.read()
    except RecordingError as error:
        line = str(error)
        assert line.startswith(f"{path}: ")
        assert "\n" not in line
        return None, line


def survive(path, content):
    """Read a file strictly and leniently, check the rules of both, and return the lenient recording and events."""
    path.write_bytes(content)
    strict, events = read(path, lenient=False)
    recording, good = read(path, lenient=True)
    for opened, found in ((strict, events), (recording, good)):
        if opened is not None:
            check_events(found, opened.width, opened.height)
    if strict is not None:
        assert recording.dropped == {}, "what is read strictly has nothing to drop"
        assert np.array_equal(events, good)
    elif path.suffix in (".raw", ".dat", ".csv"):
        assert re.search(
            r"at (byte|line) [\d,]+|line [\d,]+ |byte [\d,]+|not an event file|empty|names no|says", events
        )
    return recording, good


def plain_rows(content, words, bits):
    """Decode EVT2 or EVT3 words of a good file to rows x, y, p, t, word by word as the format is defined."""
    rows, high, low, x, y, p = [], 0, 0, 0, 0, 0
    for word in words.tolist():
        kind, value = word >> (bits - 4), word & ((1 << bits - 4) - 1)
        if kind == 8:
            high, low = value, 0
        elif bits == 32:
            rows += [(value >> 11 & 0x7FF, value & 0x7FF, kind, high << 6 | value >> 22)]
        elif kind == 0:
            y = value
        elif kind in (2, 3):
            x, p = value & 0x7FF, value >> 11
            rows += [(x, y, p, high << 12 | low)] if kind == 2 else []
        elif kind in (4, 5):
            rows += [(x + bit, y, p, high << 12 | low) for bit in range(12) if value >> bit & 1]
            x += 12
        elif kind == 6:
            low = value
    return rows


@pytest.mark.parametrize("name", FORMATS)
def test_cut_at_every_byte(tmp_path, small_files, name):
    whole = small_files[name]
    everything = few_events().tolist()
    step = 7 if name in ("HDF5", "npz") else 1
    for length in range(0, len(whole), step):
        recording, good = survive(tmp_path / f"a{SUFFIX[name]}", whole[:length])
        if recording is None:
            assert name in ("HDF5", "npz") or length < len(whole) // 2, "only a cut head leaves nothing to read"
        elif name in ("EVT2", "EVT3"):
            bits, head = (32, EVT2_HEAD) if name == "EVT2" else (16, EVT3_HEAD)
            words = whole[len(head) : length]
            words = np.frombuffer(words[: len(words) // (bits // 8) * (bits // 8)], f"<u{bits // 8}")
            assert good.tolist() == plain_rows(whole, words, bits), "every whole event before the cut"
        elif name != "CSV":  # a CSV's last number may have lost digits
            assert good.tolist() == everything[: good.size]


@pytest.mark.parametrize("name", ["EVT2", "EVT3"])
def test_begun_in_mid_stream(tmp_path, small_files, name):
    head = EVT2_HEAD if name == "EVT2" else EVT3_HEAD
    body = small_files[name][len(head) :]
    word = 4 if name == "EVT2" else 2
    for start in range(word, len(body), word):
        recording, good = survive(tmp_path / "a.raw", head + body[start:])
        assert set(good.tolist()) <= set(few_events().tolist()), "an event without a known time or place is left out"
        assert set(recording.dropped) <= {"events before the first time word", "events without a row or column"}


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("kind", COUNTED)
def test_damaged_at_random(tmp_path, small_files, name, kind):
    rng = np.random.default_rng([FORMATS.index(name), list(COUNTED).index(kind)])
    whole = small_files[name]
    words = name in ("EVT2", "EVT3")
    head = {"EVT2": len(EVT2_HEAD), "EVT3": len(EVT3_HEAD), "DAT": whole.find(b"\x0c\x08") + 2}.get(name, 40)
    for _ in range(COUNTED[kind] if words else COUNTED[kind] // 8):
        if kind == "random bytes":
            content = whole[: rng.choice([0, head])] + rng.bytes(rng.integers(1, 400))
        elif kind == "random words":
            content = whole[:head] + likely_words(rng, name)
        elif kind == "flipped bytes":
            damaged = np.frombuffer(whole, "u1").copy()
            damaged[rng.integers(0, len(whole), rng.integers(1, 8))] ^= np.uint8(1 << rng.integers(8))
            content = damaged.tobytes()
        else:
            cut, gap = rng.integers(0, len(whole)), int(rng.integers(1, 300))
            content = whole[:cut] + bytes(gap) + (whole[cut + gap :] if rng.random() < 0.5 else b"")
        survive(tmp_path / f"a{SUFFIX[name]}", content)


def likely_words(rng, name):
    """Return words of every kind with mostly small values, which occur together more often than random words would."""
    n = rng.integers(1, 150)
    if name == "EVT3":
        kinds = rng.choice([0, 2, 2, 3, 4, 5, 6, 6, 8, 8, 7, 14, 15, 1], n)
        values = np.where(rng.random(n) < 0.5, rng.integers(0, 4096, n), rng.choice([0, 1, 2, 5, 4094, 4095], n))
        return (kinds << 12 | values).astype("<u2").tobytes()
    kinds = rng.choice([0, 1, 8, 8, 10, 14, 15, 5], n)
    values = np.where(rng.random(n) < 0.5, rng.integers(0, 1 << 28, n), rng.choice([0, 1, 2, 70, (1 << 28) - 1], n))
    return (kinds << 28 | values).astype("<u4").tobytes()


def test_how_many_cases_that_makes(small_files):
    cuts = sum(len(whole) // (7 if name in ("HDF5", "npz") else 1) for name, whole in small_files.items())
    starts = sum(len(small_files[name]) // size for name, size in (("EVT2", 4), ("EVT3", 2)))
    random = sum(count * 2 + count // 8 * 5 for count in COUNTED.values())
    assert cuts + starts + random >= 10_000
