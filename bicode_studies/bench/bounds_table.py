"""How far receiver and generator are from the least that they can cost: the second half of notebook 20."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import pandas as pd

from bicode_lab.camera import Scene
from bicode_lab.events import Events
from bicode_lab.recognition import ReceiverSettings, RegionFinder
from bicode_lab.recognition.marker_2d import aruco_detector, find_marker_2d, frame_2d, to_image
from bicode_studies.bench.lower_bounds import least_generator_ns, least_ns
from bicode_studies.bench.plain_simulator import FRAME_US
from bicode_studies.bench.streams import MARKER_SHARE
from bicode_studies.bench.timing import ALL_THREADS, cpu_seconds, opencv_threads, time_in_turn
from bicode_studies.bench.workloads import coded_periods, generate, generate_plainly, receive

ASKED_TIMES = 50.0  # the generator should be so many times faster than the plain simulator


def receiver_table(boxes: pd.Series[float], events: Events, settings: ReceiverSettings) -> pd.DataFrame:
    """Compare the time of each box of the receiver with the least that it can cost.

    Only loops over events have a least cost here. Codes read and write each event. Regions change a word of marks.
    Counts look up a byte; of the markers' events they also change a word of sums and look at it again.

    Parameters
    ----------
    boxes : Series
        What `scaling.receiver_boxes` returns, time per period [ms].
    events : ndarray of EVENT_DTYPE, shape (n,)
        The events of one period of the same stream.
    settings : ReceiverSettings

    Returns
    -------
    DataFrame
        One row for each box: ``takes_ns`` and ``least_ns``, time per event; nan where there is no least cost.
    """
    least = least_ns(events, settings.width, settings.height)
    box_numbers, sums, marks = (float(least.iloc[k : k + 2].min()) for k in (2, 4, 6))  # fetched ahead or not
    table = pd.DataFrame({"takes_ns": boxes * 1e6 / events.size})
    table["least_ns"] = pd.Series({
        "codes of events": least["read them, write codes"],
        "d, e, f: regions": marks,
        "g: counts": box_numbers + 2 * MARKER_SHARE * sums,
    })  # fmt: skip
    return table


def generator_table(parts: pd.Series[float], scene: Scene) -> pd.DataFrame:
    """Compare the time of each part of the generator with the least that it can cost.

    Parameters
    ----------
    parts : Series
        What `scaling.generator_parts` returns, time per event [ns].
    scene : Scene
        The scene of `parts`.

    Returns
    -------
    DataFrame
        One row for each part: ``takes_ns`` and ``least_ns``, time per event; nan where there is no least cost.
    """
    way, counted, stored = least_generator_ns(scene)
    table = pd.DataFrame({"takes_ns": parts})
    table["least_ns"] = pd.Series({"pixels": way, "sorting by time": counted + stored})
    return table


def whole_table(events: Events, periods: int, settings: ReceiverSettings) -> pd.Series[float]:
    """Time the parts of the whole receiver on one core.

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
        Processor time per period [ms] by part. ``"counts, packets, the rest"`` is what the whole receiver takes beyond
        the other parts.
    """
    starts, code, coded = coded_periods(events, settings)
    shots = [c.between(start, start + settings.delta_t_2d_us) for start, c in zip(starts, coded, strict=True)]
    images = [to_image(frame_2d(shot, settings), settings) for shot in shots]
    finder, detector = RegionFinder(settings), aruco_detector(settings.dictionary)
    work: dict[str, Callable[[], Any]] = {
        "codes of events": code,
        "detectMarkers": lambda: [detector.detectMarkers(image) for image in images],
        "a, b, c with it": lambda: [find_marker_2d(frame_2d(shot, settings), settings) for shot in shots],
        "d, e, f: regions": lambda: [finder(c, start) for start, c in zip(starts, coded, strict=True)],
        "whole": partial(receive, events, settings),
    }
    taken = pd.Series({name: cpu_seconds(piece, 5) / periods * 1e3 for name, piece in work.items()})
    known = taken["codes of events"] + taken["a, b, c with it"] + taken["d, e, f: regions"]
    return pd.Series({
        "codes of events": taken["codes of events"],
        "c: detectMarkers": taken["detectMarkers"],
        "a, b, c: frame, pose": max(taken["a, b, c with it"] - taken["detectMarkers"], 0.0),
        "d, e, f: regions": taken["d, e, f: regions"],
        "counts, packets, the rest": max(taken["whole"] - known, 0.0),
    }, name="ms")  # fmt: skip


def two_core_bounds(parts: pd.Series[float]) -> tuple[float, float]:
    """Return two elapsed times that two cores cannot beat.

    The first is half of the sum, as if all parts could run side by side. The second is the longer of the two chains of
    this receiver: both begin with codes and end with counts and packets, with 2D markers or regions between.

    Parameters
    ----------
    parts : Series
        What `whole_table` returns.

    Returns
    -------
    half_ms, chain_ms : float

    Examples
    --------
    >>> names = ("codes of events", "c: detectMarkers", "a, b, c: frame, pose", "d, e, f: regions")
    >>> two_core_bounds(pd.Series([1, 6, 1, 4, 2.0], [*names, "counts, packets, the rest"]))
    (7.0, 10.0)
    """
    markers = parts["c: detectMarkers"] + parts["a, b, c: frame, pose"]
    between = max(markers, parts["d, e, f: regions"])
    chain = parts["codes of events"] + between + parts["counts, packets, the rest"]
    return float(parts.sum() / 2), float(chain)


def whole_by_clock(events: Events, periods: int, settings: ReceiverSettings, repeats: int = 5) -> float:
    """Return the elapsed time of the whole receiver, with as many OpenCV threads as OpenCV chooses.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        A stream that starts at 0.
    periods : int
        Length of the stream in periods.
    settings : ReceiverSettings
    repeats : int
        The shortest of so many times counts.

    Returns
    -------
    float
        Elapsed time per period [ms].
    """
    with opencv_threads(ALL_THREADS):
        (timing,) = time_in_turn(repeats, partial(receive, events, settings))
    return timing.wall_s / periods * 1e3


def against_plain(scene: Scene, seconds: float) -> pd.Series[float]:
    """Compare the generator with the plain NumPy simulator.

    Parameters
    ----------
    scene : Scene
        The patch with the blinking square, see `streams.square_scene`.
    seconds : float
        Length of the recording [s].

    Returns
    -------
    Series
        ``plain_frame_ms``, what a frame costs the plain simulator; ``takes_ns``, what an event costs the generator;
        ``asked_ns``, what it may cost to be `ASKED_TIMES` times faster; ``times``, how many times faster it is.
    """
    plain_s = cpu_seconds(partial(generate_plainly, seconds), 2)
    n_events = generate(scene, seconds)
    ours_s = cpu_seconds(partial(generate, scene, seconds), 3)
    return pd.Series({
        "plain_frame_ms": plain_s / (seconds * 1e6 / FRAME_US) * 1e3,
        "takes_ns": ours_s / n_events * 1e9,
        "asked_ns": plain_s / ASKED_TIMES / n_events * 1e9,
        "times": plain_s / ours_s,
    })  # fmt: skip
