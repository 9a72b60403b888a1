"""Tests of HDF5 files: layouts, clocks, codecs, files that are open elsewhere."""

import subprocess
import sys
import time

import h5py
import hdf5plugin
import numpy as np
import pytest
from make_files import SIZE_PX, write_dsec, write_n_by_4, write_own, write_vendor_hdf5

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording
from bicode_lab.recordings.tables import hdf5_layout

EVENTS = make_events(np.arange(200), np.arange(200) % 99, np.arange(200) % 2, 5 + 30 * np.arange(200))


def opened(path):
    return open_recording(path, width=SIZE_PX[0], height=SIZE_PX[1])


def test_times_count_from_t_offset(tmp_path):
    write_dsec(tmp_path / "a.h5", EVENTS)
    assert opened(tmp_path / "a.h5").read()["t"].tolist() == (EVENTS["t"] - 5 + 57_922_807_541).tolist()
    write_dsec(tmp_path / "a.h5", EVENTS, t_offset=-7)
    assert opened(tmp_path / "a.h5").read()["t"][0] == -7


def test_an_offset_beside_the_events_comes_before_that_of_the_file(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xypt":
            file[f"cameras/left/{name}"] = EVENTS[name]
        file["t_offset"], file["cameras"].attrs["t_offset"] = 1000, 20
    assert opened(tmp_path / "a.h5").read()["t"][0] == 25
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["cameras/left/t_offset"] = 0.5
    with pytest.raises(RecordingError, match=r"t_offset is 0\.5; store one whole number of microseconds"):
        opened(tmp_path / "a.h5")


def test_a_file_of_another_kind_says_what_it_holds(tmp_path):
    with h5py.File(tmp_path / "rectify_map.h5", "w") as file:
        file["rectify_map"] = np.zeros((4, 4, 2), np.float32)
    with pytest.raises(RecordingError, match=r"columns missing: x, y, p, t \(found: rectify_map\); give x, y, p, t"):
        opened(tmp_path / "rectify_map.h5")


def test_of_two_streams_the_first_is_read_and_the_other_named(tmp_path):
    write_n_by_4(tmp_path / "a.h5", EVENTS)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["davis/right/events"] = file["davis/left/events"][:10]
    recording = opened(tmp_path / "a.h5")
    assert recording.read().size == EVENTS.size
    assert recording.remarks == ["reads the events of davis/left; the file also holds those of davis/right"]


@pytest.mark.parametrize("codec", [hdf5plugin.Blosc(cname="zstd"), hdf5plugin.Zstd(), hdf5plugin.LZ4()])
def test_codecs_of_hdf5plugin(tmp_path, codec):
    """A process of its own, because here hdf5plugin has been imported."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xypt":
            file.create_dataset(f"events/{name}", data=EVENTS[name], chunks=(50,), **codec)
    path = str(tmp_path / "a.h5")
    script = f"from bicode_lab.recordings import open_recording; print(open_recording({path!r}).read().size)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == "200", done.stderr


def test_a_codec_that_is_missing_is_named(tmp_path, monkeypatch):
    write_vendor_hdf5(tmp_path / "a.h5", EVENTS, **hdf5plugin.Blosc())
    monkeypatch.setattr(hdf5_layout.h5py.h5z, "filter_avail", lambda _number: False)
    with pytest.raises(
        RecordingError, match=r"compressed with Blosc \(HDF5 filter 32001\), which is not installed; pip"
    ):
        opened(tmp_path / "a.h5")


@pytest.mark.parametrize("how", [{}, {"compression": "gzip"}, {"compression": "lzf"}])
def test_the_vendors_layout_without_its_codec(tmp_path, how):
    write_vendor_hdf5(tmp_path / "a.h5", EVENTS, **how)
    recording = open_recording(tmp_path / "a.h5")
    assert recording.read().tolist() == EVENTS.tolist()
    assert (recording.width, recording.height, recording.size_from) == (*SIZE_PX, "file")


def test_a_file_that_a_program_writes_is_not_called_damaged(tmp_path):
    path = tmp_path / "a.h5"
    write_own(path, EVENTS)
    script = f"import h5py, time; f = h5py.File({str(path)!r}, 'r+'); print('open', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as writer:
        try:
            assert writer.stdout.readline() == "open\n"
            time.sleep(0.1)
            with pytest.raises(RecordingError, match=r"open for writing in another program; close it there first"):
                opened(path)
        finally:
            writer.kill()


def test_a_file_whose_writer_was_stopped(tmp_path):
    path = tmp_path / "a.h5"
    script = f"""import h5py, os
file = h5py.File({str(path)!r}, "w", libver="latest")
file["events/x"] = [1]
file.swmr_mode = True
file.flush()
os._exit(0)"""
    subprocess.run([sys.executable, "-c", script], check=True)
    with pytest.raises(RecordingError, match=r"marked as open for writing: .* clear the mark with: h5clear -s"):
        opened(path)


def test_sizes_of_the_sensor(tmp_path):
    for attribute, value, size in (
        ("geometry", "64x48", (64, 48)),
        ("geometry", np.bytes_(b"64 x 48"), (64, 48)),
        ("sensor_resolution", (48, 64), (64, 48)),
        ("sensor_resolution", (64, 48), (64, 48)),
    ):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            for name in "xypt":
                file[f"events/{name}"] = [1]
            file.attrs[attribute] = value
        recording = open_recording(tmp_path / "a.h5")
        assert (recording.width, recording.height, recording.size_from) == (*size, "file")


def test_links_that_lead_nowhere_or_in_circles_are_passed_over(tmp_path):
    write_own(tmp_path / "a.h5", EVENTS)
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["events/again"] = file["/"]
        file["nowhere"] = h5py.SoftLink("/none")
    assert opened(tmp_path / "a.h5").read().size == EVENTS.size


@pytest.mark.parametrize("chunks", [(50,), None])
def test_more_events_announced_than_stored(tmp_path, chunks):
    """HDF5 would read zeros for what is missing, for hours if a damaged size is large."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xypt":
            maximum = (None,) if chunks else None
            column = file.create_dataset(f"events/{name}", (100,), "u4", chunks=chunks, maxshape=maximum)
            if chunks:
                column[:] = 1
                column.resize(1 << 40, axis=0)
    with pytest.raises(
        RecordingError, match=r"damaged or cut short \(/events/x announces [\d,]+ events, stores \d+ at"
    ):
        opened(tmp_path / "a.h5")
