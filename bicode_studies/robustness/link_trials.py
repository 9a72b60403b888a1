"""One trial of a link: several receivers read the same recording, and each gives one row of counts."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from bicode_lab.camera import Scene, truth_at
from bicode_lab.events import Events
from bicode_lab.recognition import PeriodReader, Sighting, start_receiver
from bicode_studies.paper_experiments.scenes import window_scene
from bicode_studies.robustness.link_conditions import LinkCondition
from bicode_studies.robustness.link_scenes import add_tiles, link_scene, settings_of
from bicode_studies.robustness.stressors import DISTANCE, JUDGED, PERIOD_US, WARM_UP, StressCondition
from bicode_studies.score import PLACE_PX, Periods
from bicode_studies.trial import Reading, Settings, record_and_read

FIFTH = 4  # number of the period that ends with five periods of evidence
NEAR_PACKET = 0.25  # a packet that was read this near to one that was sent is that one [packets]
TIMES = ("ms_per_period",)
"""Columns that differ from one run to the next."""


class Timed:
    """Settings of a receiver whose time is taken.

    Parameters
    ----------
    settings : ReceiverSettings or ReaderSettings

    Attributes
    ----------
    ms : list of float
        How long each period took [ms].
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.ms: list[float] = []

    @property
    def delta_t_whole_us(self) -> int:
        """Length of a period [us]."""
        return self._settings.delta_t_whole_us

    def start(self, t0_us: int) -> PeriodReader:
        """Make the receiver, which notes how long each period takes."""
        reader = start_receiver(self._settings, t0_us)

        def read(start_us: int, events: Events) -> list[Sighting]:
            began = time.perf_counter()
            sightings = reader(start_us, events)
            self.ms.append(1e3 * (time.perf_counter() - began))
            return sightings

        return read


def link_rows(condition: LinkCondition, seed: int, receivers: Mapping[str, Settings]) -> list[dict[str, Any]]:
    """Record a link once, read it with each receiver and count what is right.

    Parameters
    ----------
    condition : LinkCondition
    seed : int
        Seed of the scene, of the camera's chance and of the clutter.
    receivers : mapping of str to settings
        By name; their period is that of `settings_of` the condition.

    Returns
    -------
    list of dict
        One row for each receiver: the fields of the condition, ``seed``, ``receiver``;
        ``periods`` and how many of them are ``right``; ``right_first`` and ``right_fifth``, whether the first and the
        fifth are; ``wrong_ids``; ``packets`` that lie whole in the recording and how many of them are read,
        ``packets_right``; ``false_rows``, sightings that lie on no marker; ``rows`` that lie on it;
        ``first_right_ms``, the end of the first right period (nan if there is none); ``ms_per_period``, the median
        time of a period; ``events``.
    """
    scene = link_scene(condition, seed)
    length_us = settings_of(condition).delta_t_whole_us
    periods = Periods(start_us=0, count=condition.periods, length_us=length_us)
    timed = {name: Timed(settings) for name, settings in receivers.items()}
    trial = record_and_read(scene, timed, periods=periods, seed=seed, damage=_damage(condition, seed, scene))
    return [
        {
            **asdict(condition),
            "seed": seed,
            "receiver": name,
            **_counts(reading, scene, periods),
            "ms_per_period": round(float(np.median(timed[name].ms)), 2),
            "events": trial.n_events,
        }
        for name, reading in trial.readings.items()
    ]


def _damage(condition: LinkCondition, seed: int, scene: Scene) -> Callable[[Events], Events] | None:
    """Return the function that lays tiles over the events; None without tiles."""
    if condition.clutter != "tiles":
        return None
    rng = np.random.default_rng([seed, 3])
    duration_us = condition.periods * settings_of(condition).delta_t_whole_us
    size = scene.optics.width, scene.optics.height
    return lambda events: add_tiles(events, round(condition.amount), duration_us, *size, rng)


def _counts(reading: Reading, scene: Scene, periods: Periods) -> dict[str, Any]:
    """Count what is right and what is false in a reading of a scene with one marker."""
    right = np.zeros(periods.count, bool)
    right[reading.scores["period"].to_numpy(int)] = reading.scores["id_right"].to_numpy(bool)
    at_marker = [sighting for sighting in reading.sightings if _is_at_marker(sighting, scene, periods)]
    packets, packets_right = _packets(at_marker, scene, periods)
    first = int(np.argmax(right)) if right.any() else None
    return {
        "periods": len(reading.scores),
        "right": int(right.sum()),
        "right_first": int(right[0]),
        "right_fifth": int(right[FIFTH : FIFTH + 1].any()),
        "wrong_ids": reading.wrong_ids,
        "packets": packets,
        "packets_right": packets_right,
        "false_rows": len(reading.sightings) - len(at_marker),
        "rows": len(at_marker),
        "first_right_ms": None if first is None else (first + 1) * periods.length_us / 1000,
    }


def _is_at_marker(sighting: Sighting, scene: Scene, periods: Periods) -> bool:
    """Return whether the middle of a sighting's box lies on the marker, in the middle of the period."""
    left, top, width, height = truth_at(scene, sighting.t_us + periods.length_us / 2)[0].box_px
    x, y = sighting.x + (sighting.w - 1) / 2 - left, sighting.y + (sighting.h - 1) / 2 - top
    return bool(-PLACE_PX <= x <= width + PLACE_PX and -PLACE_PX <= y <= height + PLACE_PX)


def _packets(sightings: list[Sighting], scene: Scene, periods: Periods) -> tuple[int, int]:
    """Count the packets that were sent whole in the recording, and those of them that were read."""
    marker = scene.markers[0].marker
    end_us = periods.count * periods.length_us - marker.waveform.packet_us
    starts = marker.waveform.packet_starts(0, end_us)
    read = {
        packet.start_us
        for sighting in sightings
        for packet in (*sighting.packets, *sighting.border_packets)
        if packet.checksum_ok and packet.payload == marker.payload
    }
    near_us = NEAR_PACKET * marker.waveform.packet_us
    return starts.size, sum(any(abs(each - start) <= near_us for each in read) for start in starts)


def range_rows(condition: StressCondition, seed: int, receivers: Mapping[str, Settings]) -> list[dict[str, Any]]:
    """Record the paper's marker at a distance and count the right periods after a second, as `stressors.stress` does.

    Parameters
    ----------
    condition : StressCondition
        Of the stressor `DISTANCE`.
    seed : int
    receivers : mapping of str to settings
        By name; their window is that of `paper_experiments.scenes`.

    Returns
    -------
    list of dict
        One row for each receiver, with the columns of `stressors.stress` that `receiver_ranges` needs.
    """
    if condition.stressor != DISTANCE.name:
        raise ValueError(f"stressor {condition.stressor!r} has no range; choose {DISTANCE.name!r}")
    periods = Periods(start_us=WARM_UP * PERIOD_US, count=JUDGED, length_us=PERIOD_US)
    trial = record_and_read(window_scene(condition.level, seed), receivers, periods=periods, seed=seed)
    return [
        {
            "stressor": condition.stressor, "level": condition.level, "seed": seed, "receiver": name,
            "periods": JUDGED, "right": reading.right(), "wrong_ids": reading.wrong_ids,
        }
        for name, reading in trial.readings.items()
    ]  # fmt: skip
