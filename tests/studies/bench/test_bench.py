"""``bicode bench``: its streams, loops and plain counterparts do what they say; times are not judged."""

import json
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from bicode_lab.camera import PixelModel, Recorder
from bicode_lab.events import check_events, slice_time, windows
from bicode_lab.marker import LedWaveform
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.recognition.event_codes import EventCoder
from bicode_studies.bench import bounds_table, lower_bounds, scaling, streams, whole_runs
from bicode_studies.bench.lower_bounds import (
    _touch,
    _touch_ahead,
    last_unsorted_chunk,
    least_generator_ns,
    least_ns,
)
from bicode_studies.bench.plain_receiver import PlainReceiver
from bicode_studies.bench.plain_simulator import simulate
from bicode_studies.bench.rows import Row, rate_row, time_row
from bicode_studies.bench.timing import Timing, Watch, machine, opencv_threads, time_in_turn
from bicode_studies.cli import bench as command_bench
from bicode_studies.cli.main import main
from bicode_studies.notebook.runner import NotebookRun
from bicode_studies.paper_experiments.results import FIGURES
from bicode_studies.sweep.sweep import Sweep

SETTINGS = ReceiverSettings(detect_2d=False)


def ids_of(sightings):
    return {s.id for s in sightings} - {None}


@pytest.mark.parametrize("rate", [1.0, 20.0])
def test_six_markers_are_a_sorted_stream_of_that_rate_with_their_ids(rate):
    events = streams.six_markers(rate, 0.099)
    check_events(events, streams.WIDTH, streams.HEIGHT)
    assert events.size == pytest.approx(rate * 1e6 * 0.099, rel=0.03)  # some clutter leaves the sensor
    assert ids_of(recognise(events, SETTINGS, t0_us=0)) == set(streams.PAYLOADS)


