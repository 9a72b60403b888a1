"""Tests of writing: two independent readers find every event again in its place and order, in every format."""

import subprocess
import sys
import tracemalloc

import evt3
import faery
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicode_lab.events import EVENT_DTYPE, make_events, no_events
from bicode_lab.recordings import RecordingError, open_recording, write_recording
from bicode_lab.recordings.raw.evt3_write import encode_evt3, evt3_header

SIZE_PX = (1280, 720)
SECOND_US = 1_000_000
try:
    import resource
except ImportError:  # Windows
    resource = None
SUFFIXES = (".raw", ".aedat4", ".dat", ".csv", ".h5", ".npz")


def read_with_faery(path):
    """Return the events that faery reads from a file."""
    packets = list(faery.events_stream_from_file(path))
    columns = [np.concatenate([packet[name] for packet in packets]) for name in ("x", "y", "on", "t")]
    return make_events(*columns)


def read_with_evt3(path):
    """Return the events that the package evt3 reads from a file."""
    found = evt3.decode_file(str(path))
    return make_events(found.x, found.y, found.p, found.t.astype(np.int64))


def encode_plainly(events, width):
    """Encode events by the rules of `evt3_write`, one by one in plain Python."""
    words, high, low, row = [], -1, -1, -1
    rows = events.tolist()
    i = 0
    while i < len(rows):
        x, y, p, t = rows[i]
        while high < t >> 12:
            high, low = high + 1, -1
            words.append(0x8000 | high % 4096)
        if low != t % 4096:
            low = t % 4096
            words.append(0x6000 | low)
        if row != y:
            row = y
            words.append(y)
        base = min(x, max(width - 32, 0))
        group = [x]
        for other in rows[i + 1 :]:
            if other[1:] != (y, p, t) or not group[-1] < other[0] < base + 32:
                break
            group.append(other[0])
        if len(group) > 4 and width >= 32:
            lit = [base + bit in group for bit in range(32)]
            masks = [sum(on << bit for bit, on in enumerate(part)) for part in (lit[:12], lit[12:24], lit[24:])]
            words += [0x3000 | p << 11 | base, 0x4000 | masks[0], 0x4000 | masks[1], 0x5000 | masks[2]]
            i += len(group)
        else:
            words.append(0x2000 | p << 11 | x)
            i += 1
    return words or [0x8000, 0x6000]


