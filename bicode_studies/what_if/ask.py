"""Ask about one choice or many: a few periods are simulated and read by the paper's receiver.

The marker stands in a small window, which is a sensor of its own. For the 2D marker the events are moved back to their
place on the whole sensor, because ArUco's smallest marker is a share of the image.

Accuracy counts periods, as the paper does. Goodput is the payload rate times the share of whole packets that are read
right; packets across the border of two periods count, too. So a choice can have one without the other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import numpy.typing as npt
import pandas as pd
from joblib import Parallel, delayed
from tqdm import tqdm

from bicode_lab.camera import Optics, Scene, record, truth_at
from bicode_lab.events import Events, copy_events, slice_time
from bicode_lab.recognition import Sighting, accumulate
from bicode_lab.recognition.sighting import packet_rows
from bicode_studies.score import Periods
from bicode_studies.statistics import interval_over_seeds, wilson
from bicode_studies.trial import read
from bicode_studies.what_if.choice import Choice, list_remarks

# Shares of periods in the table of `ask_many`: the count that each is made from, and the ends of its interval.
SHARES = {"accuracy": ("right", "low", "high"), "found": ("found", "found_low", "found_high"),
          "accuracy_2d": ("right_2d", "low_2d", "high_2d")}  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class WhatIfResult:
    """One recording of a choice, and what the receiver reads in it.

    Attributes
    ----------
    choice : Choice
    seed : int
    scene : Scene
        What was recorded; its sensor is the window.
    events : ndarray of EVENT_DTYPE, shape (n,)
    sightings : tuple of Sighting
        Coordinates in the window.
    periods, right, found : int
        Numbers of all periods, of those with the right ID, and of those with a region at the marker.
    right_2d : int or None
        Number of periods with the right 2D marker; None if it was not looked for.
    packets, packets_sent : int
        Of the packets that lie whole in the recording, the number that is read right, also across the border of
        periods, and the number that is sent.
    wrong_ids : int
        Number of periods with an ID that was not sent.
    """

    choice: Choice
    seed: int
    scene: Scene
    events: Events
    sightings: tuple[Sighting, ...]
    periods: int
    right: int
    found: int
    right_2d: int | None
    packets: int
    packets_sent: int
    wrong_ids: int

    @property
    def accuracy(self) -> tuple[float, float, float]:
        """Share of periods with the right ID, and the ends of its 95 % Wilson interval within this recording."""
        low, high = wilson(self.right, self.periods)
        return self.right / self.periods, float(low), float(high)

    @property
    def goodput_bps(self) -> float:
        """Rate of correct payload bits [bit/s]."""
        if not self.packets_sent:
            return 0.0
        # A packet that begins just before the recording may be read.
        share = min(self.packets / self.packets_sent, 1.0)
        return share * self.choice.packet_format.payload_rate_bps

    @property
    def reasons(self) -> dict[str, int]:
        """Reasons why periods have no ID, and how often each occurs."""
        return dict(Counter(s.reason for s in self.sightings if s.reason is not None))


def ask(choice: Choice, seed: int = 0, *, detect_2d: bool = False) -> WhatIfResult:
    """Simulate a recording of a few periods of one choice, and read it.

    Parameters
    ----------
    choice : Choice
    seed : int
        Seed of the marker's payload, phase and place, and of the camera.
    detect_2d : bool
        Whether the 2D marker is looked for, too.

    Returns
    -------
    WhatIfResult

    Raises
    ------
    ValueError
        If the choice is impossible, with the words of its `list_remarks`.

    Examples
    --------
    >>> result = ask(Choice(distance_m=2.5))
    >>> result.right == result.periods
    True
    """
    obstacles = [f"{remark.setting}: {remark.words}" for remark in list_remarks(choice) if remark.impossible]
    if obstacles:
        raise ValueError("; ".join(obstacles))
    scene = choice.scene(seed)
    return _read(choice, seed, scene, _record(scene, seed, choice.seconds()), detect_2d)


def ask_many(
    choices: Iterable[Choice], seeds: Sequence[int], *, detect_2d: bool = False, n_jobs: int = 1
) -> pd.DataFrame:
    """Ask about many choices with several seeds; choices that differ only in the receiver share their recordings.

    Parameters
    ----------
    choices : iterable of Choice
    seeds : sequence of int
        One recording is made for each.
    detect_2d : bool
        Whether the 2D marker is looked for, too.
    n_jobs : int
        Number of processes; the result does not depend on it.

    Returns
    -------
    DataFrame
        One row for each choice: its fields and ``possible``; three shares of periods: ``accuracy`` (right ID),
        ``found`` (a region at the marker), ``accuracy_2d`` (right pattern; nan if it was not looked for), each with the
        ends of its 95 % interval, ``low``, ``high``, ``found_low`` and so on; ``goodput_bps``, ``seeds``, ``periods``,
        ``wrong_ids``; ``words``, the remarks on the choice. For an impossible choice the numbers are nan.

        An interval is the wider one of that over seeds and that over periods, because few seeds may agree by chance.
    """
    asked = list(choices)
    groups: dict[Choice, list[Choice]] = {}
    for choice in asked:
        if not any(remark.impossible for remark in list_remarks(choice)):
            groups.setdefault(choice.with_paper_receiver(), []).append(choice)
    tasks = [(group, seed) for group in groups.values() for seed in seeds]
    done = Parallel(n_jobs=n_jobs, return_as="generator")(delayed(_ask_group)(*task, detect_2d) for task in tasks)
    rows = [row for part in tqdm(done, total=len(tasks), unit=" recordings", disable=None, leave=False) for row in part]
    counts: dict[Choice, list[dict[str, float]]] = {}
    for choice, row in rows:
        counts.setdefault(choice, []).append(row)
    table = []
    for choice in asked:
        words = "; ".join(f"{remark.setting}: {remark.words}" for remark in list_remarks(choice))
        numbers = _summarise(counts.get(choice))
        table.append({**asdict(choice), "possible": choice in counts, **numbers, "words": words})
    return pd.DataFrame(table)


def frames_showing(result: WhatIfResult, delta_t_us: int) -> tuple[int, int]:
    """Count the 3-valued frames of a recording that show the marker.

    Frames follow each other without overlap (II-A). A frame shows the marker if at least as many pixels of the plate
    as make a region are not 0. A frame that falls into the start of a packet shows nothing.

    Parameters
    ----------
    result : WhatIfResult
    delta_t_us : int
        Length of a frame [us].

    Returns
    -------
    showing, all : int
        Number of frames that show the marker, and of all frames.
    """
    optics, receiver = result.scene.optics, result.choice.receiver()
    left, top, width, height = truth_at(result.scene, 0)[0].box_px
    rows = slice(max(int(top), 0), int(top + height) + 2)
    columns = slice(max(int(left), 0), int(left + width) + 2)
    n = int(result.choice.seconds() * 1e6) // delta_t_us
    showing = 0
    for k in range(n):
        part = slice_time(result.events, k * delta_t_us, (k + 1) * delta_t_us)
        frame = accumulate(part, optics.width, optics.height, "any")[rows, columns]
        showing += int(np.count_nonzero(frame) >= receiver.min_region_pixels)
    return showing, n


def _ask_group(choices: list[Choice], seed: int, detect_2d: bool) -> list[tuple[Choice, dict[str, float]]]:
    """Record choices that send alike once, and return what each one's receiver counts in the recording."""
    scene = choices[0].scene(seed)
    events = _record(scene, seed, max(choice.seconds() for choice in choices))
    counted = []
    for choice in choices:
        result = _read(choice, seed, scene, slice_time(events, 0, round(choice.seconds() * 1e6)), detect_2d)
        row = {
            "periods": result.periods, "right": result.right, "found": result.found,
            "right_2d": np.nan if result.right_2d is None else result.right_2d,
            "goodput_bps": result.goodput_bps, "wrong_ids": result.wrong_ids,
        }  # fmt: skip
        counted.append((choice, row))
    return counted


