"""A sweep gives the same table, whatever happens on the way to it."""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pandas as pd
import pytest

from bicode_studies.sweep.store import Key
from bicode_studies.sweep.sweep import sweep
from bicode_studies.sweep.workers import Outcome, Task, Trial, run_trials
from tests.studies.sweep.cheap_trials import Cheap, run, run_or_die, run_or_raise

ROOT = Path(__file__).resolve().parents[3]


def trials_of(
    distances: tuple[float, ...] = (0.5, 5.0, 20.0), seeds: int = 4, **more: object
) -> list[tuple[Cheap, int]]:
    return [(Cheap(distance_m=d, **more), seed) for d in distances for seed in range(seeds)]  # type: ignore[arg-type]


def runs_noted(folder: Path) -> Counter[str]:
    """Return how often each trial has run, by its distance and seed."""
    return Counter("_".join(path.name.split("_")[:2]) for path in folder.iterdir())


def stored(path: Path) -> list[tuple[str, int, int]]:
    """Return (condition, seed, how often) of all that a store holds."""
    with sqlite3.connect(path) as file:
        return file.execute("SELECT condition, seed, count(*) FROM trials GROUP BY condition, seed").fetchall()


def plain(trials: list[tuple[Cheap, int]]) -> pd.DataFrame:
    """Return the table as a loop would make it."""
    return pd.DataFrame([row for trial in trials for row in run(*trial)])


def test_the_table_does_not_depend_on_workers_nor_on_the_order_of_completion(tmp_path: Path) -> None:
    rng = random.Random(3)
    trials = [(Cheap(distance_m=d, wait_s=rng.random() / 20), seed) for d in (0.5, 5.0, 20.0) for seed in range(5)]
    one = sweep(run, trials, tmp_path / "one.sqlite", jobs=1).table
    three = sweep(run, trials, tmp_path / "three.sqlite", jobs=3).table
    pd.testing.assert_frame_equal(one, three)
    pd.testing.assert_frame_equal(one, plain(trials), check_dtype=False)
    assert one["share"].tolist() == plain(trials)["share"].tolist()  # to the last bit


def test_what_is_there_is_not_run_again_and_comes_in_the_order_asked_for(tmp_path: Path) -> None:
    store, notes = tmp_path / "sweep.sqlite", tmp_path / "notes"
    notes.mkdir()
    trials = trials_of(note_in=str(notes))
    sweep(run, trials[:7], store, jobs=2)
    backwards = trials[::-1]
    table = sweep(run, backwards + trials[:2], store, jobs=2).table
    assert set(runs_noted(notes).values()) == {1}
    pd.testing.assert_frame_equal(table, plain(backwards), check_dtype=False)


def test_a_trial_that_raises_is_told_and_not_kept_and_the_others_go_on(tmp_path: Path) -> None:
    trials = trials_of()
    result = sweep(run_or_raise, trials, tmp_path / "s.sqlite", jobs=2)
    assert len(stored(tmp_path / "s.sqlite")) == len(trials) - 1
    assert len(result.table) == 2 * (len(trials) - 1)
    line = result.failure_line()
    assert "\n" not in line
    assert '"distance_m": 5.0' in line
    assert "seed 1: ArithmeticError: no light at all" in line
    assert sweep(run, trials, tmp_path / "t.sqlite", jobs=2).failure_line() == ""


def test_a_trial_that_kills_its_worker_is_told_and_costs_no_other(tmp_path: Path) -> None:
    trials = trials_of()
    result = sweep(run_or_die, trials, tmp_path / "s.sqlite", jobs=2)
    assert len(stored(tmp_path / "s.sqlite")) == len(trials) - 1
    (line,) = result.failures
    assert '"distance_m": 5.0' in line
    assert "seed 1: its worker died 3 times" in line


def test_rows_that_cannot_be_written_are_a_failure_of_that_trial(tmp_path: Path) -> None:
    (line,) = sweep(rows_of_objects, [(Cheap(distance_m=1), 0)], tmp_path / "s.sqlite").failures
    assert "seed 0: TypeError: a row holds Cheap(" in line


def rows_of_objects(condition: Cheap, seed: int) -> list[dict[str, object]]:
    return [{"what": condition}]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"jobs": 0}, "jobs=0 is no number of processes"),
        ({"trials": [({"distance_m": 1}, 0)]}, "is not a dataclass"),
        ({"trials": [(Cheap(distance_m=float("nan")), 0)]}, "finite numbers"),
        ({"function": lambda condition, seed: []}, "cannot be found by other processes"),
        ({"data_files": ("no/such.csv",)}, "data file no/such.csv is not"),
        ({"cluster": "nowhere"}, "cluster='nowhere' is no address; write tcp://HOST:PORT"),
    ],
)
def test_misuse_is_refused_before_anything_runs(tmp_path: Path, change: dict[str, object], words: str) -> None:
    given = {"function": run, "trials": trials_of(), "store": tmp_path / "s.sqlite", **change}
    with pytest.raises((ValueError, ConnectionError), match=words):
        sweep(**given)  # type: ignore[arg-type]


