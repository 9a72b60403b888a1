"""The work that is timed: receive, generate, and the same two in plain NumPy to compare with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bicode_lab.camera import Recorder, Scene
from bicode_lab.events import Events, windows
from bicode_lab.marker import LedWaveform
from bicode_lab.recognition import ReceiverSettings, recognise
from bicode_lab.recognition.event_codes import CodedEvents, EventCoder
from bicode_studies.bench import streams
from bicode_studies.bench.plain_receiver import PlainReceiver
from bicode_studies.bench.plain_simulator import simulate


def receive(events: Events, settings: ReceiverSettings) -> int:
    """Read events with the receiver.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Times from 0, the start of the first period.
    settings : ReceiverSettings

    Returns
    -------
    int
        Number of sightings.
    """
    return sum(1 for _ in recognise(events, settings, t0_us=0))


def receive_plainly(events: Events, settings: ReceiverSettings) -> int:
    """Read events with the receiver in plain NumPy and OpenCV.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Times from 0, the start of the first period.
    settings : ReceiverSettings

    Returns
    -------
    int
        Number of regions.
    """
    receiver = PlainReceiver(settings)
    return sum(len(receiver(start, part)) for start, part in windows(events, settings.delta_t_whole_us, t0_us=0))


def coded_periods(
    events: Events, settings: ReceiverSettings
) -> tuple[list[int], Callable[[], list[CodedEvents]], list[CodedEvents]]:
    """Cut events into periods and code each, as the receiver does before it looks at them.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Times from 0, the start of the first period.
    settings : ReceiverSettings

    Returns
    -------
    starts_us : list of int
        Starts of the periods [us].
    code : callable
        The work: it codes all periods once more, each with a coder of its own.
    coded : list of CodedEvents
        The coded events of each period.
    """
    periods = list(windows(events, settings.delta_t_whole_us, t0_us=0))
    coders = [EventCoder(settings.width, settings.height) for _ in periods]

    def code() -> list[CodedEvents]:
        return [coder(part) for coder, (_, part) in zip(coders, periods, strict=True)]

    return [start_us for start_us, _ in periods], code, code()


def generate(scene: Scene, seconds: float, seed: int = 0) -> int:
    """Record a scene and drop its events.

    Parameters
    ----------
    scene : Scene
    seconds : float
        Length of the recording [s].
    seed : int
        Seed of all chance.

    Returns
    -------
    int
        Number of events.
    """
    return sum(chunk.size for chunk in Recorder(scene, seconds, np.random.default_rng(seed)))


def generate_plainly(seconds: float) -> int:
    """Simulate the blinking square of `streams.square_scene` on its patch in plain NumPy.

    Parameters
    ----------
    seconds : float
        Length of the recording [s].

    Returns
    -------
    int
        Number of events.
    """
    dark = np.ones((streams.PATCH_PX, streams.PATCH_PX))
    glow = np.zeros_like(dark)
    first = (streams.PATCH_PX - streams.SQUARE_PX) // 2
    glow[first:-first, first:-first] = streams.BRIGHT
    wave, rng = LedWaveform(payload=0x25), np.random.default_rng(0)
    return int(simulate(dark, glow, wave, streams.PIXEL, round(seconds * 1e6), rng).size)
