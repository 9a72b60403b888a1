"""How far receiver and generator are from the least that they can cost: the second half of notebook 20."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pandas as pd

from bicode_lab.camera import Scene
from bicode_lab.events import Events, slice_time
from bicode_lab.recognition import ReceiverSettings, RegionFinder
from bicode_lab.recognition.event_codes import EventCoder
from bicode_lab.recognition.marker_2d import aruco_detector, find_marker_2d, frame_2d, to_image
from bicode_studies.bench import scaling as cost
from bicode_studies.bench.lower_bounds import least_generator_ns, least_ns
from bicode_studies.bench.rows import simulate_plainly
from bicode_studies.bench.streams import MARKER_SHARE
from bicode_studies.bench.timing import all_opencv_threads

PLAIN_FRAME_US = 100.0  # of the plain NumPy simulator


def receiver_table(boxes: pd.Series[float], events: Events, settings: ReceiverSettings) -> pd.DataFrame:
    """The boxes' times [ms] and the events of one period of their stream in; beside each the least it can cost out.

    Only loops over events have a least here: codes read and write each event; regions change a word of marks; counts
    look up a byte, and of the markers' events change a word of sums and look at it again. In ns an event.
    """
    least = least_ns(events, settings.width, settings.height)
    box_numbers, sums, marks = (float(least.iloc[k : k + 2].min()) for k in (2, 4, 6))  # asked for ahead or not
    table = pd.DataFrame({"takes_ns": boxes * 1e6 / events.size})
    table["least_ns"] = pd.Series({
        "codes of events": least["read them, write codes"],
        "d, e, f: regions": marks,
        "g: counts": box_numbers + 2 * MARKER_SHARE * sums,
    })  # fmt: skip
    return table


def generator_table(parts: pd.Series[float], scene: Scene) -> pd.DataFrame:
    """The generator's parts and their scene in; beside each the least it can cost out [ns an event]."""
    way, counted, stored = least_generator_ns(scene)
    table = pd.DataFrame({"takes_ns": parts})
    table["least_ns"] = pd.Series({"pixels": way, "sorting by time": counted + stored})
    return table


def whole_table(events: Events, periods: int, settings: ReceiverSettings) -> pd.Series[float]:
    """Events of some periods in; processor time of the whole receiver's parts on one core for a period out [ms].

    ``"counts, packets, the rest"`` is what the whole takes beyond the other parts.
    """
    parts = [slice_time(events, k * cost.PERIOD_US, (k + 1) * cost.PERIOD_US) for k in range(periods)]
    coders = [EventCoder(settings.width, settings.height) for _ in parts]
    coded = [coder(part) for coder, part in zip(coders, parts, strict=True)]
    shots = [c.between(k * cost.PERIOD_US, k * cost.PERIOD_US + settings.delta_t_2d_us) for k, c in enumerate(coded)]
    images = [to_image(frame_2d(shot, settings), settings) for shot in shots]
    finder, detector = RegionFinder(settings), aruco_detector(settings.dictionary)
    work: dict[str, Callable[[], Any]] = {
        "codes of events": lambda: [coder(part) for coder, part in zip(coders, parts, strict=True)],
        "detectMarkers": lambda: [detector.detectMarkers(image) for image in images],
        "a, b, c with it": lambda: [find_marker_2d(frame_2d(shot, settings), settings) for shot in shots],
        "d, e, f: regions": lambda: [finder(c, k * cost.PERIOD_US) for k, c in enumerate(coded)],
        "whole": partial(cost.receive, events, settings),
    }
    taken = pd.Series({name: cost.seconds_of(piece, 5) / periods * 1e3 for name, piece in work.items()})
    known = taken["codes of events"] + taken["a, b, c with it"] + taken["d, e, f: regions"]
    return pd.Series({
        "codes of events": taken["codes of events"],
        "c: detectMarkers": taken["detectMarkers"],
        "a, b, c: frame, pose": max(taken["a, b, c with it"] - taken["detectMarkers"], 0.0),
        "d, e, f: regions": taken["d, e, f: regions"],
        "counts, packets, the rest": max(taken["whole"] - known, 0.0),
    }, name="ms")  # fmt: skip


def two_core_bounds(parts: pd.Series[float]) -> tuple[float, float]:
    """What `whole_table` gave in; two times by the clock that two cores cannot beat out [ms].

    Half of the sum, as if all could run side by side; and the longer of the two chains of this receiver, which both
    begin with codes and end with counts and packets, with 2D markers or regions between.

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
    """Events of some periods in; time by the clock for a period out [ms], OpenCV with as many threads as it takes."""
    taken = []
    with all_opencv_threads():
        for _ in range(repeats):
            started = time.perf_counter()
            cost.receive(events, settings)
            taken.append(time.perf_counter() - started)
    return min(taken) / periods * 1e3


def against_plain(scene: Scene, seconds: float, times: float = 50.0) -> pd.Series[float]:
    """The bench's patch, a length and how many times faster is asked for in; what frames and events take out.

    The plain NumPy simulator's time for a frame [ms]; what an event takes here, and what it may take [ns].
    """
    plain_s = cost.seconds_of(partial(simulate_plainly, seconds), 2)
    n_events = cost.generate(scene, seconds)
    ours_s = cost.seconds_of(partial(cost.generate, scene, seconds), 3)
    return pd.Series({
        "plain_frame_ms": plain_s / (seconds * 1e6 / PLAIN_FRAME_US) * 1e3,
        "takes_ns": ours_s / n_events * 1e9,
        "asked_ns": plain_s / times / n_events * 1e9,
        "times": plain_s / ours_s,
    })  # fmt: skip
