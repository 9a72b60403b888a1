"""How the cost of receiver and generator grows with what there is to do: the first half of notebook 20.

All times are processor time of one core, the shortest of some repeats.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from bicode_lab.camera import Optics, PixelModel, PlacedMarker, Pose, Recorder, Scene, Still
from bicode_lab.camera.recorder import PARTS
from bicode_lab.events import EVENT_DTYPE, Events, join
from bicode_lab.marker import Marker
from bicode_lab.recognition import LedCounter, ReceiverSettings, RegionFinder, Tracker, decode_packets
from bicode_lab.recognition.marker_2d import find_marker_2d, frame_2d
from bicode_studies.bench.streams import HEIGHT, PAYLOADS, PERIOD_US, WIDTH, six_markers
from bicode_studies.bench.timing import cpu_seconds
from bicode_studies.bench.workloads import coded_periods, generate, receive

EVENT_BYTES = EVENT_DTYPE.itemsize
COPIED_BYTES = 128_000_000  # much more than any cache holds
LABELS = {
    "receive_ms": "receive",
    "receive_s": "receive",
    "receive_s_per_s": "receive",
    "receive_with_aruco_s_per_s": "receive, with ArUco",
    "generate_s": "generate",
    "generate_s_per_s": "generate",
}
"""Columns of the tables below, in words."""
GENERATOR_PARTS = dict(
    zip(
        PARTS,
        (
            "initial pixel state (once)",
            "drawing the plate",
            "choosing pixels",
            "edges of the LED",
            "pixels",
            "background activity",
            "sorting by time",
            "readout",
        ),
        strict=True,
    )
)
"""Parts of the generator's work, in words."""


def by_events(mev_per_s: Sequence[float], periods: int, seed: int = 0) -> pd.DataFrame:
    """Time the receiver, without ArUco, on streams of different event rates with six markers.

    Parameters
    ----------
    mev_per_s : sequence of float
        Event rates in events per microsecond.
    periods : int
        Length of each stream in periods.
    seed : int

    Returns
    -------
    DataFrame
        One row for each rate: ``mev_a_period``, millions of events per period; ``receive_ms``, time per period;
        ``regions``, mean number of regions per period.
    """
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for rate in mev_per_s:
        events = six_markers(rate, periods * PERIOD_US * 1e-6, seed)
        ms = cpu_seconds(partial(receive, events, settings)) / periods * 1e3
        rows.append((events.size / periods / 1e6, ms, receive(events, settings) / periods))
    return pd.DataFrame(rows, columns=["mev_a_period", "receive_ms", "regions"])


def by_markers(numbers: Sequence[int], seconds: float, seed: int = 0) -> pd.DataFrame:
    """Time generator and receiver, without ArUco, on scenes with different numbers of markers at 5 m.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of markers, 1 .. 24.
    seconds : float
        Length of each recording [s].
    seed : int

    Returns
    -------
    DataFrame
        One row for each number: ``markers``; ``mev_per_s``, the event rate; ``generate_s_per_s`` and
        ``receive_s_per_s``, time per second of the scene.
    """
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for number in numbers:
        placed = [
            PlacedMarker(marker=Marker(payload=PAYLOADS[k % len(PAYLOADS)], phase_us=777.0 * k), path=_grid_place(k))
            for k in range(number)
        ]
        scene = Scene(markers=tuple(placed))
        events = _recorded(scene, seconds, seed)
        make_s = _making_seconds(scene, seconds, seed)
        read_s = cpu_seconds(partial(receive, events, settings), 2)
        rows.append((number, events.size / seconds / 1e6, make_s / seconds, read_s / seconds))
    return pd.DataFrame(rows, columns=["markers", "mev_per_s", "generate_s_per_s", "receive_s_per_s"])


def _grid_place(number: int) -> Still:
    """Return a place at 5 m for one of up to 24 markers, all of them in view."""
    row, column = divmod(number, 6)
    return Still(Pose.facing(5.0, x_m=0.55 * (column - 2.5), y_m=0.4 * (row - 1.5)))


def _recorded(scene: Scene, seconds: float, seed: int) -> Events:
    """Record a scene."""
    return join(Recorder(scene, seconds, np.random.default_rng(seed)))


def _making_seconds(scene: Scene, seconds: float, seed: int) -> float:
    """Return the time to generate a recording, without the time to start the recorder [s]."""
    start_s = cpu_seconds(partial(Recorder, scene, seconds, np.random.default_rng(seed)), 2)
    return cpu_seconds(partial(generate, scene, seconds, seed), 2) - start_s


def by_pixels(widths: Sequence[int], seconds: float, seed: int = 0) -> pd.DataFrame:
    """Time generator and receiver on sensors of different sizes: one marker at 5 m, 1 Hz of noise per pixel.

    Parameters
    ----------
    widths : sequence of int
        Widths of 16:9 sensors [px].
    seconds : float
        Length of each recording [s].
    seed : int

    Returns
    -------
    DataFrame
        One row for each width: ``megapixels``; ``generate_s_per_s``, ``receive_s_per_s`` and
        ``receive_with_aruco_s_per_s``, time per second of the scene.
    """
    rows = []
    for width in widths:
        optics = Optics(width=width, height=width * HEIGHT // WIDTH)
        scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),), optics=optics,
                      pixel_model=PixelModel(background_hz=1.0))  # fmt: skip
        events = _recorded(scene, seconds, seed)
        settings = ReceiverSettings(width=optics.width, height=optics.height)
        without_2d = replace(settings, detect_2d=False)
        made = _making_seconds(scene, seconds, seed)
        times = [made, *(cpu_seconds(partial(receive, events, s), 2) for s in (without_2d, settings))]
        rows.append((width * optics.height / 1e6, *(taken / seconds for taken in times)))
    columns = ["megapixels", "generate_s_per_s", "receive_s_per_s", "receive_with_aruco_s_per_s"]
    return pd.DataFrame(rows, columns=columns)


