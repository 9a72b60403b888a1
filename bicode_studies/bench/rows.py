"""The rows of ``bicode bench``: what is measured, what should be reached, and what came out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bicode_lab.camera import Recorder, record, textured_wall
from bicode_lab.events import windows
from bicode_lab.recognition import Receiver, ReceiverSettings
from bicode_studies.bench import fresh_process, streams
from bicode_studies.bench.timing import ALL_THREADS, Timing, opencv_threads, time_in_turn
from bicode_studies.bench.workloads import generate, generate_plainly, receive, receive_plainly
from bicode_studies.repository import repository_root

DENSE_MEV_PER_S, THIN_MEV_PER_S, WHOLE_MEV_PER_S = 50.0, 1.0, 20.0
PERIODS = 6
PERIOD_S = streams.PERIOD_US * 1e-6
PAPER_SCENE_S = 20 * 60.0
BUDGET_CORE_S = 2 * 20 * 60.0


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of the table.

    Parameters
    ----------
    name : str
        Name of the row; saved tables are compared by it.
    what : str
        What is measured, in words.
    reach : float
        The value to reach.
    at_least : bool
        True if `reach` is the smallest acceptable value, False if it is the largest.
    measured, by_clock : float
        The value by processor time, and by elapsed time.
    unit : str
        Unit of these values.
    beside : str
        What the value was compared with in the same run.
    others, load : float
        See `Timing`.
    """

    name: str
    what: str
    reach: float
    at_least: bool
    measured: float
    by_clock: float
    unit: str
    beside: str = "-"
    others: float = 0.0
    load: float = 0.0

    @property
    def is_met(self) -> bool:
        """True if the value by processor time reaches what was asked."""
        return self.measured >= self.reach if self.at_least else self.measured <= self.reach


def rate_row(timing: Timing, amount: float, **fields: Any) -> Row:
    """Return a row of work per second.

    Parameters
    ----------
    timing : Timing
    amount : float
        Amount of work that was timed, in the unit of the row times seconds.
    **fields
        The other fields of `Row`.

    Returns
    -------
    Row
    """
    return Row(at_least=True, measured=amount / timing.cpu_s, by_clock=amount / timing.wall_s,
               others=timing.others, load=timing.load, **fields)  # fmt: skip


def time_row(timing: Timing, per_second: float, **fields: Any) -> Row:
    """Return a row of time taken.

    Parameters
    ----------
    timing : Timing
    per_second : float
        Number of the row's units in a second, for example 1000 for ms.
    **fields
        The other fields of `Row`.

    Returns
    -------
    Row
    """
    return Row(at_least=False, measured=timing.cpu_s * per_second, by_clock=timing.wall_s * per_second,
               others=timing.others, load=timing.load, **fields)  # fmt: skip


def receiver_rows() -> Iterator[Row]:
    """Measure boxes d to g of the receiver, without ArUco, on a dense and on a thin stream."""
    settings = ReceiverSettings(detect_2d=False)
    for name, rate in (("receiver-dense", DENSE_MEV_PER_S), ("receiver-thin", THIN_MEV_PER_S)):
        events = streams.six_markers(rate, PERIODS * PERIOD_S)
        ours, theirs = time_in_turn(3, partial(receive, events, settings), partial(receive_plainly, events, settings))
        ratio = f"plain NumPy and OpenCV x {theirs.cpu_s / ours.cpu_s:.0f} (reach: 10)"
        what = f"receiver without ArUco, 1280x720, six markers in clutter, {rate:g} Mev/s"
        if rate == DENSE_MEV_PER_S:
            yield rate_row(ours, events.size / 1e6, name=name, what=what, reach=100.0, unit="Mev/s", beside=ratio)
        else:
            yield rate_row(ours, PERIODS, name=name, what=what, reach=300.0, unit="periods/s", beside=ratio)


def whole_row() -> Iterator[Row]:
    """Measure all boxes of the receiver on markers that are near enough for ArUco, in a stream of 20 Mev/s."""
    events = streams.near_stream(WHOLE_MEV_PER_S, PERIODS * PERIOD_S)
    settings = ReceiverSettings()
    receiver = Receiver(settings)
    sightings = [s for start_us, part in windows(events, streams.PERIOD_US, t0_us=0) for s in receiver(start_us, part)]
    poses = sum(sighting.rvec is not None for sighting in sightings)
    with opencv_threads(ALL_THREADS):  # this row is not of one core
        (timing,) = time_in_turn(5, partial(receive, events, settings))
    row = time_row(timing, 1e3 / PERIODS, name="receiver-whole", what="a 33 ms period with ArUco and pose, 20 Mev/s",
                   reach=10.0, unit="ms")  # fmt: skip
    beside = f"{poses} poses in {PERIODS} periods; by the clock, processor time of all cores {row.measured:.1f} ms"
    yield replace(row, measured=row.by_clock, beside=beside)


