"""Trials that cost nothing, for the tests of sweeps; in a module of their own, so that workers find them."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
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
    """Two rows of numbers that depend on condition and seed alone."""
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
    """As `run`, but at 5 m seed 1 raises."""
    if condition.distance_m == 5 and seed == 1:
        raise ArithmeticError("no light\nat all")
    return run(condition, seed)


def run_or_die(condition: Cheap, seed: int) -> list[dict[str, Any]]:
    """As `run`, but at 5 m seed 1 takes its worker with it."""
    if condition.distance_m == 5 and seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return run(condition, seed)
