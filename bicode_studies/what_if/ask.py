"""What if it were built otherwise?   a choice -> how well it is read

A few periods are simulated and read by the paper's receiver. The marker's window is seen as a
sensor of its own; for the 2D marker its events are put back where they lie on the whole one,
because ArUco's smallest size is a share of the image.

Accuracy counts periods, as the paper does. Goodput is the rate of correct payload bits: of all
packets sent whole, those across the border of two periods too, the share that was read right,
times the payload bits sent a second. So a choice can have one without the other.
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

from bicode_lab.camera import Optics, Recorder, Scene, truth_at
from bicode_lab.events import Events, copy_events, join, slice_time
from bicode_lab.recognition import Sighting, accumulate, recognise
from bicode_lab.recognition.sighting import packet_rows
from bicode_studies.score import Periods, accuracy, score
from bicode_studies.statistics import bootstrap
from bicode_studies.what_if.choice import Choice, remarks


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """What one recording says about a choice.

    Parameters
    ----------
    choice : Choice
    seed : int
    scene : Scene
        What was recorded; the window is its sensor.
    events : ndarray of EVENT_DTYPE, shape (n,)
    sightings : tuple of Sighting
        In the window.
    periods, right, found : int
        All; those with the ID right; those with a region at the marker.
    right_2d : int or None
        Periods with the 2D marker right; None where it was not looked for.
    packets, packets_sent : int
        Packets that lie whole in the recording: those read right, across the border of periods too, and all.
    wrong_ids : int
        Periods with another ID than was sent.
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
        """Share of periods with the ID right, and its 95 % Wilson interval within this recording."""
        return accuracy([True] * self.right + [False] * (self.periods - self.right))

    @property
    def goodput_bps(self) -> float:
        """Correct payload bits a second [bit/s]."""
        if not self.packets_sent:
            return 0.0
        share = min(self.packets / self.packets_sent, 1.0)  # one that begins just before the recording may be read
        return share * self.choice.packet_format.payload_rate_bps

    @property
    def reasons(self) -> dict[str, int]:
        """Why periods have no ID, and how many."""
        return dict(Counter(s.reason for s in self.sightings if s.reason is not None))


def ask(choice: Choice, seed: int = 0, *, detect_2d: bool = False) -> Answer:
    """A choice and a seed in, what a recording of a few periods says out.

    Raises
    ------
    ValueError
        For an impossible choice, with its `remarks`.

    Examples
    --------
    >>> answer = ask(Choice(distance_m=2.5))
    >>> answer.right == answer.periods
    True
    """
    wrong = [f"{remark.setting}: {remark.words}" for remark in remarks(choice) if remark.impossible]
    if wrong:
        raise ValueError("; ".join(wrong))
    scene = choice.scene(seed)
    return _read(choice, seed, scene, _record(scene, seed, choice.seconds()), detect_2d)


def ask_many(
    choices: Iterable[Choice], seeds: Sequence[int], *, detect_2d: bool = False, n_jobs: int = 1
) -> pd.DataFrame:
    """Choices and seeds in, a row for each choice out; what is the same for the receiver is recorded once.

    Returns
    -------
    DataFrame
        The fields of the choice and ``possible``; three shares of periods: ``accuracy`` (ID right), ``found``
        (a region at the marker), ``accuracy_2d`` (pattern right; nan where it was not looked for), each with
        the ends of its 95 % interval, ``low``, ``high``, ``found_low`` and so on; ``goodput_bps``, ``seeds``,
        ``periods``, ``wrong_ids``; ``words``, what stands against the choice. Where it is impossible the
        numbers are nan. Intervals are the wider of that over seeds and that over periods: few seeds hardly tell.
    """
    asked = list(choices)
    groups: dict[Choice, list[Choice]] = {}
    for choice in asked:
        if not any(remark.impossible for remark in remarks(choice)):
            groups.setdefault(choice.as_sent(), []).append(choice)
    tasks = [(group, seed) for group in groups.values() for seed in seeds]
    done = Parallel(n_jobs=n_jobs, return_as="generator")(delayed(_ask_group)(*task, detect_2d) for task in tasks)
    rows = [row for part in tqdm(done, total=len(tasks), unit=" recordings", disable=None, leave=False) for row in part]
    counts: dict[Choice, list[dict[str, float]]] = {}
    for choice, row in rows:
        counts.setdefault(choice, []).append(row)
    table = []
    for choice in asked:
        words = "; ".join(f"{remark.setting}: {remark.words}" for remark in remarks(choice))
        numbers = _over_seeds(counts.get(choice))
        table.append({**asdict(choice), "possible": choice in counts, **numbers, "words": words})
    return pd.DataFrame(table)


def _ask_group(choices: list[Choice], seed: int, detect_2d: bool) -> list[tuple[Choice, dict[str, float]]]:
    """Choices that are sent alike, one recording, and what each receiver counts in it."""
    scene = choices[0].scene(seed)
    events = _record(scene, seed, max(choice.seconds() for choice in choices))
    counted = []
    for choice in choices:
        answer = _read(choice, seed, scene, slice_time(events, 0, round(choice.seconds() * 1e6)), detect_2d)
        row = {
            "periods": answer.periods, "right": answer.right, "found": answer.found,
            "right_2d": np.nan if answer.right_2d is None else answer.right_2d,
            "goodput_bps": answer.goodput_bps, "wrong_ids": answer.wrong_ids,
        }  # fmt: skip
        counted.append((choice, row))
    return counted


