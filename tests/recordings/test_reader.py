"""Tests of reading: the events are those of the file, with the times of its own clock, in bounded memory."""

import tracemalloc

import evt3
import faery
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicode_lab.events import EVENT_DTYPE, check_events, make_events, no_events, windows
from bicode_lab.recordings import RecordingError, open_recording, write_npz
from bicode_lab.recordings.reader import MAX_CHUNK_EVENTS

SIZE_PX = (640, 480)
FAERY = [("a.raw", "evt2"), ("b.raw", "evt3"), ("a.dat", None), ("a.aedat4", None), ("a.es", None), ("a.csv", None)]
FORMATS = ["EVT2", "EVT3", "DAT", "AEDAT4", "ES", "CSV"]

REAL = {  # file: format, width, height, where the size is from, events, first and last t
    "evk4_scene_evt3.raw": ("EVT3", 1280, 720, "file", 1_218_618, 11_200_224, 21_968_221),
    "evk4_scene.dat": ("DAT", 1280, 720, "file", 1_218_618, 5_856, 5_856 + 21_968_221 - 11_200_224),
    "evk3_short_evt3.raw": ("EVT3", 1280, 720, "sensor", 219_596, 11_718_656, 11_727_457),
    "sparklers_evt2.raw": ("EVT2", 640, 480, "sensor", 521_252, 913_716_224, 913_812_095),
    "davis346.aedat4": ("AEDAT4", 346, 260, "file", 78_830, 1_589_163_147_368_868, 1_589_163_149_728_813),
}


def write_with_faery(path, events, version=None):
    """Write events with faery, and return the path."""
    theirs = np.empty(events.size, faery.EVENTS_DTYPE)
    for name, ours in (("t", "t"), ("x", "x"), ("y", "y"), ("on", "p")):
        theirs[name] = events[ours]
    faery.events_stream_from_array(theirs, SIZE_PX).to_file(str(path), version=version)
    return path


def decode_evt3_plainly(path, n_words):
    """Decode the first words of an EVT3 file to rows x, y, p, t, word by word as the format is defined."""
    data = path.read_bytes()
    while data.startswith(b"%"):
        data = data.split(b"\n", 1)[1]
    x = y = p = high = low = wraps = 0
    rows = []
    for word in np.frombuffer(data, "<u2", n_words).tolist():
        kind, value = word >> 12, word & 0xFFF
        t = (wraps << 24) + (high << 12) + low
        if kind == 0x0:
            y = value & 0x7FF
        elif kind in (0x2, 0x3):
            x, p = value & 0x7FF, value >> 11
            rows += [(x, y, p, t)] if kind == 0x2 else []
        elif kind in (0x4, 0x5):
            rows += [(x + bit, y, p, t) for bit in range(12) if value >> bit & 1]
            x += 12 if kind == 0x4 else 8
        elif kind == 0x6:
            low = value
        elif kind == 0x8:
            wraps += value < high
            high, low = value, (low if value == high else 0)
    return np.array(rows)


@pytest.mark.parametrize("name", REAL)
def test_real_recordings_hold_what_their_readme_says(real_recordings, name):
    recording = open_recording(real_recordings / name)
    events = recording.read()
    check_events(events, recording.width, recording.height)
    assert REAL[name] == (
        recording.format,
        recording.width,
        recording.height,
        recording.size_from,
        events.size,
        events["t"][0],
        events["t"][-1],
    )


def test_raw_and_dat_of_one_scene_differ_by_a_constant_time(real_recordings):
    raw, dat = (open_recording(real_recordings / f"evk4_scene{end}").read() for end in ("_evt3.raw", ".dat"))
    assert set((raw["t"] - dat["t"]).tolist()) == {11_200_224 - 5_856}
    assert all((raw[name] == dat[name]).all() for name in ("x", "y", "p"))


@pytest.mark.parametrize("name", ["evk4_scene_evt3.raw", "evk3_short_evt3.raw"])
def test_evt3_is_read_as_the_format_is_defined(real_recordings, name):
    plain = decode_evt3_plainly(real_recordings / name, 200_000)
    events = open_recording(real_recordings / name).read()[: len(plain)]
    assert np.array_equal(np.stack([events[field] for field in ("x", "y", "p", "t")], axis=1), plain)


