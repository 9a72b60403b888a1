"""How busy is the background?   a pan before the wall, or a recording -> events a second, period by period"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bicode_lab import paper
from bicode_lab.camera import Recorder
from bicode_lab.events import Events
from bicode_lab.recordings import open_recording
from bicode_studies.paper_experiments.scenes import Condition, scene_of
from bicode_studies.paper_experiments.trial_rows import PERIOD_S

Floats = npt.NDArray[np.float64]


def rates_mev_per_s(chunks: Iterable[Events], bin_us: int = paper.DELTA_T_WHOLE_US) -> Floats:
    """A stream of events in; events a second of each whole bin between its first and last event out [Mev/s].

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> rates_mev_per_s([make_events([0] * 4, [0] * 4, [1] * 4, [0, 5, 12, 20])], bin_us=10).tolist()
    [0.2, 0.1]
    """
    times = np.concatenate([chunk["t"] for chunk in chunks] or [np.zeros(0, np.int64)])
    if not times.size:
        return np.zeros(0)
    counts = np.bincount((times - times[0]) // bin_us)
    return np.asarray(counts[: (times[-1] - times[0]) // bin_us] / bin_us, np.float64)


def wall_rates(condition: Condition, seeds: int, periods: int) -> Floats:
    """A pan's condition in; its background's rate in each period of the first seeds out, no marker in view [Mev/s]."""
    if not condition.speed_m_per_s:
        raise ValueError("speed_m_per_s=0 pans past no wall; choose more than 0")
    rates = []
    for seed in range(seeds):
        scene = replace(scene_of(condition, seed), markers=())
        recorder = Recorder(scene, (periods + 1) * PERIOD_S, np.random.default_rng([seed, 2]))
        rates.append(rates_mev_per_s(recorder)[-periods:])
    return np.concatenate(rates)


def recording_rates(path: Path) -> Floats | None:
    """The path of a recording in; its rate in each period out [Mev/s]; None where there is no such file."""
    return rates_mev_per_s(open_recording(path)) if path.is_file() else None
