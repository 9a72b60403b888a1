"""The rows of ``bicode bench``: what is measured, how far it should reach, what came out."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from bicode_lab.camera import Recorder, Scene, record, textured_wall
from bicode_lab.events import Events, slice_time, windows
from bicode_lab.marker import LedWaveform
from bicode_lab.recognition import Receiver, ReceiverSettings, recognise
from bicode_studies.bench import fresh_process as processes
from bicode_studies.bench import streams
from bicode_studies.bench.timing import Timing, all_opencv_threads, time_in_turn
from bicode_studies.repository import repository_root

DENSE_MEV_PER_S, THIN_MEV_PER_S, WHOLE_MEV_PER_S = 50.0, 1.0, 20.0
PERIODS = 6
PERIOD_S = 0.033
PAPER_SCENE_S = 20 * 60.0
BUDGET_CORE_S = 2 * 20 * 60.0


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table.

    Parameters
    ----------
    name : str
    what : str
    reach : float
        The figure to reach.
    at_least : bool
        Whether `reach` is a floor; else it is a ceiling.
    measured, by_clock : float
        By processor time, and by the clock.
    unit : str
    beside : str
        What it was compared with, in the same run.
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
        """True where the processor's figure reaches what was asked."""
        return self.measured >= self.reach if self.at_least else self.measured <= self.reach


def rate_row(timing: Timing, amount: float, **fields: Any) -> Row:
    """A timing and an amount of work in; a row of amount per second out."""
    return Row(at_least=True, measured=amount / timing.cpu_s, by_clock=amount / timing.wall_s,
               others=timing.others, load=timing.load, **fields)  # fmt: skip


def time_row(timing: Timing, per_second: float, **fields: Any) -> Row:
    """A timing and the units in a second in; a row of time taken out."""
    return Row(at_least=False, measured=timing.cpu_s * per_second, by_clock=timing.wall_s * per_second,
               others=timing.others, load=timing.load, **fields)  # fmt: skip


def plain(name: str) -> ModuleType:
    """The name of a file in ``benchmarks/`` in, its module out."""
    path = repository_root() / "benchmarks" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"bicode_lab_benchmarks_{name}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ValueError(f"there is no {path}; run bicode bench inside a clone of the repository")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def receive(events: Events, settings: ReceiverSettings) -> int:
    """Events and settings in, how many sightings there were out."""
    return sum(1 for _ in recognise(events, settings, t0_us=0))


def receiver_rows() -> Iterator[Row]:
    """Boxes d to g without ArUco, on a dense and on a thin stream."""
    settings = ReceiverSettings(detect_2d=False)
    for name, rate in (("receiver-dense", DENSE_MEV_PER_S), ("receiver-thin", THIN_MEV_PER_S)):
        events = streams.six_markers(rate, PERIODS * PERIOD_S)
        ours, theirs = time_in_turn(3, partial(receive, events, settings), partial(_receive_plainly, events, settings))
        ratio = f"plain NumPy and OpenCV x {theirs.cpu_s / ours.cpu_s:.0f} (reach: 10)"
        what = f"receiver without ArUco, 1280x720, six markers in clutter, {rate:g} Mev/s"
        if rate == DENSE_MEV_PER_S:
            yield rate_row(ours, events.size / 1e6, name=name, what=what, reach=100.0, unit="Mev/s", beside=ratio)
        else:
            yield rate_row(ours, PERIODS, name=name, what=what, reach=300.0, unit="periods/s", beside=ratio)


def _receive_plainly(events: Events, settings: ReceiverSettings) -> int:
    receiver = plain("plain_receiver").PlainReceiver(settings)
    return sum(len(receiver(start, part)) for start, part in windows(events, settings.delta_t_whole_us, t0_us=0))


def whole_row() -> Iterator[Row]:
    """All boxes: markers near enough for ArUco, and what fills the stream up to its rate."""
    events = streams.near_stream(WHOLE_MEV_PER_S, PERIODS * PERIOD_S)
    settings = ReceiverSettings()
    periods = [slice_time(events, k * 33_000, (k + 1) * 33_000) for k in range(PERIODS)]
    receiver = Receiver(settings)
    rows = [row for k, part in enumerate(periods) for row in receiver(k * 33_000, part)]
    poses = sum(row.rvec is not None for row in rows)
    with all_opencv_threads():  # this row is not of one core
        (timing,) = time_in_turn(5, lambda: receive(events, settings))
    row = time_row(timing, 1e3 / PERIODS, name="receiver-whole", what="a 33 ms period with ArUco and pose, 20 Mev/s",
                   reach=10.0, unit="ms")  # fmt: skip
    beside = f"{poses} poses in {PERIODS} periods; by the clock, processor time of all cores {row.measured:.1f} ms"
    yield replace(row, measured=row.by_clock, beside=beside)


