"""How long work takes, and how busy the machine was meanwhile: every figure of ``bicode bench`` carries both."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import cv2
import psutil

ALL_THREADS = -1
"""For `opencv_threads`: as many as OpenCV chooses."""


@dataclass(frozen=True, kw_only=True)
class Timing:
    """The shortest of some repeats, and how busy the machine was while they ran.

    Parameters
    ----------
    cpu_s : float
        Processor time of this process, summed over its threads [s].
    wall_s : float
        Elapsed time [s].
    others : float
        Share of the machine's processor time that other programs used, 0 .. 1.
    load : float
        Load average over a minute, at the end.
    """

    cpu_s: float
    wall_s: float
    others: float
    load: float


def time_in_turn(repeats: int, *work: Callable[[], Any]) -> list[Timing]:
    """Time pieces of work, in turn so that all meet the same load.

    Each piece runs once before, which compiles the kernels and fills the caches.

    Parameters
    ----------
    repeats : int
        How often each piece is timed.
    *work : callable
        Pieces of work without arguments.

    Returns
    -------
    list of Timing
        The shortest times of each piece.
    """
    for piece in work:
        piece()
    cpu: list[list[float]] = [[] for _ in work]
    wall: list[list[float]] = [[] for _ in work]
    watch = Watch()
    for _ in range(repeats):
        for i, piece in enumerate(work):
            started, started_cpu = time.perf_counter(), time.process_time()
            piece()
            cpu[i].append(time.process_time() - started_cpu)
            wall[i].append(time.perf_counter() - started)
    others, load = watch.others(), os.getloadavg()[0]
    return [Timing(cpu_s=min(c), wall_s=min(w), others=others, load=load) for c, w in zip(cpu, wall, strict=True)]


def cpu_seconds(work: Callable[[], Any], repeats: int = 3) -> float:
    """Return the shortest processor time of a piece of work, see `time_in_turn`.

    Parameters
    ----------
    work : callable
        A function without arguments.
    repeats : int
        How often it is timed.

    Returns
    -------
    float
        Processor time [s].
    """
    return time_in_turn(repeats, work)[0].cpu_s


@contextmanager
def opencv_threads(number: int) -> Iterator[None]:
    """Let OpenCV use a number of threads within a block, and as many as before after it.

    Parameters
    ----------
    number : int
        1 or more, or `ALL_THREADS`.
    """
    before = cv2.getNumThreads()
    cv2.setNumThreads(number)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


class Watch:
    """Measures from its creation on which share of the machine's processor time other programs use."""

    def __init__(self) -> None:
        self._start = self._now()

    def others(self) -> float:
        """Return the share of the machine's processor time that other programs have used so far, 0 .. 1."""
        wall, busy, own = (b - a for a, b in zip(self._start, self._now(), strict=True))
        return min(max((busy - own) / max(wall * (os.cpu_count() or 1), 1e-9), 0.0), 1.0)

    @staticmethod
    def _now() -> tuple[float, float, float]:
        """Return the time, the busy time of all processors, and that of this process and its children [s]."""
        machine = psutil.cpu_times()
        busy = sum(machine) - machine.idle - getattr(machine, "iowait", 0.0) - getattr(machine, "guest", 0.0)
        return time.perf_counter(), busy, sum(os.times()[:4])


def machine() -> dict[str, Any]:
    """Describe this machine.

    Returns
    -------
    dict
        Processor, number of cores, memory in GB, system, and the versions of Python and of the computing libraries.
    """
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_gb": round(psutil.virtual_memory().total / 1e9, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "numba", "opencv-contrib-python-headless")},
    }


def _processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
