"""Time taken, and how idle the machine was meanwhile: every figure of ``bicode bench`` carries both."""

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


@dataclass(frozen=True, kw_only=True)
class Timing:
    """The best of some repeats, and the machine while they ran.

    Parameters
    ----------
    cpu_s : float
        Processor time of this process, all its threads [s].
    wall_s : float
        Time by the clock [s].
    others : float
        Share of the machine's processor time that others used, 0 .. 1.
    load : float
        Load average over a minute, at the end.
    """

    cpu_s: float
    wall_s: float
    others: float
    load: float


def time_in_turn(repeats: int, *work: Callable[[], Any]) -> list[Timing]:
    """A number of repeats and pieces of work in; each piece's best times out, taken in turn so that all share the load.

    Each piece runs once before, which compiles what is not compiled and fills the caches.
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


@contextmanager
def all_opencv_threads() -> Iterator[None]:
    """Within it OpenCV takes as many threads as it likes; afterwards as many as before."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(-1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


class Watch:
    """From its making on it knows what share of the machine's processor time others used."""

    def __init__(self) -> None:
        self._start = self._now()

    def others(self) -> float:
        """Nothing in, that share out, 0 .. 1."""
        wall, busy, own = (b - a for a, b in zip(self._start, self._now(), strict=True))
        return min(max((busy - own) / max(wall * (os.cpu_count() or 1), 1e-9), 0.0), 1.0)

    @staticmethod
    def _now() -> tuple[float, float, float]:
        """Time, seconds all processors were busy, seconds this process and its children made them so."""
        machine = psutil.cpu_times()
        busy = sum(machine) - machine.idle - getattr(machine, "iowait", 0.0) - getattr(machine, "guest", 0.0)
        return time.perf_counter(), busy, sum(os.times()[:4])


def machine() -> dict[str, Any]:
    """Nothing in; processor, cores, memory and versions out."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_gb": round(psutil.virtual_memory().total / 1e9, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("numpy", "numba", "opencv-contrib-python-headless")},
    }


def _processor() -> str:
    """What the processor calls itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
