"""Tests of tables: names, orders, units and kinds of numbers, in npz, npy, MATLAB and Parquet files."""

import datetime
import sys

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet
from scipy.io import savemat

from bicode_lab.events import make_events
from bicode_lab.recordings import RecordingError, open_recording

N = 50
COLUMNS = {"x": np.arange(N), "y": np.arange(N) % 7, "p": np.arange(N) % 2, "t": 1_000_000 + 40 * np.arange(N)}
EVENTS = make_events(*(COLUMNS[name] for name in "xypt")).tolist()


def read(path, **how):
    return open_recording(path, width=64, height=48, **how).read().tolist()


@pytest.mark.parametrize(
    "names", ["xs ys ps ts", "X Y pol timestamp", "col row polarity Time", "x y on t_us", "x y p times"]
)
def test_names_of_arrays(tmp_path, names):
    np.savez(tmp_path / "a.npz", **dict(zip(names.split(), COLUMNS.values(), strict=True)))
    assert read(tmp_path / "a.npz") == EVENTS


@pytest.mark.parametrize(
    ("name", "t"),
    [
        ("t_ns", COLUMNS["t"] * 1000 + 999),
        ("timestamp [ns]", COLUMNS["t"].astype(np.uint64) * np.uint64(1000)),
        ("t_ms", COLUMNS["t"] / 1000),
        ("t_s", COLUMNS["t"] / 1e6),
        ("t", COLUMNS["t"] / 1e6),
        ("t", COLUMNS["t"].astype(float)),
        ("t", COLUMNS["t"] + np.where(np.arange(N) % 5 < 2, 0.25, 0)),
        ("ts", (COLUMNS["t"] / 1e6).astype(np.float64)),
    ],
)
def test_units_of_time(tmp_path, name, t):
    np.savez(tmp_path / "a.npz", **{**{key: COLUMNS[key] for key in "xyp"}, name: t})
    assert read(tmp_path / "a.npz") == EVENTS


@pytest.mark.parametrize("order", ["txyp", "xytp", "xypt"])
@pytest.mark.parametrize("off", [0, -1])
def test_orders_of_four_columns_without_names(tmp_path, order, off):
    columns = {**COLUMNS, "p": np.where(COLUMNS["p"], 1, off)}
    np.save(tmp_path / "a.npy", np.stack([columns[name] for name in order], axis=1))
    assert read(tmp_path / "a.npy") == EVENTS
    np.savez(tmp_path / "a.npz", events=np.stack([columns[name] for name in order], axis=1).astype(float))
    assert read(tmp_path / "a.npz") == EVENTS