@pytest.mark.parametrize("name", ["evk4_scene_evt3.raw", "evk3_short_evt3.raw"])
def test_evt3_agrees_with_the_package_evt3(real_recordings, name):
    events = open_recording(real_recordings / name).read()
    theirs = evt3.decode_file(str(real_recordings / name))
    for field in ("x", "y", "p", "t"):
        assert np.array_equal(getattr(theirs, field), events[field])


@pytest.mark.parametrize(
    ("name", "late_us", "share"),
    [("evk4_scene_evt3.raw", 0, 0), ("sparklers_evt2.raw", 0, 0), ("evk3_short_evt3.raw", 11, 0.0066)],
)
def test_evt_agrees_with_faery_but_where_the_sensor_corrects_a_time_word(real_recordings, name, late_us, share):
    """Where the sensor corrects a time word, faery keeps the later time: 0.66 % of the events are 1 to 11 us late."""
    events = open_recording(real_recordings / name).read()
    packets = list(faery.events_stream_from_file(real_recordings / name))
    for ours, field in (("x", "x"), ("y", "y"), ("p", "on")):
        assert np.array_equal(np.concatenate([packet[field] for packet in packets]), events[ours])
    late = np.concatenate([packet["t"] for packet in packets]).astype(np.int64) - events["t"]
    assert (late.min(), late.max()) == (0, late_us)
    assert np.count_nonzero(late) / late.size == pytest.approx(share, abs=0.0001)


@pytest.mark.parametrize("name", REAL)
def test_a_good_recording_reads_the_same_leniently(real_recordings, name):
    recording = open_recording(real_recordings / name, lenient=True)
    assert np.array_equal(recording.read(), open_recording(real_recordings / name).read())
    assert recording.dropped == {}


def test_memory_stays_bounded(real_recordings):
    recording = open_recording(real_recordings / "evk4_scene.dat", chunk_us=10_000)
    next(iter(recording))  # compiles the checks
    tracemalloc.start()
    try:
        n_events = sum(chunk.size for chunk in recording)
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 0.25 * n_events * EVENT_DTYPE.itemsize


@pytest.mark.parametrize(("file", "label"), list(zip(FAERY, FORMATS, strict=True)), ids=FORMATS)
def test_every_format_gives_back_the_events_written(tmp_path, some_events, file, label):
    name, version = file
    path = write_with_faery(tmp_path / name, some_events, version)
    recording = open_recording(path)
    assert (recording.format, recording.width, recording.height) == (label, *SIZE_PX)
    expected = some_events.copy()
    if label == "ES":  # stores time as steps, so faery begins it at 0
        expected["t"] -= expected["t"][0]
    assert recording.read().tolist() == expected.tolist()
    assert recording.read().tolist() == expected.tolist(), "a recording can be read again"
    assert open_recording(path, lenient=True).read().tolist() == expected.tolist()


def test_the_content_decides_the_format(tmp_path, some_events):
    path = write_with_faery(tmp_path / "a.raw", some_events, "evt3").rename(tmp_path / "recording")
    assert open_recording(path).read().tolist() == some_events.tolist()


