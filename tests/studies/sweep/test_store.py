"""What a store of trials and a scheduler's address can get wrong is one line that says what to do."""

from __future__ import annotations

import socket
import sqlite3
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest

from bicode_studies.sweep import store as store_module
from bicode_studies.sweep.scheduler import refuse_no_scheduler
from bicode_studies.sweep.store import Key, TrialStore
from bicode_studies.sweep.sweep import sweep
from tests.studies.sweep.cheap_trials import run
from tests.studies.sweep.test_sweep import trials_of, wait_until


def test_a_store_in_use_is_said_to_be_in_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "OPEN_WAIT_S", 0.1)
    monkeypatch.setattr(store_module, "WAIT_S", 0.1)
    path = tmp_path / "s.sqlite"
    with TrialStore(path, "run", "a") as kept:
        kept.add(Key("c", 0), "[]")
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            with pytest.raises(ValueError, match=r"s\.sqlite is in use by another process; wait until"):
                TrialStore(path, "run", "a")
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            with pytest.raises(ValueError, match=r"in use by another process.*1 trials of this code are kept"):
                kept.add(Key("c", 1), "[]")
        kept.add(Key("c", 1), "[]")
        assert len(kept.keys()) == 2


def test_a_full_disk_is_named_and_what_is_kept_is_counted(tmp_path: Path) -> None:
    with TrialStore(tmp_path / "s.sqlite", "run", "a") as kept:
        kept.add(Key("c", 0), "[]")
        kept._file.execute("PRAGMA max_page_count = 1")  # SQLite says of this what it says of a full disk
        with pytest.raises(ValueError, match=r"the disk is full; make room; 1 trials of this code are kept"):
            kept.add(Key("c", 1), f'["{"x" * 100_000}"]')


@pytest.mark.parametrize("again", [False, True])
def test_a_store_that_is_removed_or_replaced_while_trials_run_is_an_error(tmp_path: Path, again: bool) -> None:
    path = tmp_path / "s.sqlite"
    with TrialStore(path, "run", "a") as kept:
        kept.add(Key("c", 0), "[]")
        path.rename(tmp_path / "elsewhere")
        if again:
            path.write_bytes((tmp_path / "elsewhere").read_bytes())
        with pytest.raises(ValueError, match=r"s\.sqlite was removed or replaced while trials ran, so none"):
            kept.add(Key("c", 1), "[]")
        with pytest.raises(ValueError, match="removed or replaced"):
            kept.check()


def test_a_sweep_does_not_end_well_without_its_store(tmp_path: Path) -> None:
    path = tmp_path / "s.sqlite"
    (tmp_path / "notes").mkdir()
    trials = trials_of(seeds=1, note_in=str(tmp_path / "notes"), wait_s=0.5)
    remove = threading.Thread(target=lambda: (wait_until(lambda: any((tmp_path / "notes").iterdir())), path.unlink()))
    remove.start()
    with pytest.raises(ValueError, match="removed or replaced"):
        sweep(run, trials, path, jobs=1)
    remove.join()


def test_a_store_that_is_removed_after_the_last_trial_is_an_error_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = TrialStore.add

    def add_and_remove(store: TrialStore, key: Key, rows: str) -> None:
        add(store, key, rows)
        store.path.unlink()

    monkeypatch.setattr(TrialStore, "add", add_and_remove)
    with pytest.raises(ValueError, match="removed or replaced"):
        sweep(run, trials_of(distances=(5.0,), seeds=1), tmp_path / "s.sqlite", jobs=1)


def test_a_folder_or_a_file_without_rights_is_no_store(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match="folder cannot be read and written"):
        TrialStore(tmp_path / "folder", "run", "a")


@pytest.mark.parametrize("address", ["foo", "tcp://foo", "127.0.0.1:", "tcp://127.0.0.1:99999", "a b:1", "tcp:/a:1"])
def test_what_is_no_address_is_refused_at_once(address: str) -> None:
    begun = time.monotonic()
    with pytest.raises(ValueError, match=r"is no address; write tcp://HOST:PORT"):
        refuse_no_scheduler(address, 10)
    assert time.monotonic() - begun < 1


@pytest.mark.parametrize("speaks", [None, b"", b"x"])
def test_who_listens_must_speak_first(speaks: bytes | None) -> None:
    """A dashboard says nothing, some programs hang up at once, and a scheduler speaks."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, port = server.getsockname()[:2]
        held = []

        def answer() -> None:
            line, _ = server.accept()
            held.append(line)
            if speaks is not None:
                line.sendall(speaks)
                line.close()

        threading.Thread(target=answer, daemon=True).start()
        if speaks:
            refuse_no_scheduler(f"tcp://{host}:{port}", 5)
        else:
            with pytest.raises(ConnectionError, match=r"no Dask scheduler answers at .*dashboard"):
                refuse_no_scheduler(f"{host}:{port}", 0.3)
    with pytest.raises(ConnectionError, match=f"no cluster answers at tcp://{host}:{port}; start one"):
        refuse_no_scheduler(f"tcp://{host}:{port}", 1)