def test_four_columns_that_no_order_fits(tmp_path):
    np.save(tmp_path / "a.npy", np.arange(40).reshape(-1, 4))
    with pytest.raises(
        RecordingError, match="array events has 4 columns without names, and no order fits: the polarity"
    ):
        read(tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", np.arange(40).reshape(-1, 5))
    with pytest.raises(RecordingError, match=r"holds int64 of shape \(8, 5\); give fields x, y, p and t, or 4 columns"):
        read(tmp_path / "a.npy")


@pytest.mark.parametrize("kind", ["u1", ">i4", "f4", "?"])
def test_kinds_of_numbers(tmp_path, kind):
    np.savez(tmp_path / "a.npz", **{**COLUMNS, "p": COLUMNS["p"].astype(kind)})
    assert read(tmp_path / "a.npz") == EVENTS


def test_off_as_minus_one(tmp_path):
    np.savez(tmp_path / "a.npz", **{**COLUMNS, "p": 2 * COLUMNS["p"] - 1})
    assert read(tmp_path / "a.npz") == read(tmp_path / "a.npz", lenient=True) == EVENTS
    both = np.array([1, 0, -1] + [1] * (N - 3))
    np.savez(tmp_path / "a.npz", **{**COLUMNS, "p": both})
    with pytest.raises(
        RecordingError, match="the polarities 0 and -1 both occur, and only one of them can be OFF; store"
    ):
        read(tmp_path / "a.npz")
    assert [p for _, _, p, _ in read(tmp_path / "a.npz", lenient=True)] == np.maximum(both, 0).tolist()


def test_numbers_that_are_none(tmp_path):
    bad = COLUMNS["t"].astype(float)
    bad[[3, 9]] = np.nan, np.inf
    np.savez(tmp_path / "a.npz", **{**COLUMNS, "t": bad})
    message = (
        r"2 of 50 events have a value that is no whole number; the first is number 3 \(in t\); export the file again"
    )
    with pytest.raises(RecordingError, match=message):
        read(tmp_path / "a.npz")
    recording = open_recording(tmp_path / "a.npz", lenient=True)
    assert recording.read().tolist() == [event for event in EVENTS if event[0] not in (3, 9)]
    assert recording.dropped == {"events with a value that is no whole number": 2}
    for t in (COLUMNS["t"].astype(np.uint64) + np.uint64(1 << 63), COLUMNS["t"] + (1 << 61)):
        np.savez(tmp_path / "a.npz", **{**COLUMNS, "t": t})
        with pytest.raises(RecordingError, match="50 of 50 events have a value that is no whole number"):
            read(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", **{**COLUMNS, "x": COLUMNS["x"] + 0.5})
    with pytest.raises(RecordingError, match=r"the first is number 0 \(in x\)"):
        read(tmp_path / "a.npz")


def test_a_zip_archive_is_named(tmp_path):
    import zipfile

    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("events.txt", "0.1 1 2 0\n")
    with pytest.raises(
        RecordingError, match=r"a zip archive with no arrays in it \(found: events\.txt\); unpack it first"
    ):
        read(tmp_path / "a.zip")


@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_files(tmp_path, compressed):
    rows = {name: column[None].astype(float) for name, column in COLUMNS.items()}
    savemat(
        tmp_path / "a.mat", {**rows, "note": "some text", "cell": np.array([1, "a"], object)}, do_compression=compressed
    )
    assert read(tmp_path / "a.mat") == EVENTS
    inner = {"x": COLUMNS["x"], "y": COLUMNS["y"], "pol": COLUMNS["p"] * 2 - 1, "ts": COLUMNS["t"]}
    savemat(tmp_path / "a.mat", {"aedat": {"data": {"polarity": inner}, "importParams": 1}}, do_compression=compressed)
    assert read(tmp_path / "a.mat") == EVENTS
    savemat(
        tmp_path / "a.mat", {"events": np.stack([COLUMNS[name] for name in "txyp"], axis=1)}, do_compression=compressed
    )
    assert read(tmp_path / "a.mat") == EVENTS


def test_matlab_files_that_hold_something_else(tmp_path):
    savemat(tmp_path / "a.mat", {"event": [1, -1], "event_t": [0.5, 0.6]})
    with pytest.raises(RecordingError, match=r"holds the events of one light .* read it with --line-code uart"):
        read(tmp_path / "a.mat")
    savemat(tmp_path / "a.mat", {"x": [1], "y": [1], "picture": np.zeros((3, 3))})
    with pytest.raises(RecordingError, match=r"arrays missing: p, t \(found: picture, x, y\); give x, y, p, t"):
        read(tmp_path / "a.mat")
    savemat(tmp_path / "a.mat", {"x": [1, 2], "y": [1, 2], "p": [1, 1], "t": [1, 2, 3]})
    with pytest.raises(RecordingError, match=r"arrays x, y, p, t have \[2, 2, 2, 3\] entries"):
        read(tmp_path / "a.mat")


def test_parquet(tmp_path):
    moments = [datetime.datetime(1970, 1, 1) + datetime.timedelta(microseconds=int(t)) for t in COLUMNS["t"]]
    table = {**{name: COLUMNS[name] for name in "xyp"}, "timestamp": pyarrow.array(moments, pyarrow.timestamp("ns"))}
    parquet.write_table(pyarrow.table(table), tmp_path / "a.parquet", row_group_size=9)
    assert read(tmp_path / "a.parquet") == EVENTS
    lengths = pyarrow.array([int(t) * 1000 for t in COLUMNS["t"]], pyarrow.duration("ns"))
    parquet.write_table(pyarrow.table({**table, "timestamp": lengths}), tmp_path / "a.parquet")
    assert read(tmp_path / "a.parquet") == EVENTS
    parquet.write_table(pyarrow.table({"x": [1], "y": [1], "p": ["on"], "t": [1]}), tmp_path / "a.parquet")
    with pytest.raises(RecordingError, match=r"column p is object of shape \(1,\); store whole numbers"):
        read(tmp_path / "a.parquet")
    parquet.write_table(pyarrow.table({"x": [1], "y": [1], "t": [1]}), tmp_path / "a.parquet")
    with pytest.raises(RecordingError, match=r"columns missing: p \(found: t, x, y\)"):
        read(tmp_path / "a.parquet")


def test_parquet_without_pyarrow_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.parquet").write_bytes(b"PAR1" + bytes(50))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(RecordingError, match="a Parquet file, for which pyarrow is needed; pip install pyarrow"):
        read(tmp_path / "a.parquet")
