"""What the receiver and the generator cost, against what there is to do: the measurements of notebook 20.

All times are of one core by processor time, the best of some repeats.
"""

from __future__ import annotations

import cProfile
import pstats
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.camera import Optics, PixelModel, PlacedMarker, Pose, Recorder, Scene, Still
from bicode_lab.events import Events, slice_time
from bicode_lab.marker import Marker
from bicode_lab.recognition import LedCounter, ReceiverSettings, RegionFinder, Tracker, decode_packets, recognise
from bicode_lab.recognition.event_codes import EventCoder
from bicode_lab.recognition.marker_2d import find_marker_2d, frame_2d
from bicode_studies.bench.streams import HEIGHT, PAYLOADS, WIDTH, six_markers

PERIOD_US = 33_000
EVENT_BYTES = 16
LABELS = {
    # columns of the tables below, and what they are in words
    "receive_ms": "receive",
    "receive_s": "receive",
    "receive_s_per_s": "receive",
    "receive_with_aruco_s_per_s": "receive, with ArUco",
    "generate_s": "generate",
    "generate_s_per_s": "generate",
}
GENERATOR_PARTS = {
    # the recorder's functions, and what they are in words
    "_settled_pixels": "pixels at rest (once)",
    "_draw": "drawing the plate",
    "awake": "choosing pixels",
    "schedule": "edges of the LED",
    "_run": "pixels",
    "_add_background": "background events",
    "_take_until": "sorting by time",
    "pass_on": "readout",
}


def seconds_of(work: Callable[[], Any], repeats: int = 3) -> float:
    """A piece of work in, its best processor time out [s]; it runs once before."""
    work()
    best = np.inf
    for _ in range(repeats):
        started = time.process_time()
        work()
        best = min(best, time.process_time() - started)
    return float(best)


def receive(events: Events, settings: ReceiverSettings) -> int:
    """Events and settings in, the number of sightings out."""
    return sum(1 for _ in recognise(events, settings, t0_us=0))


def generate(scene: Scene, seconds: float, seed: int = 0) -> int:
    """A scene, a length and a seed in; the number of events the generator makes out, none of them kept."""
    return sum(chunk.size for chunk in Recorder(scene, seconds, np.random.default_rng(seed)))


def by_events(mev_per_s: Sequence[float], periods: int, seed: int = 0) -> pd.DataFrame:
    """Rates of a stream with six markers in; the receiver's time, without ArUco, and regions of a period out [ms]."""
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for rate in mev_per_s:
        events = six_markers(rate, periods * PERIOD_US * 1e-6, seed)
        ms = seconds_of(partial(receive, events, settings)) / periods * 1e3
        rows.append((events.size / periods / 1e6, ms, receive(events, settings) / periods))
    return pd.DataFrame(rows, columns=["mev_a_period", "receive_ms", "regions"])


def by_markers(numbers: Sequence[int], seconds: float, seed: int = 0) -> pd.DataFrame:
    """Numbers of markers at 5 m in; time for a second of scene out, generator and receiver without ArUco [s/s]."""
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for number in numbers:
        placed = [
            PlacedMarker(marker=Marker(payload=PAYLOADS[k % 6], phase_us=777.0 * k), path=_grid(k))
            for k in range(number)
        ]
        scene = Scene(markers=tuple(placed))
        events = np.concatenate(list(Recorder(scene, seconds, np.random.default_rng(seed))))
        start_s = seconds_of(partial(Recorder, scene, seconds, np.random.default_rng(seed)), 2)
        make_s = seconds_of(partial(generate, scene, seconds, seed), 2) - start_s
        read_s = seconds_of(partial(receive, events, settings), 2)
        rows.append((number, events.size / seconds / 1e6, make_s / seconds, read_s / seconds))
    return pd.DataFrame(rows, columns=["markers", "mev_per_s", "generate_s_per_s", "receive_s_per_s"])


def _grid(number: int) -> Still:
    """A place at 5 m for the marker of a number, 24 of them in view."""
    row, column = divmod(number, 6)
    return Still(Pose.facing(5.0, x_m=0.55 * (column - 2.5), y_m=0.4 * (row - 1.5)))


def by_pixels(widths: Sequence[int], seconds: float, seed: int = 0) -> pd.DataFrame:
    """Widths of a 16:9 sensor in; time for a second of one marker at 5 m and 1 Hz a pixel of noise out [s/s]."""
    rows = []
    for width in widths:
        optics = Optics(width=width, height=width * HEIGHT // WIDTH)
        scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),), optics=optics,
                      pixel_model=PixelModel(background_hz=1.0))  # fmt: skip
        events = np.concatenate(list(Recorder(scene, seconds, np.random.default_rng(seed))))
        settings = ReceiverSettings(width=optics.width, height=optics.height)
        blind = replace(settings, detect_2d=False)
        started = seconds_of(partial(Recorder, scene, seconds, np.random.default_rng(seed)), 2)
        made = seconds_of(partial(generate, scene, seconds, seed), 2) - started
        times = [made, *(seconds_of(partial(receive, events, s), 2) for s in (blind, settings))]
        rows.append((width * optics.height / 1e6, *(taken / seconds for taken in times)))
    columns = ["megapixels", "generate_s_per_s", "receive_s_per_s", "receive_with_aruco_s_per_s"]
    return pd.DataFrame(rows, columns=columns)


