"""Tests of external triggers: each is kept with its time, input and level, in every format that has them."""

import h5py
import numpy as np
import pytest
from bad_files import complaint, evt2, evt3
from make_files import AEDAT3_HEAD, GEOMETRY, aedat3_packet

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording

EVENTS = make_events([1, 2, 3], [4, 5, 6], [0, 1, 0], [4100, 4200, 4300])


def triggers_of(path, content=None, lenient=False):
    """Return the external triggers of a file as rows (time, input, level), after reading it to the end."""
    if content is not None:
        path.write_bytes(content)
    recording = open_recording(path, lenient=lenient)
    assert recording.triggers.size == 0, "nothing was read yet"
    n_events = recording.read().size
    return [(t, number, level) for level, t, number in recording.triggers.tolist()], n_events, recording.remarks


def test_evt3(tmp_path):
    found, n_events, remarks = triggers_of(
        tmp_path / "a.raw", evt3(0x8001, 0x6010, 0xA101, 0x0005, 0x2001, 0x6011, 0xAF00, 0xA001)
    )
    assert found == [(4112, 1, 1), (4113, 15, 0), (4113, 0, 1)]
    assert n_events == 1
    assert triggers_of(tmp_path / "a.raw", lenient=True)[0] == found, "a time word of a trigger alone is used, too"
    assert remarks == ["3 external triggers (bicode decode --triggers lists them)"]


def test_evt2(tmp_path):
    word = 10 << 28 | 7 << 22 | 31 << 8 | 1
    assert triggers_of(tmp_path / "a.raw", evt2(0x80000002, word, 0))[0] == [(135, 31, 1)]


def test_evt21_and_evt4(tmp_path):
    word = 7 << 22 | 3 << 8 | 1
    words = np.array([(0x80000002 << 32), (10 << 28 | word) << 32, 1 << 32 | 1], np.uint64)
    head = b"% format EVT21;endianness=little\n" + GEOMETRY + b"% end\n"
    assert triggers_of(tmp_path / "a.raw", head + words.tobytes())[:2] == ([(135, 3, 1)], 1)
    words = np.array([14 << 28 | 2, 9 << 28 | word | 0x7F << 1, 10 << 28 | 1], np.uint32)
    head = b"% format EVT4\n" + GEOMETRY + b"% end\n"
    assert triggers_of(tmp_path / "a.raw", head + words.tobytes())[:2] == ([(135, 3, 1)], 1)


def test_the_time_of_the_header_is_added(tmp_path):
    content = evt3(0x8001, 0xA101).replace(b"% end", b"% t0 7000000\n% end")
    assert triggers_of(tmp_path / "a.raw", content)[0] == [(7_004_096, 1, 1)]


def test_more_triggers_than_the_buffer_holds(tmp_path):
    words = [0x8001] + [word for k in range(5000) for word in (0x6000 | k % 4096, 0xA000 | k % 2)]
    found = triggers_of(tmp_path / "a.raw", evt3(*words), lenient=True)[0]
    assert len(found) == 5000
    assert triggers_of(tmp_path / "a.raw", evt2(0x80000002, *[10 << 28] * 9000))[0] == [(128, 0, 0)] * 9000


def test_a_trigger_without_a_time(tmp_path):
    line = complaint(tmp_path / "a.raw", evt3(0xA101, 0x8001, 0x0005, 0x2001))
    assert line.startswith(
        "1 external triggers have no time word before them; the first is at byte 35 (0xa101, after 0"
    )
    recording = open_recording(tmp_path / "a.raw", lenient=True)
    assert recording.read().size == 1
    assert recording.dropped == {"external triggers without a known time": 1}


def test_the_vendors_hdf5(tmp_path):
    rows = np.array([(1, 4150, 0), (0, 4250, 1)], [("p", "i2"), ("t", "i8"), ("id", "i2")])
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["CD/events"] = EVENTS
        file["EXT_TRIGGER/events"] = rows
    assert triggers_of(tmp_path / "a.h5")[:2] == ([(4150, 0, 1), (4250, 1, 0)], 3)


def test_aedat2(tmp_path):
    pairs = [(10 << 22 | 20 << 12, 5), (0x400, 6), (1 << 31 | 0x400, 7), (10 << 22 | 20 << 12 | 0x800, 8)]
    head = b"#!AER-DAT2.0\r\n# AEChip: eu.seebetter.ini.chips.davis.DAVIS240C\r\n"
    found, n_events, _ = triggers_of(tmp_path / "a.aedat", head + np.array(pairs, ">u4").tobytes())
    assert (found, n_events) == ([(6, 0, 1)], 2), "the third word belongs to a frame"


def test_aedat3(tmp_path):
    specials = [(1 | kind << 1, 100 + kind) for kind in range(6)] + [(2 << 1, 200)]
    packets = aedat3_packet([(1 | 5 << 17, 50)]) + aedat3_packet(specials, kind=0) + aedat3_packet([(1, 2**31 + 9)])
    found, n_events, _ = triggers_of(tmp_path / "a.aedat", AEDAT3_HEAD + packets)
    assert (found, n_events) == ([(102, 0, 1), (103, 0, 0), (104, 0, 1)], 2), "an event that is not valid is none"
    assert open_recording(tmp_path / "a.aedat").read()["t"].tolist() == [50, 2**31 + 9]


def test_a_dat_file_of_triggers_alone_is_named(tmp_path):
    with pytest.raises(RecordingError, match="holds external triggers and no events; give the file of CD events"):
        triggers_of(tmp_path / "a.dat", b"% Version 2\n\x0e\x08" + bytes(8))
