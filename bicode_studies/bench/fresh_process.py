"""Measurements that need a fresh process: the time to start, and the peak memory."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bicode_lab.events import Events, make_events
from bicode_lab.recordings import write_recording
from bicode_studies.bench.timing import Timing, Watch

REPEATS = 5
RUN_DECODE = "from bicode_studies.cli.main import main; main(['decode', {path!r}, '--format', 'csv'])"
RUN_GENERATOR = """
import numpy as np
from bicode_lab.camera import PlacedMarker, Pose, Recorder, Scene, Still
scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),))
for chunk in Recorder(scene, {seconds}, np.random.default_rng(0)):
    pass
"""
SAY_MEMORY = """
import resource, sys
from pathlib import Path
# The peak of this program alone, where the system knows it: ru_maxrss starts with the peak of the parent process.
status = Path("/proc/self/status")
lines = status.read_text().splitlines() if status.exists() else []
peak = [line.split()[1] for line in lines if line.startswith("VmHWM")]
print(*peak or [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss], file=sys.stderr)
"""


def time_fresh(*arguments: str) -> Timing:
    """Time a fresh process; it runs once before to fill the caches.

    Parameters
    ----------
    *arguments : str
        Arguments for Python.

    Returns
    -------
    Timing
        The shortest times of `REPEATS` processes.
    """
    cpu, wall = [], []
    watch = Watch()
    for _ in range(REPEATS + 1):
        started, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall.append(time.perf_counter() - started)
        cpu.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return Timing(cpu_s=min(cpu[1:]), wall_s=min(wall[1:]), others=watch.others(), load=os.getloadavg()[0])


def peak_memory_mb(name: str, seconds: float) -> float:
    """Return the peak memory of a fresh process.

    Parameters
    ----------
    name : str
        "memory-decode" for `bicode decode`, "memory-generator" for the generator.
    seconds : float
        Length of the recording [s].

    Returns
    -------
    float
        Peak memory [MB].
    """
    with tempfile.TemporaryDirectory() as folder:
        if name == "memory-generator":
            code = RUN_GENERATOR.format(seconds=seconds)
        else:
            path = Path(folder) / "long.raw"
            write_recording(path, _long_recording(seconds), 1280, 720)
            code = f"try:\n    {RUN_DECODE.format(path=str(path))}\nexcept SystemExit:\n    pass"
        done = subprocess.run([sys.executable, "-c", code + SAY_MEMORY], check=True, capture_output=True, text=True)
    return int(done.stderr.split()[-1]) / 1e3


def _long_recording(seconds: float) -> Events:
    """Return 20,000 events per second, spread over the sensor."""
    rng = np.random.default_rng(0)
    n = round(20_000 * seconds)
    t_us = np.sort(rng.integers(round(seconds * 1e6), size=n))
    return make_events(rng.integers(1280, size=n), rng.integers(720, size=n), rng.integers(2, size=n), t_us)