def by_length(seconds: Sequence[float], seed: int = 0) -> pd.DataFrame:
    """Time generator and receiver, without ArUco, on recordings of different lengths of one marker at 5 m.

    Parameters
    ----------
    seconds : sequence of float
        Lengths of the recordings [s].
    seed : int

    Returns
    -------
    DataFrame
        One row for each length: ``length_s``, ``generate_s`` and ``receive_s``.
    """
    scene = Scene(markers=(PlacedMarker(path=Still(Pose.facing(5.0))),))
    settings = ReceiverSettings(detect_2d=False)
    rows = []
    for length_s in seconds:
        events = _recorded(scene, length_s, seed)
        make_s = cpu_seconds(partial(generate, scene, length_s, seed), 2)
        rows.append((length_s, make_s, cpu_seconds(partial(receive, events, settings), 2)))
    return pd.DataFrame(rows, columns=["length_s", "generate_s", "receive_s"])


def receiver_boxes(events: Events, periods: int, settings: ReceiverSettings) -> pd.Series[float]:
    """Time each box of the receiver by itself.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        A stream that starts at 0.
    periods : int
        Length of the stream in periods.
    settings : ReceiverSettings

    Returns
    -------
    Series
        Time per period [ms] by box.
    """
    finder, counter = RegionFinder(settings), LedCounter(settings.width, settings.height)
    starts, code, coded = coded_periods(events, settings)
    shots = [c.between(start, start + settings.delta_t_2d_us) for start, c in zip(starts, coded, strict=True)]
    frames = [frame_2d(shot, settings) for shot in shots]
    boxes = [[(r.x, r.y, r.w, r.h) for r in finder(c, start)] for start, c in zip(starts, coded, strict=True)]
    bins = PERIOD_US // settings.delta_t_id_us

    def count() -> list[Any]:
        return [counter(c, box, start, bins, settings.delta_t_id_us)
                for start, c, box in zip(starts, coded, boxes, strict=True)]  # fmt: skip

    counts = count()

    def track() -> None:
        tracker = Tracker(settings.max_age, settings.min_iou)
        for box in boxes:
            tracker.update(box)

    work: dict[str, Callable[[], Any]] = {
        "codes of events": code,
        "a, b: frame": lambda: [frame_2d(shot, settings) for shot in shots],
        "c: ArUco, pose": lambda: [find_marker_2d(frame, settings) for frame in frames],
        "d, e, f: regions": lambda: [finder(c, start) for start, c in zip(starts, coded, strict=True)],
        "f: tracks": track,
        "g: counts": count,
        "g: packets": lambda: [decode_packets(on, off, 0, settings.delta_t_id_us, settings.packet_format,
                                              gate=settings.led_gate)
                               for n_on, n_off in counts for on, off in zip(n_on, n_off, strict=True)],
    }  # fmt: skip
    return pd.Series({name: cpu_seconds(piece) / periods * 1e3 for name, piece in work.items()}, name="ms")


def generator_parts(scene: Scene, seconds: float, seed: int = 0) -> pd.Series[float]:
    """Time each part of the generator's work.

    Parameters
    ----------
    scene : Scene
    seconds : float
        Length of the recording [s].
    seed : int

    Returns
    -------
    Series
        Time per event [ns] by part.
    """
    spent_s = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def watch(part: str) -> Iterator[None]:
        started = time.process_time()
        yield
        spent_s[part] += time.process_time() - started

    generate(scene, 0.02, seed)
    started = time.process_time()
    n_events = sum(chunk.size for chunk in Recorder(scene, seconds, np.random.default_rng(seed), watch=watch))
    whole_s = time.process_time() - started
    taken = {GENERATOR_PARTS[part]: part_s for part, part_s in spent_s.items()}
    return pd.Series({**taken, "the rest": whole_s - sum(taken.values())}, name="ns") / n_events * 1e9


def copy_gb_per_s() -> float:
    """Return how fast a large array is copied, counting the bytes that are read and written [GB/s]."""
    source: npt.NDArray[np.float64] = np.ones(COPIED_BYTES // 8)
    target = np.empty_like(source)
    return 2 * source.nbytes / cpu_seconds(lambda: np.copyto(target, source), 5) / 1e9


def straight_line(x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[float, float, float]:
    """Fit a straight line.

    Parameters
    ----------
    x, y : array_like, shape (n,)

    Returns
    -------
    slope, intercept : float
    bend : float
        Distance of the farthest point from the line, as a share of the largest ``abs(y)``.

    Examples
    --------
    >>> [round(v, 6) for v in straight_line([1, 2, 3], [12, 14, 16])]
    [2.0, 10.0, 0.0]
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    slope, intercept = np.polyfit(x, y, 1)
    return float(slope), float(intercept), float(np.abs(slope * x + intercept - y).max() / np.abs(y).max())
