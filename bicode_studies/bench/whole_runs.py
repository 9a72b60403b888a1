"""Rows of ``bicode bench`` that take minutes: the paper's whole evaluation, two workers against one, every notebook."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from bicode_studies.bench.rows import Row
from bicode_studies.bench.timing import Timing, Watch
from bicode_studies.notebook.runner import run_all
from bicode_studies.paper_experiments.figure_table import FIGURES, default_jobs, figure_table

PART = "09"  # one figure at full scale stands for all where workers are compared: long beside their start

Result = TypeVar("Result")


def evaluation_row() -> Iterator[Row]:
    """Figures 8 to 14 at the paper's scale, from an empty store, on all cores."""
    jobs = default_jobs()
    timing = sweep_all(jobs)
    what = f"the paper's whole evaluation at full scale, {jobs} workers"
    yield minutes_row(timing, name="evaluation", what=what, reach=20.0)


def worker_row() -> Iterator[Row]:
    """One figure at the paper's scale with one worker and with two."""
    one, two = (sweep_all(jobs, (PART,)) for jobs in (1, 2))
    ratio = one.wall_s / two.wall_s
    what = f"figure {int(PART)} at full scale, two workers against one"
    yield Row(name="workers", what=what, reach=1.7, at_least=True, measured=ratio, by_clock=ratio, unit="x",
              beside=f"{one.wall_s:.0f} s with one, {two.wall_s:.0f} s with two",
              others=max(one.others, two.others), load=two.load)  # fmt: skip


def notebook_row() -> Iterator[Row]:
    """Every notebook with its short settings, as `make figures` runs them once it has installed."""
    timing, runs = timed(partial(run_all, quick=True, jobs=os.cpu_count() or 1, only=""))
    failed = sum(not run.succeeded for run in runs)
    yield minutes_row(timing, name="notebooks", what=f"all {len(runs)} notebooks, short settings", reach=8.0,
                      beside=f"{failed} failed")  # fmt: skip


def minutes_row(timing: Timing, *, name: str, what: str, reach: float, beside: str = "-") -> Row:
    """A timing of many processes in; a row of minutes by the clock, since that is what is waited for, out."""
    minutes = timing.wall_s / 60
    return Row(name=name, what=what, reach=reach, at_least=False, measured=minutes, by_clock=minutes, unit="min",
               beside=beside, others=timing.others, load=timing.load)  # fmt: skip


def sweep_all(jobs: int, figures: Sequence[str] = FIGURES) -> Timing:
    """A number of workers and figures in; how long their trials took at full scale from an empty store out."""
    with tempfile.TemporaryDirectory() as folder:
        run = partial(figure_table, quick=False, jobs=jobs, store=Path(folder) / "sweeps.sqlite")
        return timed(lambda: [run(figure) for figure in figures])[0]


def timed(work: Callable[[], Result]) -> tuple[Timing, Result]:
    """Work that starts processes in; how long it took, with theirs, and what it gave out."""
    watch, before, started = Watch(), os.times(), time.perf_counter()
    result = work()
    cpu_s = sum(os.times()[:4]) - sum(before[:4])
    timing = Timing(
        cpu_s=cpu_s, wall_s=time.perf_counter() - started, others=watch.others(), load=os.getloadavg()[0]
    )  # fmt: skip
    return timing, result