def run(scene: Scene, seconds: float) -> int:
    """A scene and a length in, how many events the generator made of it out; none is kept."""
    return sum(chunk.size for chunk in Recorder(scene, seconds, np.random.default_rng(0)))


def generator_rows() -> Iterator[Row]:
    """A 64x64 square of signal 1 and 6 on 128x128 pixels, and on the whole sensor with 5 Hz of noise a pixel."""
    seconds, plain_seconds = 0.5, 0.1
    scene = streams.square_scene(whole_sensor=False)
    ours, theirs = time_in_turn(3, lambda: run(scene, seconds), lambda: simulate_plainly(plain_seconds))
    ratio = (theirs.cpu_s / plain_seconds) / (ours.cpu_s / seconds)
    yield rate_row(ours, run(scene, seconds) / 1e6, name="generator-patch", unit="Mev/s", reach=50.0,
                   what="generator, 128x128, square of 64x64, 1 dark and 6 lit, all noise",
                   beside=f"NumPy by frames of 100 us x {ratio:.0f} (reach: 50)")  # fmt: skip
    scene = streams.square_scene(whole_sensor=True)
    (timing,) = time_in_turn(3, lambda: run(scene, seconds))
    yield rate_row(timing, seconds, name="generator-sensor",
                   what="the same on 1280x720 with 5 Hz of noise a pixel",
                   reach=1.3, unit="x real time", beside="-")  # fmt: skip


def simulate_plainly(seconds: float) -> int:
    """A length in, how many events the plain NumPy simulator makes of the square on 128x128 pixels out."""
    dark = np.ones((streams.PATCH_PX, streams.PATCH_PX))
    glow = np.zeros_like(dark)
    first = (streams.PATCH_PX - streams.SQUARE_PX) // 2
    glow[first:-first, first:-first] = streams.BRIGHT
    wave, rng = LedWaveform(payload=0x25), np.random.default_rng(0)
    events = plain("plain_simulator").simulate(dark, glow, wave, streams.PIXEL, round(seconds * 1e6), rng)
    return int(events.size)


def what_if_row() -> Iterator[Row]:
    """A third of a second of one marker at 5 m in its own patch."""
    scene = streams.what_if_scene()
    settings = ReceiverSettings(width=scene.optics.width, height=scene.optics.height, detect_2d=False)
    (timing,) = time_in_turn(5, lambda: receive(record(scene, 0.33, rng=0), settings))
    yield time_row(timing, 1e3, name="what-if", what="a what-if point: 0.33 s of a marker at 5 m, simulate and decode",
                   reach=100.0, unit="ms")  # fmt: skip


def scene_rows() -> Iterator[Row]:
    """Seconds of one core that a second of the paper's scenes takes, whole receiver included."""
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
            2, begin, partial(run, scene, seconds), partial(receive, events, settings)
        )
        made_s = simulated.cpu_s - started.cpu_s  # the paper's scenes last for seconds; a beginning is theirs once
        wall_s = simulated.wall_s - started.wall_s + received.wall_s
        both = replace(simulated, cpu_s=made_s + received.cpu_s, wall_s=wall_s)
        yield time_row(both, 1 / seconds, name=name, what="seconds of a core for a second of this scene",
                       reach=BUDGET_CORE_S / PAPER_SCENE_S, unit="s/s",
                       beside=f"simulate {made_s / seconds:.2f}, receive {received.cpu_s / seconds:.2f}, beginning "
                       f"{started.cpu_s:.2f} s once, {events.size / seconds / 1e6:.1f} Mev/s")  # fmt: skip


def memory_rows() -> Iterator[Row]:
    """Most memory of `bicode decode` and of the generator, over 10 seconds and over 10 minutes."""
    for name, what in (
        ("memory-decode", "`bicode decode`"),
        ("memory-generator", "generator, 1280x720, marker at 5 m"),
    ):
        short, long = processes.most_memory_mb(name, 10.0), processes.most_memory_mb(name, 600.0)
        yield Row(name=name, what=f"{what}: most memory, 10 minutes", reach=min(600.0, short + 100.0), at_least=False,
                  measured=long, by_clock=long, unit="MB", beside=f"10 seconds: {short:.0f} MB")  # fmt: skip


def start_rows() -> Iterator[Row]:
    """From nothing to the first answer, in fresh processes."""
    timing = processes.time_fresh("-c", "import bicode_lab")
    yield time_row(timing, 1.0, name="import", what="`import bicode_lab`", reach=1.0, unit="s")
    recording = repository_root() / "data" / "near_1m.npz"
    timing = processes.time_fresh("-c", processes.RUN_DECODE.format(path=str(recording)))
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