@pytest.mark.parametrize("rate", [1.0, 20.0])
def test_the_plain_receiver_reads_what_ours_reads(rate):
    events = streams.six_markers(rate, 0.066)
    receiver = PlainReceiver(SETTINGS)
    found = [
        regions
        for start, part in windows(events, SETTINGS.delta_t_whole_us, t0_us=0)
        for regions in [receiver(start, part)]
    ]
    for k, regions in enumerate(found):
        ours = {
            (s.x + s.w // 2, s.y + s.h // 2, s.id)
            for s in recognise(slice_time(events, k * 33_000, (k + 1) * 33_000), SETTINGS, t0_us=k * 33_000)
            if s.id is not None
        }
        theirs = {(x + w // 2, y + h // 2, *ids) for _, (x, y, w, h), ids in regions if ids}
        assert len(ours) == len(theirs) == len(streams.PAYLOADS)
        for x, y, payload in ours:  # the same place, but for what morphology adds
            assert [t for t in theirs if t[2] == payload and abs(t[0] - x) <= 3 and abs(t[1] - y) <= 3]


def test_the_plain_simulator_makes_the_events_that_ours_makes():
    dark, glow, wave = np.ones((16, 16)), np.full((16, 16), streams.BRIGHT), LedWaveform(payload=0x25)
    model = PixelModel(noise=0.0, background_hz=0.0, hot_pixels=0, refractory_us=0.0)
    events = simulate(dark, glow, wave, model, 56_000, np.random.default_rng(0))
    check_events(events, 16, 16)
    edges_us, levels = wave.steps(0, 56_000)
    # Behind a fall (or rise) all events are OFF (or ON), by ln 6 over the threshold: 7 where it gives 0.25.
    edge = np.searchsorted(edges_us + 20, events["t"], side="right") - 1
    assert (events["p"] == (levels[edge] > 0)).all()
    most = np.log(6.0) / (model.threshold_on - 4 * model.threshold_spread)
    counts = np.bincount(edge, minlength=edges_us.size) / 256
    assert 4 < counts[levels > 0].mean() < most


def test_the_square_is_64_pixels_wide_and_blinks():
    chunks = list(Recorder(streams.square_scene(whole_sensor=False), 0.03, np.random.default_rng(0)))
    events = np.concatenate(chunks)
    assert events.size > 100_000
    inside = (np.abs(events["x"] - 63.5) <= 32) & (np.abs(events["y"] - 63.5) <= 32)
    assert inside.mean() > 0.9


def test_filling_up_reaches_the_rate_and_leaves_the_upper_half_alone():
    scene = streams.near_scene()
    seen = np.concatenate(list(Recorder(scene, 0.033, np.random.default_rng(0))))
    events = streams.filled_up(seen, 40.0, 0.033)
    check_events(events, streams.WIDTH, streams.HEIGHT)
    upper = events["y"] < streams.HEIGHT // 2
    assert np.count_nonzero(upper) == np.count_nonzero(seen["y"] < streams.HEIGHT // 2)
    assert events.size > seen.size
    if seen.size < 1.2e6:  # two markers may make more than that by themselves
        assert events.size == pytest.approx(40e6 * 0.033, rel=0.05)


def test_work_is_timed_in_turn_and_once_ahead():
    order = []
    timings = time_in_turn(2, lambda: order.append("a"), lambda: order.append("b"))
    assert order == ["a", "b", "a", "b", "a", "b"]
    assert all(t.cpu_s >= 0 and t.wall_s >= 0 and 0 <= t.others <= 1 for t in timings)
    assert 0 <= Watch().others() <= 1
    assert {"processor", "cores", "python", "numpy", "numba"} <= set(machine())


def test_opencv_gets_its_threads_back():
    before = cv2.getNumThreads()
    with opencv_threads(1):
        assert cv2.getNumThreads() == 1
    assert cv2.getNumThreads() == before


def test_rows_know_whether_they_reach():
    timing = Timing(cpu_s=0.5, wall_s=1.0, others=0.25, load=2.0)
    fast = rate_row(timing, 100.0, name="a", what="b", unit="Mev/s", reach=200.0)
    assert (fast.measured, fast.by_clock, fast.is_met) == (200.0, 100.0, True)
    slow = time_row(timing, 1e3, name="a", what="b", unit="ms", reach=499.0)
    assert (slow.measured, slow.by_clock, slow.is_met) == (500.0, 1000.0, False)


def test_the_command_prints_and_keeps_its_rows(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(command_bench, "results_folder", lambda: tmp_path)
    row = Row(name="nothing", what="doing nothing", reach=1.0, at_least=False, measured=0.5, by_clock=0.6, unit="s")
    monkeypatch.setitem(command_bench.SHORT, "start", lambda: iter([row]))
    with pytest.raises(SystemExit) as ended:
        main(["bench", "--only", "start", "--save"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "ok   nothing" in said
    assert "others used" in said
    (kept,) = (tmp_path / "bench").glob("*.json")
    table = json.loads(kept.read_text(encoding="utf-8"))
    assert table["rows"][0]["name"] == "nothing"
    assert {"when", "processor", "others", "numpy"} <= set(table)


def test_whole_sweeps_are_timed_from_empty_stores(monkeypatch):
    stores = []

    def run_figure(figure, quick, jobs, store):
        assert not store.exists()
        assert store.parent.is_dir()
        stores.append((figure, quick, jobs, store))
        return Sweep(table=pd.DataFrame())

    monkeypatch.setattr(whole_runs, "run_figure", run_figure)
    (row,) = whole_runs.worker_row()
    asked = [(figure, quick, jobs) for figure, quick, jobs, _ in stores]
    assert asked == [(whole_runs.PART, False, 1), (whole_runs.PART, False, 2)]
    assert len({store for *_, store in stores}) == 2
    assert row.measured > 0
    assert (row.unit, row.reach, row.at_least) == ("x", 1.7, True)
    stores.clear()
    (row,) = whole_runs.evaluation_row()
    assert [(figure, quick) for figure, quick, *_ in stores] == [(figure, False) for figure in FIGURES]
    assert 0 <= row.measured < 1
    assert row.unit == "min"


def test_all_notebooks_are_timed(monkeypatch):
    done = NotebookRun(notebook=Path("a.ipynb"), output=Path("b.ipynb"), seconds=1.0, error="it fails")
    monkeypatch.setattr(whole_runs, "run_all", lambda quick, jobs, only: [done] if quick and not only else [])
    (row,) = whole_runs.notebook_row()
    assert "all 1 notebooks" in row.what
    assert row.beside == "1 failed"
    assert row.is_met


def test_costs_are_tables_of_what_was_asked_for():
    (row,) = scaling.by_events([0.5], 1).to_dict("records")
    assert row["mev_a_period"] == pytest.approx(0.5 * 0.033, rel=0.05)
    assert row["regions"] == 6
    assert scaling.by_markers([1, 3], 0.02)["markers"].tolist() == [1, 3]
    assert scaling.by_pixels([64], 0.02)["megapixels"].tolist() == [64 * 36 / 1e6]
    assert scaling.by_length([0.02])["length_s"].tolist() == [0.02]
    boxes = scaling.receiver_boxes(streams.six_markers(1.0, 0.033), 1, ReceiverSettings())
    assert [name[0] for name in boxes.index] == ["c", "a", "c", "d", "f", "g", "g"]
    assert (boxes >= 0).all()
    parts = scaling.generator_parts(streams.square_scene(whole_sensor=False), 0.02)
    assert parts["pixels"] > 0
    assert scaling.copy_gb_per_s() > 0


def test_the_least_cost_is_of_loops_that_do_what_they_say():
    events = streams.six_markers(1.0, 0.033)
    codes = EventCoder(streams.WIDTH, streams.HEIGHT)(events).codes
    times_each = np.bincount(codes[: events.size] >> 1, minlength=streams.WIDTH * streams.HEIGHT)
    for touch in (_touch, _touch_ahead):
        table = np.zeros(times_each.size, np.uint8)
        touch(codes, table)
        np.testing.assert_array_equal(table, times_each % 2)
    costs = least_ns(events, streams.WIDTH, streams.HEIGHT, repeats=1)
    assert len(costs) == 8
    assert (costs > 0).all()


def test_the_generators_least_loops_do_what_they_say():
    way, aim = np.array([0.1, 2.0, 30.0]), np.array([0.5, 1.0, 7.0])
    out = np.empty(3)
    lower_bounds._ways(way, aim, out, 1)
    np.testing.assert_allclose(out, -way - np.log(aim), rtol=1e-9)
    moments, at = np.array([2, 0, 2], np.int32), np.zeros(4, np.int32)
    lower_bounds._count(moments, at)
    assert at.tolist() == [1, 0, 2, 0]
    target = np.empty((3, 2), np.int64)
    lower_bounds._store(np.array([7, 8, 9], np.uint32), moments, np.array([1, 0, 2], np.int32), target)
    assert target.tolist() == [[8, 0], [7, 2], [9, 2]]


def test_the_unsorted_chunk_is_the_sorted_one_in_another_order():
    scene = streams.square_scene(whole_sensor=False)
    codes, moments = last_unsorted_chunk(scene, 2)
    last = list(Recorder(scene, 0.02, np.random.default_rng(0)))[-1]
    assert (np.diff(moments) < 0).any()
    order = np.argsort(moments, kind="stable")
    np.testing.assert_array_equal(moments[order] + 10_000, last["t"])
    where = last["y"].astype(np.int64) * streams.PATCH_PX + last["x"]
    np.testing.assert_array_equal(codes[order], 2 * where + last["p"])
    assert (least_generator_ns(scene, repeats=1) > 0).all()


def test_the_bounds_stand_beside_what_is_taken():
    settings = ReceiverSettings()
    events = streams.near_stream(1.0, 0.033)
    boxes = scaling.receiver_boxes(events, 1, settings)
    table = bounds_table.receiver_table(boxes, events, settings)
    assert table.index.tolist() == boxes.index.tolist()
    assert table["least_ns"].count() == 3
    whole = bounds_table.whole_table(events, 1, settings)
    assert (whole >= 0).all()
    half_ms, chain_ms = bounds_table.two_core_bounds(whole)
    assert half_ms < whole.sum()
    assert chain_ms <= whole.sum()
    assert bounds_table.whole_by_clock(events, 1, settings, repeats=1) > 0
    plain_times = bounds_table.against_plain(streams.square_scene(whole_sensor=False), 0.02)
    assert plain_times["asked_ns"] == pytest.approx(plain_times["takes_ns"] * plain_times["times"] / 50)