def test_a_file_that_is_no_store_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("not a database, but notes of somebody\n" * 50)
    with pytest.raises(ValueError, match=r"notes\.txt is not a store of trials"):
        sweep(run, trials_of(), path)
    assert path.read_text().startswith("not a database")


def test_silent_where_there_is_no_terminal(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sweep(run, trials_of(), tmp_path / "s.sqlite", jobs=2)
    assert capfd.readouterr() == ("", "")


SCRIPT = """
import signal, sys
from bicode_studies.sweep.sweep import sweep
from tests.studies.sweep.test_sweep import run, trials_of
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may start what is in its background without
    sweep(run, trials_of(seeds=10, wait_s=0.25, note_in=sys.argv[2]), sys.argv[1], jobs=2)
"""


@pytest.fixture
def in_the_middle(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Yield a process of its own that runs 30 trials, when some are done and most are not."""
    script, store = tmp_path / "script.py", tmp_path / "s.sqlite"
    script.write_text(SCRIPT)
    (tmp_path / "notes").mkdir()
    process = subprocess.Popen(
        [sys.executable, str(script), str(store), str(tmp_path / "notes")],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    wait_until(lambda: store.exists() and len(committed(store)) >= 5)
    yield process
    process.kill()
    process.wait()


def committed(path: Path) -> list[object]:
    """Return what a store holds while another process writes to it."""
    try:
        return list(stored(path))
    except sqlite3.OperationalError:
        return []


def wait_until(is_so: object, seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not is_so():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.02)


def children_of(process: int) -> list[int]:
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True)
    return [int(line) for line in listed.stdout.split()]


def resumed(tmp_path: Path) -> pd.DataFrame:
    trials = trials_of(seeds=10, wait_s=0.25, note_in=str(tmp_path / "notes"))
    return sweep(run, trials, tmp_path / "s.sqlite", jobs=2).table


def check_nothing_lost_or_twice(tmp_path: Path, table: pd.DataFrame) -> None:
    trials = trials_of(seeds=10, wait_s=0.25, note_in=str(tmp_path / "notes"))
    undisturbed = sweep(run, trials, tmp_path / "other.sqlite", jobs=2).table
    pd.testing.assert_frame_equal(table, undisturbed)
    assert [count for *_, count in stored(tmp_path / "s.sqlite")] == [1] * len(trials)


@pytest.mark.slow
def test_killed_in_the_middle_and_called_again_it_equals_an_undisturbed_run(
    in_the_middle: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    workers = children_of(in_the_middle.pid)
    os.kill(in_the_middle.pid, signal.SIGKILL)
    in_the_middle.wait()
    kept = len(stored(tmp_path / "s.sqlite"))
    assert 5 <= kept < 30
    wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers), 20)  # none is left behind
    ran_before = sum(runs_noted(tmp_path / "notes").values())
    table = resumed(tmp_path)
    assert (
        sum(runs_noted(tmp_path / "notes").values()) - ran_before == 30 - kept
    )  # those that were kept did not run again
    check_nothing_lost_or_twice(tmp_path, table)


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_costs_nothing(in_the_middle: subprocess.Popen[bytes], tmp_path: Path) -> None:
    os.kill(next(pid for pid in children_of(in_the_middle.pid) if is_worker(pid)), signal.SIGKILL)
    assert in_the_middle.wait(timeout=60) == 0
    assert len(stored(tmp_path / "s.sqlite")) == 30
    check_nothing_lost_or_twice(tmp_path, resumed(tmp_path))


def is_worker(pid: int) -> bool:
    return b"popen_loky" in Path(f"/proc/{pid}/cmdline").read_bytes()


@pytest.mark.slow
def test_ctrl_c_stops_it_at_once(in_the_middle: subprocess.Popen[bytes], tmp_path: Path) -> None:
    in_the_middle.send_signal(signal.SIGINT)
    in_the_middle.wait(timeout=60)
    assert in_the_middle.returncode != 0
    assert 5 <= len(stored(tmp_path / "s.sqlite")) < 30
    check_nothing_lost_or_twice(tmp_path, resumed(tmp_path))


def test_trials_tried_again_run_alone() -> None:
    """Two workers; whatever runs beside trial 0 dies with it, and only once."""
    trials: dict[Key, Trial] = {Key("c", seed): (None, seed) for seed in range(8)}
    outcomes = dict(run_trials(TogetherTheyDie(), Task(rows_of_objects, "", ()), trials))
    assert {key.seed for key, outcome in outcomes.items() if outcome.error} == {0}
    assert len(outcomes) == 8


class TogetherTheyDie:
    at_once = 2

    def __init__(self) -> None:
        self.running: list[tuple[int, Future[Outcome]]] = []

    def submit(self, task: Task, trial: Trial) -> Future[Outcome]:
        future: Future[Outcome] = Future()
        self.running.append((trial[1], future))
        threading.Timer(0.02, self.end).start()
        return future

    def end(self) -> None:
        """End all that runs, once two trials or the last ones have been submitted."""
        ended, self.running = self.running, []
        died = any(seed == 0 for seed, _ in ended)
        for _, future in ended:
            if died:
                future.set_exception(BrokenProcessPool())
            else:
                future.set_result(Outcome(rows="[]"))

    def check(self) -> None:
        pass

    def close(self) -> None:
        pass
