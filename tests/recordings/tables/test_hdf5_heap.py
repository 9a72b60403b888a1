"""Tests of the heap of an HDF5 file: its texts are those that h5py has written, and damage ends nowhere."""

import struct

import h5py
import numpy as np

from bicode_lab.recordings import open_recording
from bicode_lab.recordings.tables.hdf5_heap import heap_texts


def write(path, texts):
    with h5py.File(path, "w") as file:
        for name, text in texts.items():
            file.attrs[name] = text
        for name in "xypt":
            file[f"events/{name}"] = [1]


def test_texts_that_h5py_has_written(tmp_path):
    texts = {"geometry": "64x48", "serial": "M\u00fcller", "empty": "", "long": "a" * 300}
    write(tmp_path / "a.h5", texts)
    assert set(texts.values()) - {""} <= set(heap_texts(tmp_path / "a.h5"))
    assert (open_recording(tmp_path / "a.h5").width, open_recording(tmp_path / "a.h5").height) == (64, 48)


def test_damaged_heaps_end(tmp_path):
    write(tmp_path / "a.h5", {"geometry": "64x48", "other": "12"})
    whole = bytearray((tmp_path / "a.h5").read_bytes())
    start = whole.find(b"GCOL")
    rng = np.random.default_rng(5)
    for k in range(300):
        damaged = bytearray(whole)
        if k < 3:  # an object whose length brings the reader back to where it was
            struct.pack_into("<Q", damaged, start + 24, (1 << 64) - 16 * k - 1)
        else:
            damaged[start + int(rng.integers(4, 64))] = int(rng.integers(256))
        (tmp_path / "a.h5").write_bytes(damaged)
        assert all(len(text) <= 4096 for text in heap_texts(tmp_path / "a.h5"))


def test_numbers_where_a_text_is_due_and_texts_where_numbers_are(tmp_path):
    write(tmp_path / "a.h5", {"geometry": 5, "t_offset": 7})
    recording = open_recording(tmp_path / "a.h5")
    assert recording.size_from == "assumed"
    assert recording.read()["t"].tolist() == [8]