def test_csv_columns_may_come_in_any_order(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("x, y, p, t\n1,2,1,10\n3,4,0,20\n")
    recording = open_recording(path, width=8, height=6)
    assert recording.read().tolist() == [(1, 2, 1, 10), (3, 4, 0, 20)]
    assert (recording.width, recording.height, recording.size_from) == (8, 6, "caller")
    assert open_recording(path).size_from == "assumed"


@given(
    times=st.lists(st.integers(0, 3000), max_size=60),
    cuts=st.lists(st.integers(0, 60), max_size=6),
    chunk_us=st.integers(1, 900),
    max_events=st.integers(1, 20),
)
def test_chunks_do_not_depend_on_how_the_file_was_cut(times, cuts, chunk_us, max_events):
    events = make_events(np.arange(len(times)), np.zeros(len(times)), np.zeros(len(times)), times)
    pieces = np.split(events, np.sort(np.minimum(cuts, len(times))).astype(int)) if cuts else [events]
    chunks = [part for _, part in windows(pieces, chunk_us, max_events=max_events)]
    assert np.concatenate([no_events(), *chunks]).tolist() == events.tolist()
    assert all(1 <= chunk.size <= max_events for chunk in chunks)
    spans = [(chunk["t"] - events["t"][0]) // chunk_us for chunk in chunks]
    assert all(len(set(window)) == 1 for window in spans), "a chunk lies within one window of chunk_us"
    whole = [part for _, part in windows([events], chunk_us, max_events=max_events)]
    assert [chunk.tolist() for chunk in chunks] == [chunk.tolist() for chunk in whole]


def test_a_chunk_never_holds_more_than_a_million_events(tmp_path):
    n = MAX_CHUNK_EVENTS + 5
    write_npz(tmp_path / "a.npz", make_events(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)), *SIZE_PX)
    assert [chunk.size for chunk in open_recording(tmp_path / "a.npz")] == [MAX_CHUNK_EVENTS, 5]


@pytest.mark.parametrize("n", [0, 1, 1000])
def test_npz_gives_back_what_was_written_and_no_other_bytes(tmp_path, some_events, n):
    for name in ("a.npz", "b.npz"):
        write_npz(tmp_path / name, some_events[:n], *SIZE_PX)
    recording = open_recording(tmp_path / "a.npz")
    assert recording.read().tolist() == some_events[:n].tolist()
    assert recording.read().dtype == EVENT_DTYPE
    assert (recording.width, recording.height, recording.size_from) == (*SIZE_PX, "file")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, some_events, monkeypatch):
    path = tmp_path / "a.npz"
    write_npz(path, some_events, *SIZE_PX)
    before = path.read_bytes()

    def fill_the_disk(file, **_arrays):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fill_the_disk)
    with pytest.raises(RecordingError, match=r"a\.npz: cannot be written \(No space left on device\)"):
        write_npz(path, some_events[:3], *SIZE_PX)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]


def test_only_good_events_are_written(tmp_path, some_events):
    with pytest.raises(ValueError, match="x outside the 100 px wide sensor"):
        write_npz(tmp_path / "a.npz", some_events, 100, 480)
    with pytest.raises(RecordingError, match=r"a\.raw: write_npz writes npz"):
        write_npz(tmp_path / "a.raw", some_events, *SIZE_PX)
    assert not list(tmp_path.iterdir())


def test_an_npz_may_leave_its_size_to_the_caller(tmp_path):
    np.savez(tmp_path / "a.npz", x=[1], y=[2], p=np.array([True]), t=[3])
    assert open_recording(tmp_path / "a.npz").size_from == "assumed"
    recording = open_recording(tmp_path / "a.npz", width=4, height=3)
    assert (recording.width, recording.height) == (4, 3)
    assert recording.read().tolist() == [(1, 2, 1, 3)]


def test_the_size_must_agree_with_the_file(tmp_path, some_events):
    write_npz(tmp_path / "a.npz", some_events, *SIZE_PX)
    assert open_recording(tmp_path / "a.npz", width=640, height=480).size_from == "file"
    with pytest.raises(RecordingError, match="width=64, height=48 but the file says 640x480; leave width and height"):
        open_recording(tmp_path / "a.npz", width=64, height=48)
    with pytest.raises(ValueError, match="width=64 and height=None: one is missing; give both or neither"):
        open_recording(tmp_path / "a.npz", width=64)
    with pytest.raises(ValueError, match="chunk_us=0 is shorter than 1 us; choose 1 or more"):
        open_recording(tmp_path / "a.npz", chunk_us=0)


def test_a_named_sensor_gives_the_size_unless_the_caller_knows_better(tmp_path):
    path = tmp_path / "a.raw"
    path.write_bytes(b"% evt 2.0\n% plugin_name hal_plugin_genx320_evk\n" + np.array([0x80000001, 0], "<u4").tobytes())
    assert open_recording(path).size_from == "sensor"
    assert (open_recording(path).width, open_recording(path).height) == (320, 320)
    assert (open_recording(path, width=9, height=9).width, open_recording(path).read().size) == (9, 1)
