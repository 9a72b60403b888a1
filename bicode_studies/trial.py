"""One trial: a scene is recorded once, read with every receiver, and each reading is scored against the truth.

Studies call `run` for counts, `record_and_read` where they need the scores of single periods, and `read` for events
that they have recorded already.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from bicode_lab import paper
from bicode_lab.camera import Recorder, Scene, truth_at
from bicode_lab.events import Events, join, windows
from bicode_lab.recognition import PeriodReader, ReaderSettings, ReceiverSettings, Sighting, start_receiver
from bicode_studies.score import AXIS_DEG, Periods, score

Settings = ReceiverSettings | ReaderSettings
PERIOD_S = paper.DELTA_T_WHOLE_US * 1e-6  # length of the paper's period [s]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """The sightings of one receiver in one recording, with their scores.

    Attributes
    ----------
    sightings : tuple of Sighting
        Those of the judged periods.
    scores : DataFrame
        One row for each judged period and each marker in view, see `score.score`.
    wrong_ids : int
        Number of sightings with an ID that no marker of the scene sends.
    """

    sightings: tuple[Sighting, ...]
    scores: pd.DataFrame
    wrong_ids: int

    def right(self, name: str = "id_right") -> int:
        """Count the periods with the right ID, or with ``"marker_2d_right"`` those with the right 2D marker."""
        return int(self.scores[name].sum()) if len(self.scores) else 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """The readings of one recording by all receivers.

    Attributes
    ----------
    readings : dict of str to Reading
        By the name of the receiver.
    n_events, n_lost : int
        Number of events that arrive at the receivers, and of those that the camera's readout loses.
    """

    readings: dict[str, Reading]
    n_events: int
    n_lost: int


def read(events: Events, scene: Scene, settings: Settings, periods: Periods) -> Reading:
    """Read a recording with one receiver and score it against the truth.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Time 0 is the start of the scene.
    scene : Scene
        The scene that was recorded.
    settings : ReceiverSettings or SoftSettings
    periods : Periods
        The periods that are judged.

    Returns
    -------
    Reading
    """
    reader = start_receiver(settings, 0)
    sightings = [s for t_us, part in windows(events, settings.delta_t_whole_us, t0_us=0) for s in reader(t_us, part)]
    return _judged(sightings, scene, periods)


def record_and_read(
    scene: Scene,
    receivers: Mapping[str, Settings],
    *,
    periods: Periods,
    seed: int,
    duration_s: float | None = None,
    damage: Callable[[Events], Events] | None = None,
) -> Trial:
    """Record a scene once and read it with every receiver.

    Events are handed on period by period, so that memory does not grow with the recording; with `damage` all of them
    are held at once.

    Parameters
    ----------
    scene : Scene
    receivers : mapping of str to ReceiverSettings or SoftSettings
        By name; all have the same delta_t_whole_us.
    periods : Periods
        The periods that are judged.
    seed : int
        Seed of the camera's chance.
    duration_s : float, optional
        Length of the recording [s]; None ends it with the last judged period.
    damage : callable, optional
        Changes the events between the camera and the receivers: takes and returns an event array, in the order of
        time.

    Returns
    -------
    Trial

    Raises
    ------
    ValueError
        If there is no receiver, or if they have periods of different lengths.
    """
    length_us = _length_us(receivers)
    end_us = periods.start_us + periods.count * periods.length_us
    recorder = Recorder(scene, end_us * 1e-6 if duration_s is None else duration_s, np.random.default_rng([seed, 2]))
    chunks: Iterable[Events] = recorder if damage is None else [damage(join(recorder))]
    readers: dict[str, PeriodReader] = {name: start_receiver(each, 0) for name, each in receivers.items()}
    sightings: dict[str, list[Sighting]] = {name: [] for name in readers}
    n_events = 0
    for start_us, events in windows(chunks, length_us, t0_us=0):
        n_events += events.size
        for name, reader in readers.items():
            sightings[name] += reader(start_us, events)
    readings = {name: _judged(found, scene, periods) for name, found in sightings.items()}
    return Trial(readings=readings, n_events=n_events, n_lost=recorder.queue.lost)


def run(scene: Scene, receivers: Mapping[str, Settings], *, periods: int, seed: int, warm_up: int = 0) -> pd.DataFrame:
    """Record a scene once, read it with every receiver and score each against the truth.

    Parameters
    ----------
    scene : Scene
    receivers : mapping of str to ReceiverSettings or SoftSettings
        By name; all have the same delta_t_whole_us.
    periods : int
        Number of periods that are judged.
    seed : int
        Seed of the camera's chance.
    warm_up : int
        Number of periods before these, which the receivers read and which are not judged.

    Returns
    -------
    DataFrame
        One row for each receiver: ``receiver``; ``seed``; ``periods``, the number of judged periods, each counted
        once for every marker in view; of these ``id_right``, ``marker_2d_right`` and ``axes_wrong``, in which the
        pattern was found but an axis points elsewhere; ``wrong_ids``, the number of sightings with an ID that no
        marker sends; ``events`` and ``lost`` of the whole recording.

    Raises
    ------
    ValueError
        If there is no receiver, or if they have periods of different lengths.

    Examples
    --------
    >>> rows = run(Scene(), {"paper": ReceiverSettings()}, periods=3, seed=0)
    >>> rows[["receiver", "periods", "id_right", "wrong_ids"]].to_dict("records")
    [{'receiver': 'paper', 'periods': 3, 'id_right': 3, 'wrong_ids': 0}]
    """
    length_us = _length_us(receivers)
    judged = Periods(start_us=warm_up * length_us, count=periods, length_us=length_us)
    trial = record_and_read(scene, receivers, periods=judged, seed=seed)
    return pd.DataFrame([_row(name, reading, trial, seed) for name, reading in trial.readings.items()])


def _length_us(receivers: Mapping[str, Settings]) -> int:
    """Return the length of the receivers' period, which must be the same for all of them [us]."""
    lengths_us = sorted({settings.delta_t_whole_us for settings in receivers.values()})
    if len(lengths_us) != 1:
        raise ValueError(f"receivers have delta_t_whole_us of {lengths_us}; give one or more, all of one length")
    return lengths_us[0]


def _judged(sightings: Iterable[Sighting], scene: Scene, periods: Periods) -> Reading:
    """Score the sightings of the judged periods."""
    end_us = periods.start_us + periods.count * periods.length_us
    kept = tuple(s for s in sightings if periods.start_us <= s.t_us < end_us)
    sent = {placed.marker.payload for placed in scene.markers}
    return Reading(
        sightings=kept,
        scores=score(kept, lambda t_us: truth_at(scene, t_us), periods),
        wrong_ids=sum(s.id is not None and s.id not in sent for s in kept),
    )


def _row(name: str, reading: Reading, trial: Trial, seed: int) -> dict[str, Any]:
    """Return a receiver's row of the table of `run`."""
    scores = reading.scores
    return {
        "receiver": name, "seed": seed, "periods": len(scores),
        "id_right": reading.right(), "marker_2d_right": reading.right("marker_2d_right"),
        "axes_wrong": int((scores["axis_deg"] > AXIS_DEG).sum()) if len(scores) else 0,
        "wrong_ids": reading.wrong_ids, "events": trial.n_events, "lost": trial.n_lost,
    }  # fmt: skip