def _summarise(counts: list[dict[str, float]] | None) -> dict[str, float]:
    """Return shares with their intervals, means and sums of the counts of all seeds; nan if there are no counts."""
    if counts is None:
        names = [name for share, (_, low, high) in SHARES.items() for name in (share, low, high)]
        return {**dict.fromkeys([*names, "goodput_bps"], np.nan), "seeds": 0, "periods": 0, "wrong_ids": 0}
    rows = pd.DataFrame(counts)
    numbers: dict[str, float] = {}
    for name, (column, low, high) in SHARES.items():
        share = share_with_interval(rows[column].to_numpy(), rows["periods"].to_numpy())
        numbers |= dict(zip((name, low, high), share, strict=True))
    sums = {name: int(rows[name].sum()) for name in ("periods", "wrong_ids")}
    return {**numbers, "goodput_bps": rows["goodput_bps"].mean(), "seeds": len(rows), **sums}


def share_with_interval(right: npt.NDArray[np.float64], periods: npt.NDArray[np.int64]) -> tuple[float, float, float]:
    """Return the mean share of right periods with its 95 % interval over seeds.

    Parameters
    ----------
    right, periods : ndarray, shape (seeds,)
        Numbers of right periods and of all periods of each seed.

    Returns
    -------
    share, low, high : float
        0 .. 1; nan if a number of right periods is nan.

    Examples
    --------
    >>> [round(value, 2) for value in share_with_interval(np.array([4.0, 5.0]), np.array([10, 10]))]
    [0.45, 0.16, 0.84]
    """
    if np.isnan(right).any():
        return np.nan, np.nan, np.nan
    return float((right / periods).mean()), *interval_over_seeds(right, periods)


