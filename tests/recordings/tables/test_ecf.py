"""Tests of the vendor's codec ECF: three ways to pack, long steps and runs, files, and chunks that are cut short."""

import struct

import h5py
import numpy as np
import pytest

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording
from bicode_lab.recordings.tables.ecf import ECF_FILTER, decode_ecf


def runs(values):
    """Yield (value, count) of successive equal values."""
    start = 0
    for i in range(1, len(values) + 1):
        if i == len(values) or values[i] != values[start]:
            yield values[start], i - start
            start = i


def encode(events, flags):
    """Encode events as the codec does; flags 0 packs nothing, 1 columns and polarities, 2 rows, too."""
    x, y, p, t = (events[name].tolist() for name in ("x", "y", "p", "t"))
    out = struct.pack("<IQ", len(x) << 2 | flags, t[0])
    now = t[0]
    for time, count in runs(t):
        step = time - now
        if step >= 15:
            while step:
                out += bytes([0xF0 | step & 15])
                step >>= 4
        out += bytes([step << 4 | min(count, 15)]) + (struct.pack("<H", count) if count >= 15 else b"")
        now = time
    if flags == 2:
        return out + packed([r << 12 | c << 1 | q for r, c, q in zip(y, x, p, strict=True)], 8, "<I")
    for row, count in runs(y):
        out += struct.pack("<H", row << 5 | min(count, 31)) + (struct.pack("<H", count) if count >= 31 else b"")
    if flags == 1:
        return out + packed([c << 1 | q for c, q in zip(x, p, strict=True)], 4, "<H")
    i = 0
    while i < len(x):
        first, mask = x[i], 0
        i += 1
        while i < len(x) and x[i - 1] < x[i] <= first + 5:
            mask |= 1 << 5 - (x[i] - first)
            i += 1
        out += struct.pack("<H", first << 5 | mask)
    for polarity, count in runs(p):
        out += bytes([polarity << 7 | min(count, 127)]) + (struct.pack("<H", count) if count >= 127 else b"")
    return out


def packed(values, part, kind):
    """Return values of 3 parts of a word, four in three words of 4 parts."""
    out = b""
    for i in range(0, len(values), 4):
        a, b, c, d = [*values[i : i + 4], 0, 0, 0][:4]
        low, middle = (1 << part) - 1, (1 << 2 * part) - 1
        words = (a << part | b & low, (b >> part) << 2 * part | c & middle, (c >> 2 * part) << 3 * part | d)
        out += b"".join(struct.pack(kind, word) for word in words)
    return out


def some(n=500, seed=0):
    """Return events with rows that switch at once, long runs and long steps."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([np.arange(200), rng.integers(0, 1280, n - 200)])
    y = np.concatenate([np.full(200, 7), rng.integers(0, 720, n - 200)])
    p = np.concatenate([np.ones(200), rng.integers(0, 2, n - 200)])
    t = np.concatenate([np.full(200, 3), 3 + np.cumsum(rng.choice([0, 1, 14, 15, 16, 300, 70_000], n - 200))])
    return make_events(x, y, p, t + (1 << 40))


@pytest.mark.parametrize("flags", [0, 1, 2])
@pytest.mark.parametrize("n", [201, 202, 203, 500])
def test_what_was_packed_is_unpacked(flags, n):
    assert decode_ecf(encode(some(n), flags)).tolist() == some(n).tolist()


def test_five_neighbours_in_one_word():
    events = make_events([10, 11, 15, 9, 10, 16], [3] * 6, [0] * 6, [5] * 6)
    assert decode_ecf(encode(events, 0)).tolist() == events.tolist()


@pytest.mark.parametrize("flags", [0, 1, 2])
def test_a_chunk_cut_short(flags):
    whole = encode(some(), flags)
    for length in [0, 5, 11, 12, *range(13, len(whole) - 2, 97)]:
        with pytest.raises(ValueError, match="ECF chunk"):
            decode_ecf(whole[:length])
    with pytest.raises(ValueError, match="ECF chunk of 65536 events; there are at most 65535"):
        decode_ecf(struct.pack("<IQ", 65536 << 2, 0) + bytes(99))


def write(path, events, chunk, break_it=False):
    """Write an HDF5 file of the vendor's layout with its codec."""
    with h5py.File(path, "w") as file:
        settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        settings.set_chunk((chunk,))
        settings.set_filter(ECF_FILTER, h5py.h5z.FLAG_OPTIONAL, ())
        kind = h5py.h5t.py_create(events.dtype)
        group = file.create_group("CD")
        data_set = h5py.Dataset(
            h5py.h5d.create(group.id, b"events", kind, h5py.h5s.create_simple((events.size,)), settings)
        )
        for k, start in enumerate(range(0, events.size, chunk)):
            rest = np.zeros(chunk, events.dtype)  # HDF5 gives whole chunks to a codec
            part = events[start : start + chunk]
            rest[: part.size] = part
            rest["t"][part.size :] = part["t"][-1]
            data_set.id.write_direct_chunk((start,), encode(rest, k % 3)[: 20 if break_it else None])


def test_a_file_of_several_chunks(tmp_path):
    write(tmp_path / "a.hdf5", some(1000), 300)
    recording = open_recording(tmp_path / "a.hdf5")
    assert recording.read().tolist() == some(1000).tolist()
    write(tmp_path / "a.hdf5", some(1000), 300, break_it=True)
    with pytest.raises(RecordingError, match=r"damaged or cut short \(ECF chunk that is cut short\)"):
        open_recording(tmp_path / "a.hdf5").read()


def test_pieces_that_begin_inside_a_chunk(tmp_path, monkeypatch):
    monkeypatch.setattr("bicode_lab.recordings.tables.columns.PIECE_EVENTS", 170)
    write(tmp_path / "a.hdf5", some(1000), 300)
    assert open_recording(tmp_path / "a.hdf5").read().tolist() == some(1000).tolist()
