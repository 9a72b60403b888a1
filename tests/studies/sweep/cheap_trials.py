"""Trials that take no time, for the tests of sweeps; they have a module of their own, so that workers find them."""

from __future__ import annotations

import os
import signal
import time
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Cheap:
    """A condition: what the trial does, and how long it takes."""

    distance_m: float
    wait_s: float = 0.0
    note_in: str = ""  # a folder: each run of a trial leaves a file there


def run(condition: Cheap, seed: int) -> list[dict[str, Any]]:
    """Return two rows of numbers that depend on condition and seed alone."""
    time.sleep(condition.wait_s)
    if condition.note_in:
        (Path(condition.note_in) / f"{condition.distance_m}_{seed}_{os.getpid()}_{time.monotonic_ns()}").touch()
    rng = np.random.default_rng([seed, round(1000 * condition.distance_m)])
    return [
        {"distance_m": condition.distance_m, "seed": seed, "receiver": receiver, "frame_rule_2d": "any", "periods": 200,
         "id_right": rng.integers(200), "marker_2d_right": rng.integers(200), "share": rng.random()}
        for receiver in ("ours", "authors")
    ]  # fmt: skip


def run_or_raise(condition: Cheap, seed: int) -> list[dict[str, Any]]:
    """Return what `run` does, but raise at 5 m with seed 1."""
    if condition.distance_m == 5 and seed == 1:
        raise ArithmeticError("no light\nat all")
    return run(condition, seed)


def run_or_die(condition: Cheap, seed: int) -> list[dict[str, Any]]:
    """Return what `run` does, but kill the worker at 5 m with seed 1."""
    if condition.distance_m == 5 and seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return run(condition, seed)


def count(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Return rows as `false_ids.count_piece`, without a recording, and note the call in the folder ``NOTES``."""
    (Path(os.environ["NOTES"]) / f"{seed}_{condition.receiver}").touch(exist_ok=False)
    counted = {"seconds": 30.0, "looked_at": 5, "structures": 2, "passed": 1, "ids": 1, "zeros": 0, "events": 100}
    return [
        {"piece": seed, "clutter": "mains lamps", "receiver": condition.receiver, "checksum": checksum, **counted}
        for checksum in ("sum", "crc3")
    ]


def count_periods(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Return rows as `stressors.stress`, without a recording."""
    distance_m = condition.level if condition.stressor == "distance" else 30.0
    shared = {"stressor": condition.stressor, "level": condition.level, "distance_m": distance_m, "seed": seed}
    right = 15 if distance_m < 40 else 0
    return [
        {**shared, "receiver": receiver, "periods": 15, "right": right, "wrong_ids": 0}
        for receiver in ("paper", "soft, 1 period", "soft, 30 periods")
    ]


def count_clutter(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Return rows as `sequential_trials.count_piece_by_sequential`, without a recording."""
    counted = {"seconds": 30.0, "looked_at": 5, "structures": 2, "passed": 0, "ids": 0, "zeros": 0, "events": 100}
    return [
        {"piece": seed, "clutter": "mains lamps", "receiver": "sequential", "checksum": checksum, **counted}
        for checksum in ("sum", "crc3")
    ]


def read_by_two(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Return rows as `earlier_receivers.read_link_by_earlier`, without a recording: all is right."""
    return [_link_row(condition, seed, "paper", 10), _link_row(condition, seed, "soft", 0)]


def read_by_one(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Return rows as `sequential_trials.read_link_by_sequential`, without a recording: all but 40 m is right."""
    return [_link_row(condition, seed, "sequential", 0 if condition.distance_m == 40 else 10)]


def _link_row(condition: Any, seed: int, receiver: str, right: int) -> dict[str, Any]:
    """Return a row as `link_trials.link_rows`."""
    counted = {"right_first": 1, "right_fifth": 1, "wrong_ids": 0, "packets": 22, "packets_right": 22, "false_rows": 0,
               "rows": 10, "first_right_ms": 33.0, "ms_per_period": 1.0, "events": 100}  # fmt: skip
    return {**asdict(condition), "seed": seed, "receiver": receiver, "periods": 10, "right": right, **counted}


def fail(condition: Any, seed: int) -> list[dict[str, Any]]:
    """Raise an error."""
    raise ArithmeticError("no light")


class Here:
    """Workers that run each trial in this process, when it is submitted."""

    at_once = 1

    def __init__(self, jobs: int) -> None:
        pass

    def submit(self, task: Any, trial: tuple[Any, int]) -> Future[Any]:
        """Run a trial."""
        future: Future[Any] = Future()
        future.set_result(task(*trial))
        return future

    def check(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