def _record(scene: Scene, seed: int, seconds: float) -> Events:
    """Record a scene with the camera's seed of a trial, so that it can be cut, moved and read several times."""
    return record(scene, seconds, np.random.default_rng([seed, 2]))


def _read(choice: Choice, seed: int, scene: Scene, events: Events, detect_2d: bool) -> WhatIfResult:
    """Read events with the receiver of a choice and score them."""
    window = scene.optics
    settings = replace(choice.receiver(), width=window.width, height=window.height, detect_2d=False)
    periods = Periods(
        start_us=0,
        count=round(choice.seconds() * 1e6) // choice.delta_t_whole_us,
        length_us=choice.delta_t_whole_us,
        frame_2d_us=choice.delta_t_2d_us,
    )
    reading = read(events, scene, settings, periods)
    wave = scene.markers[0].marker.waveform
    last_us = periods.count * periods.length_us - wave.packet_us
    return WhatIfResult(
        choice=choice, seed=seed, scene=scene, events=events, sightings=reading.sightings, periods=periods.count,
        right=reading.right(),
        found=len({s.t_us for s in reading.sightings}),
        right_2d=_right_2d(choice, scene, events, periods) if detect_2d else None,
        packets=sum(row.checksum_ok and row.id == wave.payload for row in packet_rows(reading.sightings)),
        packets_sent=wave.packet_starts(0.0, last_us).size if last_us > 0 else 0,
        wrong_ids=reading.wrong_ids,
    )  # fmt: skip


def _right_2d(choice: Choice, scene: Scene, events: Events, periods: Periods) -> int:
    """Count the periods in which the 2D marker is right on the whole sensor."""
    whole = Optics()
    moved = copy_events(events)
    moved["x"] += (whole.width - scene.optics.width) // 2
    moved["y"] += (whole.height - scene.optics.height) // 2
    return read(moved, replace(scene, optics=whole), choice.receiver(), periods).right("marker_2d_right")