def events_with_rows(rng, n_rows, width=1280, density=0.3):
    """Return rows of pixels that switch at once, as the edge of a plate makes them: vectors are meant for these."""
    rows = []
    for k in range(n_rows):
        x = np.flatnonzero(rng.random(width) < density)
        rows.append(np.stack([x, np.full(x.size, k % 720), np.full(x.size, k % 2), np.full(x.size, k // 5 * 7)]))
    return make_events(*np.concatenate(rows, axis=1))


def events_with_gaps(rng, n, start_us):
    """Return random events over more than one turn of the 24-bit clock, with gaps of 25 s and 100 s."""
    t = np.sort(rng.integers(0, 20 * SECOND_US, n)) + start_us
    t[n // 3 :] += 25 * SECOND_US
    t[n // 2 :] += 100 * SECOND_US
    return make_events(rng.integers(0, 1280, n), rng.integers(0, 720, n), rng.integers(0, 2, n), t)


def assert_two_readers_find(path, events, shift_us):
    for found, late_us in ((read_with_faery(path), 0), (read_with_evt3(path), shift_us)):
        found["t"] += late_us
        assert np.array_equal(found, events)


# The kernel's many corners: few pixels and moments, so that events meet.
clustered = st.lists(
    st.tuples(st.integers(0, 69), st.integers(0, 1), st.integers(0, 1), st.sampled_from([0, 1, 4095, 4096, 20_000])),
    max_size=120,
)


@settings(max_examples=200, deadline=None)
@given(rows=clustered, in_order=st.booleans(), width=st.sampled_from([70, 96, 128]), cuts=st.lists(st.integers(0, 120)))
def test_the_encoder_equals_the_rules_told_plainly_however_the_chunks_are_cut(rows, in_order, width, cuts):
    rows = sorted(rows, key=lambda row: (row[3], *(row[1::-1] if in_order else ())))
    events = make_events(*np.array(rows).reshape(-1, 4).T)
    chunks = np.split(events, np.sort(cuts).astype(int))
    words = np.frombuffer(b"".join(encode_evt3(iter(chunks), width)), "<u2")
    assert words.tolist() == encode_plainly(events, width)


def test_narrow_sensors_have_no_vectors():
    events = make_events(np.arange(20), np.zeros(20), np.ones(20), np.zeros(20))
    words = np.frombuffer(b"".join(encode_evt3(iter([events]), 20)), "<u2")
    assert set(words >> 12) == {0x8, 0x6, 0x0, 0x2}


def test_the_header_is_the_one_the_vendors_tools_take(tmp_path):
    write_recording(tmp_path / "a.raw", no_events(), *SIZE_PX)
    content = (tmp_path / "a.raw").read_bytes()
    assert content.decode("latin-1").split("\n")[:-1] == [
        "% camera_integrator_name Prophesee",
        "% evt 3.0",
        "% format EVT3;height=720;width=1280",
        "% geometry 1280x720",
        "% integrator_name Prophesee",
        "% plugin_name hal_plugin_imx636_evk4",
        "% sensor_generation 4.2",
        "% serial_number 00000000",
        "% system_ID 49",
        "% end",
    ]
    assert content.endswith(b"% end\n\x00\x80\x00\x60"), "even a recording without events has a clock"
    assert b" \n" not in evt3_header(640, 480, 5)


def test_vectors_are_whole_groups_inside_the_sensor_and_no_time_word_is_left_out(tmp_path):
    events = events_with_rows(np.random.default_rng(1), 3000, density=0.6)
    events["t"][events.size // 2 :] += 3 * SECOND_US
    write_recording(tmp_path / "a.raw", events, *SIZE_PX)
    words = np.frombuffer((tmp_path / "a.raw").read_bytes()[len(evt3_header(*SIZE_PX)) :], "<u2")
    kinds = words >> 12
    bases = np.flatnonzero(kinds == 3)
    assert bases.size > 1000
    assert (words[bases] & 0x7FF).max() <= 1280 - 32
    groups = [kinds[bases + step] for step in (1, 2, 3)]
    assert [set(kind.tolist()) for kind in groups] == [{4}, {4}, {5}]
    assert (np.count_nonzero(kinds == 4), np.count_nonzero(kinds == 5)) == (2 * bases.size, bases.size)
    highs = words[kinds == 8] & 0xFFF
    assert highs.tolist() == [k % 4096 for k in range(int(events["t"][-1] >> 12) + 1)]


@pytest.mark.parametrize("start_us", [0, 11_200_224, 2**24 - 1, 2**24, 10**12])
def test_two_readers_agree_over_wraps_and_gaps(tmp_path, start_us):
    events = events_with_gaps(np.random.default_rng(2), 20_000, start_us)
    events["t"] += start_us - events["t"][0]
    shift_us = write_recording(tmp_path / "a.raw", events, *SIZE_PX)
    assert shift_us == (start_us if start_us >= 2**24 else 0), "only a clock past one turn begins anew"
    assert (b"% t0 " in (tmp_path / "a.raw").read_bytes()) == (shift_us > 0)
    assert_two_readers_find(tmp_path / "a.raw", events, shift_us)
    assert np.array_equal(open_recording(tmp_path / "a.raw").read(), events)


@pytest.mark.parametrize("order", ["rising", "falling", "random"])
def test_the_order_of_events_within_a_microsecond_is_kept(tmp_path, order):
    rng = np.random.default_rng(3)
    events = events_with_rows(rng, 400)
    keys = {"rising": np.arange(events.size), "falling": -np.arange(events.size), "random": rng.random(events.size)}
    events = events[np.lexsort((keys[order], events["t"]))]
    write_recording(tmp_path / "a.raw", np.array_split(events, 50), *SIZE_PX)
    assert_two_readers_find(tmp_path / "a.raw", events, 0)


def test_a_real_recording_written_again_is_the_same_to_two_readers(tmp_path, real_recordings):
    recording = open_recording(real_recordings / "evk4_scene_evt3.raw")
    assert write_recording(tmp_path / "a.raw", recording, *SIZE_PX) == 0
    assert_two_readers_find(tmp_path / "a.raw", recording.read(), 0)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("start_us", [0, 11_200_224, 10**12])
def test_every_format_gives_the_same_events_back(tmp_path, some_events, suffix, start_us):
    events = some_events.copy()
    events["t"] += start_us
    shift_us = write_recording(tmp_path / f"a{suffix}", iter(np.array_split(events, 7)), 640, 480)
    assert bool(shift_us) == (suffix in (".raw", ".dat") and start_us == 10**12)
    recording = open_recording(tmp_path / f"a{suffix}")
    assert (recording.width, recording.height, recording.size_from) == (640, 480, "file")
    assert np.array_equal(recording.read(), events)
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_only_good_events_are_written_and_a_failure_leaves_the_old_file(tmp_path, some_events, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="x outside the 100 px wide sensor"):
        write_recording(path, some_events, 100, 480)
    with pytest.raises(ValueError, match="a chunk begins at 5000 us, before the end of the last, 24980 us"):
        write_recording(path, [some_events, some_events], 640, 480)
    with pytest.raises(RecordingError, match=r"cannot be written \(No such file or directory\); check the folder"):
        write_recording(tmp_path / "none" / f"a{suffix}", some_events, 640, 480)
    if suffix in (".raw", ".dat"):
        with pytest.raises(RecordingError, match=f"sensor of 20000x480 px; {suffix} holds sides of 1 to"):
            write_recording(path, some_events, 20_000, 480)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_name_without_a_format(tmp_path, some_events):
    with pytest.raises(RecordingError, match=r"a\.mp4: no format is called \.mp4; end the name in \.npz, \.raw"):
        write_recording(tmp_path / "a.mp4", some_events, 640, 480)


def test_writing_holds_a_chunk_and_no_more(tmp_path):
    def chunks():
        for k in range(100):
            yield make_events(np.arange(10_000) % 1280, np.full(10_000, k), np.zeros(10_000), np.full(10_000, 5000 * k))

    write_recording(tmp_path / "a.raw", no_events(), *SIZE_PX)  # compiles
    tracemalloc.start()
    try:
        write_recording(tmp_path / "a.raw", chunks(), *SIZE_PX)
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 0.25 * 1_000_000 * EVENT_DTYPE.itemsize


@pytest.mark.parametrize("suffix", [".dat", ".csv", ".aedat4"])
def test_a_full_disk_is_named_where_faery_writes(tmp_path, some_events, monkeypatch, suffix):
    def fill_the_disk(*_arguments, **_options):
        raise RuntimeError("No space left on device (os error 28)")

    monkeypatch.setattr("faery.file_encoder.events_to_file", fill_the_disk)
    with pytest.raises(
        RecordingError, match=r"cannot be written \(No space left on device \(os error 28\)\); check the fol"
    ):
        write_recording(tmp_path / f"a{suffix}", some_events, *SIZE_PX)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(resource is None, reason="this system has no limit on the size of a file")
@pytest.mark.parametrize("suffix", [".h5", ".npz", ".raw", ".dat", ".aedat4", ".csv"])
def test_a_disk_that_is_full_is_said_in_one_line(tmp_path, suffix):
    """In a process of its own, whose files may have 300,000 bytes; the HDF5 library would crash at its end."""
    path = tmp_path / f"m{suffix}"
    code = f"""
import resource, signal
import numpy as np
from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, write_recording
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
rng = np.random.default_rng(0)
n = 300_000
columns = [rng.integers(0, side, n) for side in (640, 480, 2)]
events = make_events(*columns, np.sort(rng.integers(0, 10**6, n)))
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
try:
    write_recording({str(path)!r}, [events[:100_000], events[100_000:]], 640, 480)
except RecordingError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") == 1
    assert "cannot be written (File too large" in done.stdout
    assert list(tmp_path.iterdir()) == []