def generator_rows() -> Iterator[Row]:
    """Measure the generator on a blinking square, on 128x128 pixels and on the whole sensor with 5 Hz per pixel."""
    seconds, plain_seconds = 0.5, 0.1
    scene = streams.square_scene(whole_sensor=False)
    ours, theirs = time_in_turn(3, partial(generate, scene, seconds), partial(generate_plainly, plain_seconds))
    ratio = (theirs.cpu_s / plain_seconds) / (ours.cpu_s / seconds)
    yield rate_row(ours, generate(scene, seconds) / 1e6, name="generator-patch", unit="Mev/s", reach=50.0,
                   what="generator, 128x128, square of 64x64, 1 dark and 6 lit, all noise",
                   beside=f"NumPy by frames of 100 us x {ratio:.0f} (reach: 50)")  # fmt: skip
    scene = streams.square_scene(whole_sensor=True)
    (timing,) = time_in_turn(3, partial(generate, scene, seconds))
    yield rate_row(timing, seconds, name="generator-sensor",
                   what="the same on 1280x720 with 5 Hz of background activity per pixel",
                   reach=1.3, unit="x real time")  # fmt: skip


def what_if_row() -> Iterator[Row]:
    """Measure a third of a second of one marker at 5 m in its own patch, simulated and decoded."""
    scene = streams.what_if_scene()
    settings = ReceiverSettings(width=scene.optics.width, height=scene.optics.height, detect_2d=False)
    (timing,) = time_in_turn(5, lambda: receive(record(scene, 0.33, rng=0), settings))
    yield time_row(timing, 1e3, name="what-if", what="a what-if point: 0.33 s of a marker at 5 m, simulate and decode",
                   reach=100.0, unit="ms")  # fmt: skip


def scene_rows() -> Iterator[Row]:
    """Measure the processor time for a second of each of the paper's scenes, generator and whole receiver."""
    wall = textured_wall()
    scenes = {
        "still-0.5m": (streams.still_scene(0.5), 0.1),
        "still-2.5m": (streams.still_scene(2.5), 0.3),
        "still-20m": (streams.still_scene(20.0), 0.3),
        "still-10cm-0.5m": (streams.still_scene(0.5, 0.1, 40.9), 0.1),
    }
    for distance_m in (0.5, 2.5, 20.0):
        for speed in (0.105, 0.314):
            scenes[f"pan-{distance_m:g}m-{speed:g}"] = (streams.pan_scene(distance_m, speed, wall), 0.05)
    for name, (scene, seconds) in scenes.items():
        events = record(scene, seconds, rng=0)
        settings = ReceiverSettings()
        begin = partial(Recorder, scene, seconds, np.random.default_rng(0))
        started, simulated, received = time_in_turn(
            2, begin, partial(generate, scene, seconds), partial(receive, events, settings)
        )
        made_s = simulated.cpu_s - started.cpu_s  # the paper's scenes last for seconds and start only once
        wall_s = simulated.wall_s - started.wall_s + received.wall_s
        both = replace(simulated, cpu_s=made_s + received.cpu_s, wall_s=wall_s)
        yield time_row(both, 1 / seconds, name=name, what="seconds of a core for a second of this scene",
                       reach=BUDGET_CORE_S / PAPER_SCENE_S, unit="s/s",
                       beside=f"simulate {made_s / seconds:.2f}, receive {received.cpu_s / seconds:.2f}, start "
                       f"{started.cpu_s:.2f} s once, {events.size / seconds / 1e6:.1f} Mev/s")  # fmt: skip


def memory_rows() -> Iterator[Row]:
    """Measure the peak memory of `bicode decode` and of the generator, over 10 seconds and over 10 minutes."""
    for name, what in (
        ("memory-decode", "`bicode decode`"),
        ("memory-generator", "generator, 1280x720, marker at 5 m"),
    ):
        short, long = fresh_process.peak_memory_mb(name, 10.0), fresh_process.peak_memory_mb(name, 600.0)
        yield Row(name=name, what=f"{what}: peak memory, 10 minutes", reach=min(600.0, short + 100.0), at_least=False,
                  measured=long, by_clock=long, unit="MB", beside=f"10 seconds: {short:.0f} MB")  # fmt: skip


def start_rows() -> Iterator[Row]:
    """Measure the time to the first result, in fresh processes."""
    timing = fresh_process.time_fresh("-c", "import bicode_lab")
    yield time_row(timing, 1.0, name="import", what="`import bicode_lab`", reach=1.0, unit="s")
    recording = repository_root() / "data" / "near_1m.npz"
    timing = fresh_process.time_fresh("-c", fresh_process.RUN_DECODE.format(path=str(recording)))
    yield time_row(timing, 1.0, name="first-decode", what="`bicode decode` of a fresh process, warm cache",
                   reach=4.0, unit="s")  # fmt: skip


GROUPS: dict[str, Callable[[], Iterator[Row]]] = {
    "receiver": receiver_rows,
    "whole": whole_row,
    "generator": generator_rows,
    "what-if": what_if_row,
    "start": start_rows,
    "scenes": scene_rows,
    "memory": memory_rows,
}