SHARES = {"accuracy": ("right", "low", "high"), "found": ("found", "found_low", "found_high"),
          "accuracy_2d": ("right_2d", "low_2d", "high_2d")}  # fmt: skip


def _over_seeds(counts: list[dict[str, float]] | None) -> dict[str, float]:
    """What was counted seed by seed in; shares with their intervals, means and sums out."""
    if counts is None:
        names = [name for share, (_, low, high) in SHARES.items() for name in (share, low, high)]
        return {**dict.fromkeys([*names, "goodput_bps"], np.nan), "seeds": 0, "periods": 0, "wrong_ids": 0}
    rows = pd.DataFrame(counts)
    numbers: dict[str, float] = {}
    for name, (column, low, high) in SHARES.items():
        numbers |= dict(
            zip((name, low, high), _share(rows[column].to_numpy(), rows["periods"].to_numpy()), strict=True)
        )
    sums = {name: int(rows[name].sum()) for name in ("periods", "wrong_ids")}
    return {**numbers, "goodput_bps": rows["goodput_bps"].mean(), "seeds": len(rows), **sums}


def _share(right: npt.NDArray[np.float64], periods: npt.NDArray[np.int64]) -> tuple[float, float, float]:
    """Right periods and all periods, seed by seed, in; their share and its 95 % interval out."""
    if np.isnan(right).any():
        return np.nan, np.nan, np.nan
    shares, n = right / periods, int(periods.sum())
    low, high = bootstrap(shares, n, np.random.default_rng(len(shares)))
    _, least, most = accuracy(np.arange(n) < right.sum())
    return float(shares.mean()), min(low, least), max(high, most)


def frames_showing(answer: Answer, delta_t_us: int) -> tuple[int, int]:
    """An answer and a length [us] in; how many 3-valued frames of it show the marker, and how many there are, out.

    One frame after the other, as the text has it (II-A): it shows the marker where at least as many of the
    plate's pixels as make a region are not 0. A frame that falls into a packet's start shows nothing.
    """
    optics, receiver = answer.scene.optics, answer.choice.receiver()
    left, top, width, height = truth_at(answer.scene, 0)[0].box_px
    rows = slice(max(int(top), 0), int(top + height) + 2)
    columns = slice(max(int(left), 0), int(left + width) + 2)
    n = int(answer.choice.seconds() * 1e6) // delta_t_us
    shown = 0
    for k in range(n):
        part = slice_time(answer.events, k * delta_t_us, (k + 1) * delta_t_us)
        frame = accumulate(part, optics.width, optics.height, "any")[rows, columns]
        shown += int(np.count_nonzero(frame) >= receiver.min_region_pixels)
    return shown, n


def _record(scene: Scene, seed: int, seconds: float) -> Events:
    """A scene, a seed and a length in, its events out."""
    return join(Recorder(scene, seconds, np.random.default_rng([seed, 2])))


def _read(choice: Choice, seed: int, scene: Scene, events: Events, detect_2d: bool) -> Answer:
    """Events in, what the receiver makes of them and how much of it is right out."""
    window = scene.optics
    settings = replace(choice.receiver(), width=window.width, height=window.height, detect_2d=False)
    sightings = tuple(recognise(events, settings, t0_us=0))
    periods = Periods(
        start_us=0,
        count=round(choice.seconds() * 1e6) // choice.delta_t_whole_us,
        length_us=choice.delta_t_whole_us,
        frame_2d_us=choice.delta_t_2d_us,
    )
    scores = score(sightings, lambda t_us: truth_at(scene, t_us), periods)
    wave = scene.markers[0].marker.waveform
    payload, last_us = wave.payload, periods.count * periods.length_us - wave.packet_us
    return Answer(
        choice=choice, seed=seed, scene=scene, events=events, sightings=sightings, periods=periods.count,
        right=int(scores["id_right"].sum()),
        found=len({s.t_us for s in sightings}),
        right_2d=_right_2d(choice, scene, events, periods) if detect_2d else None,
        packets=sum(row.checksum_ok and row.id == payload for row in packet_rows(sightings)),
        packets_sent=wave.packet_starts(0.0, last_us).size if last_us > 0 else 0,
        wrong_ids=sum(s.id is not None and s.id != payload for s in sightings),
    )  # fmt: skip


def _right_2d(choice: Choice, scene: Scene, events: Events, periods: Periods) -> int:
    """In how many periods the 2D marker is right, on the whole sensor."""
    whole = Optics()
    moved = copy_events(events)
    moved["x"] += (whole.width - scene.optics.width) // 2
    moved["y"] += (whole.height - scene.optics.height) // 2
    sightings = recognise(moved, choice.receiver(), t0_us=0)
    scores = score(sightings, lambda t_us: truth_at(replace(scene, optics=whole), t_us), periods)
    return int(scores["marker_2d_right"].sum())
