"""The rate of background events, period by period: of a simulated pan before the wall, and of a recording."""

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
from bicode_studies.paper_experiments.conditions import Condition
from bicode_studies.paper_experiments.scenes import scene_of
from bicode_studies.trial import PERIOD_S

Floats = npt.NDArray[np.float64]


def rates_mev_per_s(chunks: Iterable[Events]) -> Floats:
    """Return the rate of events in each whole period between the first and the last event of a stream.

    Parameters
    ----------
    chunks : iterable of ndarray of EVENT_DTYPE
        In the order of time; they may be cut anywhere.

    Returns
    -------
    ndarray, shape (periods,)
        Rates [Mev/s].

    Examples
    --------
    >>> from bicode_lab.events import make_events
    >>> rates_mev_per_s([make_events([0] * 4, [0] * 4, [1] * 4, [0, 16_500, 40_000, 66_000])]) * 33_000
    array([2., 1.])
    """
    times = np.concatenate([chunk["t"] for chunk in chunks] or [np.zeros(0, np.int64)])
    if not times.size:
        return np.zeros(0)
    period_us = paper.DELTA_T_WHOLE_US
    counts = np.bincount((times - times[0]) // period_us)
    return np.asarray(counts[: (times[-1] - times[0]) // period_us] / period_us, np.float64)


def wall_rates(condition: Condition, seeds: int, periods: int) -> Floats:
    """Return the rates of a pan's background alone, without the marker.

    Parameters
    ----------
    condition : Condition
        One with a pan.
    seeds : int
        Number of recordings; they have the scenes of the experiments' seeds 0 .. seeds - 1.
    periods : int
        Number of periods of each recording.

    Returns
    -------
    ndarray, shape (seeds * periods,)
        Rates [Mev/s].

    Raises
    ------
    ValueError
        If the condition has no pan.
    """
    if not condition.speed_m_per_s:
        raise ValueError("speed_m_per_s=0 pans past no wall; choose more than 0")
    rates = []
    for seed in range(seeds):
        scene = replace(scene_of(condition, seed), markers=())
        recorder = Recorder(scene, (periods + 1) * PERIOD_S, np.random.default_rng([seed, 2]))
        rates.append(rates_mev_per_s(recorder)[-periods:])
    return np.concatenate(rates)


def recording_rates(path: Path) -> Floats | None:
    """Return the rate of a recording in each period.

    Parameters
    ----------
    path : Path
        An event file that `recordings.open_recording` reads.

    Returns
    -------
    ndarray, shape (periods,), or None
        Rates [Mev/s]; None where there is no such file.
    """
    return rates_mev_per_s(open_recording(path)) if path.is_file() else None