def by_length(seconds: Sequence[float], seed: int = 0) -> pd.DataFrame:
    """Lengths of a recording of one marker at 5 m in; time to make it and to read it out [s]."""
    scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),))
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for length_s in seconds:
        events = np.concatenate(list(Recorder(scene, length_s, np.random.default_rng(seed))))
        make_s = seconds_of(partial(generate, scene, length_s, seed), 2)
        rows.append((length_s, make_s, seconds_of(partial(receive, events, settings), 2)))
    return pd.DataFrame(rows, columns=["length_s", "generate_s", "receive_s"])


def receiver_boxes(events: Events, periods: int, settings: ReceiverSettings) -> pd.Series[float]:
    """Events of some periods in; the time of each box of the receiver for a period out [ms]."""
    finder, counter = RegionFinder(settings), LedCounter(settings.width, settings.height)
    parts = [slice_time(events, k * PERIOD_US, (k + 1) * PERIOD_US) for k in range(periods)]
    coders = [EventCoder(settings.width, settings.height) for _ in parts]
    coded = [coder(part) for coder, part in zip(coders, parts, strict=True)]
    shots = [c.between(k * PERIOD_US, k * PERIOD_US + settings.delta_t_2d_us) for k, c in enumerate(coded)]
    frames = [frame_2d(shot, settings) for shot in shots]
    boxes = [[(r.x, r.y, r.w, r.h) for r in finder(c, k * PERIOD_US)] for k, c in enumerate(coded)]
    bins = PERIOD_US // settings.delta_t_id_us

    def count() -> list[Any]:
        return [counter(c, box, k * PERIOD_US, bins, settings.delta_t_id_us)
                for k, (c, box) in enumerate(zip(coded, boxes, strict=True))]  # fmt: skip

    counts = count()

    def track() -> None:
        tracker = Tracker(settings.max_age, settings.min_iou)
        for box in boxes:
            tracker.update(box)

    work: dict[str, Callable[[], Any]] = {
        "codes of events": lambda: [coder(part) for coder, part in zip(coders, parts, strict=True)],
        "a, b: frame": lambda: [frame_2d(shot, settings) for shot in shots],
        "c: ArUco, pose": lambda: [find_marker_2d(frame, settings) for frame in frames],
        "d, e, f: regions": lambda: [finder(c, k * PERIOD_US) for k, c in enumerate(coded)],
        "f: tracks": track,
        "g: counts": count,
        "g: packets": lambda: [decode_packets(on, off, 0, settings.delta_t_id_us, settings.packet_format,
                                              gate=settings.led_gate)
                               for n_on, n_off in counts for on, off in zip(n_on, n_off, strict=True)],
    }  # fmt: skip
    return pd.Series({name: seconds_of(piece) / periods * 1e3 for name, piece in work.items()}, name="ms")


def generator_parts(scene: Scene, seconds: float, seed: int = 0) -> pd.Series[float]:
    """A scene and a length in; the time of each part of the generator out, for an event [ns]."""
    generate(scene, 0.02, seed)
    profile = cProfile.Profile(time.process_time)
    n_events = profile.runcall(generate, scene, seconds, seed)
    spent = {name: cumulative for (_, _, name), (_, _, _, cumulative, _) in pstats.Stats(profile).stats.items()}  # type: ignore[attr-defined]
    times = {words: spent.get(name, 0.0) / n_events * 1e9 for name, words in GENERATOR_PARTS.items()}
    whole = spent["generate"] / n_events * 1e9
    return pd.Series({**times, "the rest": whole - sum(times.values())}, name="ns")


def copy_gb_per_s(megabytes: int = 128) -> float:
    """An array's size in; how fast it is copied, bytes read and bytes written counted, out [GB/s]."""
    source: npt.NDArray[np.float64] = np.ones(megabytes * 1_000_000 // 8)
    target = np.empty_like(source)
    return 2 * source.nbytes / seconds_of(lambda: np.copyto(target, source), 5) / 1e9


def straight_line(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[float, float, float]:
    """Two columns in; slope and intercept of the line through them, and the farthest point's distance over the
    largest y, out.

    Examples
    --------
    >>> [round(v, 6) for v in straight_line([1, 2, 3], [12, 14, 16])]
    [2.0, 10.0, 0.0]
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    slope, intercept = np.polyfit(x, y, 1)
    return float(slope), float(intercept), float(np.abs(slope * x + intercept - y).max() / np.abs(y).max())
