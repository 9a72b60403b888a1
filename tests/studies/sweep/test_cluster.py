"""The same sweep runs on a Dask cluster: two worker processes, one of them killed in the middle."""

from __future__ import annotations

import builtins
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import dask
import pandas as pd
import pytest
from distributed import Client, LocalCluster

from bicode_studies.sweep import workers as module
from bicode_studies.sweep.sweep import Sweep, sweep
from tests.studies.sweep.cheap_trials import run, run_or_die, run_or_raise
from tests.studies.sweep.test_sweep import committed, runs_noted, stored, trials_of, wait_until

pytestmark = pytest.mark.slow


@pytest.fixture
def two_workers() -> Iterator[LocalCluster]:
    """Yield a scheduler and two worker processes of one thread, which try a trial that killed its worker once only."""
    allow = {"distributed.scheduler.allowed-failures": 0}
    with (
        dask.config.set(allow),
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
    ):
        yield cluster


def test_a_worker_killed_in_the_middle_loses_nothing_and_counts_nothing_twice(
    two_workers: LocalCluster, tmp_path: Path
) -> None:
    (tmp_path / "notes").mkdir()
    trials = trials_of(seeds=10, wait_s=0.25, note_in=str(tmp_path / "notes"))
    store = tmp_path / "s.sqlite"
    results: list[Sweep] = []
    thread = threading.Thread(
        target=lambda: results.append(sweep(run, trials, store, cluster=two_workers.scheduler_address))
    )
    thread.start()
    with Client(two_workers.scheduler_address, set_as_default=False) as client:
        workers = list(client.run(os.getpid).values())
    assert len(workers) == 2
    wait_until(lambda: store.exists() and len(committed(store)) >= 5)
    os.kill(workers[0], signal.SIGKILL)
    kept = len(committed(store))
    thread.join(timeout=60)
    assert 5 <= kept < 30
    assert results[0].failures == ()
    assert [count for *_, count in stored(store)] == [1] * 30
    assert len({note.name.split("_")[2] for note in (tmp_path / "notes").iterdir()}) >= 2  # both had a share
    here = sweep(run, trials, tmp_path / "here.sqlite", jobs=2).table
    pd.testing.assert_frame_equal(results[0].table, here)
    assert set(runs_noted(tmp_path / "notes")) == {f"{c.distance_m}_{seed}" for c, seed in trials}


def test_a_trial_that_raises_or_kills_is_told_and_the_others_go_on(two_workers: LocalCluster, tmp_path: Path) -> None:
    address = two_workers.scheduler_address
    (raised,) = sweep(run_or_raise, trials_of(), tmp_path / "s.sqlite", cluster=address).failures
    assert "seed 1: ArithmeticError: no light at all" in raised
    result = sweep(run_or_die, trials_of(), tmp_path / "s.sqlite", cluster=address)
    (killed,) = result.failures
    assert "seed 1: its worker died 3 times" in killed
    assert len(result.table) == 2 * (len(trials_of()) - 1)


def test_a_cluster_that_goes_away_is_told_and_what_was_done_is_kept(tmp_path: Path) -> None:
    store = tmp_path / "s.sqlite"
    trials = trials_of(seeds=10, wait_s=0.25)
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        said: list[str] = []

        def try_it() -> None:
            try:
                sweep(run, trials, store, cluster=cluster.scheduler_address)
            except ConnectionError as error:
                said.append(str(error))

        thread = threading.Thread(target=try_it)
        thread.start()
        wait_until(lambda: store.exists() and len(committed(store)) >= 3)
    thread.join(timeout=60)
    assert len(said) == 1
    assert "went away; what was done is kept" in said[0]
    kept = len(stored(store))
    assert 3 <= kept < 30
    pd.testing.assert_frame_equal(
        sweep(run, trials, store, jobs=2).table, sweep(run, trials, tmp_path / "other.sqlite", jobs=2).table
    )


def test_a_scheduler_without_workers_and_none_at_all_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "TIMEOUT_S", 1)
    with LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        with pytest.raises(ConnectionError, match="has no workers; start one with: dask worker tcp"):
            sweep(run, trials_of(), tmp_path / "s.sqlite", cluster=address)
    with pytest.raises(ConnectionError, match=f"no cluster answers at {address}; start one with: dask scheduler"):
        sweep(run, trials_of(), tmp_path / "s.sqlite", cluster=address)
    with pytest.raises(ValueError, match="is no address"):
        sweep(run, trials_of(), tmp_path / "s.sqlite", cluster="carrier-pigeon://x")


def test_a_missing_package_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *more: object, **others: object) -> object:
        if name == "distributed":
            raise ImportError(name)
        return real(name, *more, **others)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ValueError, match=r"needs the package distributed; in a clone .*: pip install '\.\[cluster\]'"):
        sweep(run, trials_of(), tmp_path / "s.sqlite", cluster="tcp://127.0.0.1:8786")
