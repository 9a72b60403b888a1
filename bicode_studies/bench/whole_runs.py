"""Rows of ``bicode bench`` that take minutes: the whole evaluation, two workers against one, all notebooks."""

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
from bicode_studies.paper_experiments.results import FIGURES, run_figure
from bicode_studies.sweep.workers import default_jobs

PART = "09"  # the figure that compares workers: at full scale it takes much longer than workers need to start

Result = TypeVar("Result")


def evaluation_row() -> Iterator[Row]:
    """Measure Figs 8 to 14 at the paper's scale, from an empty store, on all cores."""
    jobs = default_jobs()
    timing = sweep_all(jobs)
    what = f"the paper's whole evaluation at full scale, {jobs} workers"
    yield minutes_row(timing, name="evaluation", what=what, reach=20.0)


def worker_row() -> Iterator[Row]:
    """Measure one figure at the paper's scale with one worker and with two."""
    one, two = (sweep_all(jobs, (PART,)) for jobs in (1, 2))
    ratio = one.wall_s / two.wall_s
    what = f"figure {int(PART)} at full scale, two workers against one"
    yield Row(name="workers", what=what, reach=1.7, at_least=True, measured=ratio, by_clock=ratio, unit="x",
              beside=f"{one.wall_s:.0f} s with one, {two.wall_s:.0f} s with two",
              others=max(one.others, two.others), load=two.load)  # fmt: skip


def notebook_row() -> Iterator[Row]:
    """Measure all notebooks with their short settings, as `make figures` runs them."""
    timing, runs = timed(partial(run_all, quick=True, jobs=os.cpu_count() or 1, only=""))
    failed = sum(not run.succeeded for run in runs)
    yield minutes_row(timing, name="notebooks", what=f"all {len(runs)} notebooks, short settings", reach=8.0,
                      beside=f"{failed} failed")  # fmt: skip


def minutes_row(timing: Timing, *, name: str, what: str, reach: float, beside: str = "-") -> Row:
    """Return a row of elapsed minutes, because that is how long one waits for many processes.

    Parameters
    ----------
    timing : Timing
    name, what, beside : str
        See `Row`.
    reach : float
        The largest acceptable number of minutes.

    Returns
    -------
    Row
    """
    minutes = timing.wall_s / 60
    return Row(name=name, what=what, reach=reach, at_least=False, measured=minutes, by_clock=minutes, unit="min",
               beside=beside, others=timing.others, load=timing.load)  # fmt: skip


def sweep_all(jobs: int, figures: Sequence[str] = FIGURES) -> Timing:
    """Time the trials of figures at full scale, from an empty store.

    Parameters
    ----------
    jobs : int
        Number of workers.
    figures : sequence of str

    Returns
    -------
    Timing

    Raises
    ------
    RuntimeError
        If a trial fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        run = partial(run_figure, quick=False, jobs=jobs, store=Path(folder) / "sweeps.sqlite")
        timing, sweeps = timed(lambda: [run(figure) for figure in figures])
    failed = "; ".join(sweep.failure_line() for sweep in sweeps if sweep.failures)
    if failed:
        raise RuntimeError(failed)
    return timing


def timed(work: Callable[[], Result]) -> tuple[Timing, Result]:
    """Time work that starts processes.

    Parameters
    ----------
    work : callable
        A function without arguments.

    Returns
    -------
    timing : Timing
        Processor time includes that of the processes.
    result
        What `work` returned.
    """
    watch, before, started = Watch(), os.times(), time.perf_counter()
    result = work()
    cpu_s = sum(os.times()[:4]) - sum(before[:4])
    timing = Timing(
        cpu_s=cpu_s, wall_s=time.perf_counter() - started, others=watch.others(), load=os.getloadavg()[0]
    )  # fmt: skip
    return timing, result
