"""Make the events of one light that sends a text, with everything that makes real ones hard to read.

This is no camera: there are no pixels. An edge makes a number of events, and each comes after the edge by a latency,
by what scatters the whole edge, and by what scatters each event. Everything else is a habit that sensors and lights
have: tails, bursts, a refractory period, stray events, lamps, missing stretches, idle stretches, a clock that is off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bicode_lab.events import Events, make_events
from bicode_lab.soft_receiver import UartLine

Floats = npt.NDArray[np.float64]
Levels = npt.NDArray[np.uint8]

TEXT = """The lamp on the pier says what the tide will do: high at 06:40, low at 12:55 (wind NW 4, 17 C).
Boats 3, 8 & 21 leave early; "Marie" waits for the mail. Questions? Ask at the harbour office, 2nd floor!
"""
"""Letters, digits and signs; longer texts are made of random letters of it."""


@dataclass(frozen=True, kw_only=True)
class Light:
    """A light that sends a text, and how its edges become events.

    Parameters
    ----------
    rate_hz : float
        Chips per second by the nominal clock [Hz].
    length_s : float
        Length of the recording [s].
    events : float
        Mean events of an edge: the geometric mean of ON and OFF.
    ratio : float
        ON events of a rise over OFF events of a fall.
    latency_on, latency_off : float
        Mean delay of the events after a rise, and after a fall [chips].
    edge_jitter, event_jitter : float
        Standard deviation of the delay of a whole edge, and of each event beside it [chips].
    tail_off : float
        Mean of an exponential delay of OFF events that is added [chips].
    burst : float
        Number of events of an edge over its mean: variance of this factor; 0 is a Poisson count.
    comb_us : float
        Step to which a readout delays the events [us]; 0 is none.
    refractory : float
        Time after an edge in which the next one makes only half as many events [chips].
    clock_ppm : float
        How much longer the light's chip is than nominal [1e-6].
    drift_ppm : float
        How much this changes over the recording [1e-6].
    idle : float
        Share of the chips in which nothing is sent, between letters; 0 .. 0.9.
    whole_idle : bool
        Whether an idle stretch is a whole number of chips.
    stray_hz : float
        Stray events per second, half of them ON [Hz].
    lamp_hz, lamp_events : float
        Frequency of a lamp's brightness [Hz], and its ON events per cycle; as many are OFF.
    missing : float
        Share of the recording of which no event is left, in stretches of a tenth of a second.
    """

    rate_hz: float = 1000.0
    length_s: float = 2.0
    events: float = 10.0
    ratio: float = 1.0
    latency_on: float = 0.2
    latency_off: float = 0.2
    edge_jitter: float = 0.0
    event_jitter: float = 0.05
    tail_off: float = 0.0
    burst: float = 0.0
    comb_us: float = 0.0
    refractory: float = 0.0
    clock_ppm: float = 0.0
    drift_ppm: float = 0.0
    idle: float = 0.0
    whole_idle: bool = True
    stray_hz: float = 0.0
    lamp_hz: float = 0.0
    lamp_events: float = 0.0
    missing: float = 0.0

    @property
    def events_on(self) -> float:
        """Mean ON events of a rise."""
        return float(self.events * np.sqrt(self.ratio))

    @property
    def events_off(self) -> float:
        """Mean OFF events of a fall."""
        return float(self.events / np.sqrt(self.ratio))


@dataclass(frozen=True, eq=False)
class Sent:
    """What a light sent, and the events.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
    text : str
        The letters.
    start_us : ndarray, shape (letters,)
        When the start of each letter began [us].
    edge_us : ndarray, shape (edges,)
        When the light switched [us].
    rises : ndarray of bool, shape (edges,)
        Whether it was switched on.
    missing_us : ndarray, shape (stretches, 2)
        Begin and end of the stretches that are missing [us].
    """

    events: Events
    text: str
    start_us: Floats
    edge_us: Floats
    rises: npt.NDArray[np.bool_]
    missing_us: Floats


MISSING_US = 100_000.0


def send(light: Light, rng: np.random.Generator) -> Sent:
    """Send a text of random letters and make its events.

    Parameters
    ----------
    light : Light
    rng : Generator

    Returns
    -------
    Sent
        The light is on before the first letter and after the last one.
    """
    line = UartLine(rate_hz=light.rate_hz)
    text, first_chip = _text(light, rng, line.frame_chips)
    frames = np.array([line.encode(ord(letter)) for letter in text]).reshape(-1, line.frame_chips)
    # Each frame ends with 1 and begins with 0, so edges between frames are falls at the begin of each frame.
    levels = np.concatenate([np.ones((len(text), 1), np.uint8), frames], axis=1).astype(np.int64)
    frame, chip = np.nonzero(np.diff(levels, axis=1))
    edge_chip = first_chip[frame] + chip
    rises = levels[frame, chip + 1] == 1
    whole_us = _real_us(edge_chip, light)
    edge_us, parts = whole_us, []
    for side in (True, False):
        parts.append(_edge_events(edge_us[rises == side], side, edge_us, light, rng))
    parts.append(_stray(light, rng))
    t_us, p = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    end_us = light.length_s * 1e6
    if light.comb_us:
        t_us = np.ceil(t_us / light.comb_us) * light.comb_us
    keep = (t_us >= 0) & (t_us < end_us)
    n_missing = round(light.missing * end_us / MISSING_US)
    missing_us = np.sort(rng.uniform(0, max(end_us - MISSING_US, 0), n_missing))
    for begin in missing_us:
        keep &= ~((t_us >= begin) & (t_us < begin + MISSING_US))
    zeros = np.zeros(int(keep.sum()), np.uint16)
    events = make_events(zeros, zeros, p[keep].astype(np.int16), t_us[keep].astype(np.int64))
    missing = np.stack([missing_us, missing_us + MISSING_US], axis=1)
    return Sent(events, text, _real_us(first_chip, light), edge_us, rises, missing)


def _text(light: Light, rng: np.random.Generator, frame_chips: int) -> tuple[str, Floats]:
    """Return random letters that fill the recording, and the chip number at which each begins."""
    n_chips = light.length_s * light.rate_hz - 2 * frame_chips
    n_letters = max(1, int(n_chips * (1 - light.idle) / frame_chips))
    text = "".join(np.array(list(TEXT))[rng.integers(0, len(TEXT), n_letters)])
    pauses = np.zeros(n_letters)
    if light.idle > 0:  # a third of the pauses is short, and there are some long ones
        weights = rng.exponential(1, n_letters) * rng.choice([0, 0, 0.1, 20], n_letters, p=[0.35, 0.35, 0.27, 0.03])
        pauses = light.idle * n_chips * weights / max(float(weights.sum()), 1e-9)
        if light.whole_idle:
            pauses = np.round(pauses)
    first = rng.uniform(1, frame_chips) + np.concatenate([[0], np.cumsum(frame_chips + pauses[1:])])
    whole = _real_us(first + frame_chips, light) < light.length_s * 1e6
    return "".join(np.array(list(text))[whole]), first[whole]


def _real_us(chip: Floats, light: Light) -> Floats:
    """Return the times of chip numbers by the clock of the light [us]."""
    part = chip / (light.length_s * light.rate_hz) - 0.5
    slower = light.clock_ppm + light.drift_ppm * part / 2
    return np.asarray(chip * 1e6 / light.rate_hz * (1 + slower * 1e-6), np.float64)


def _edge_events(
    mine_us: Floats, side: bool, edge_us: Floats, light: Light, rng: np.random.Generator
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return times and polarities of the events of the edges of one side."""
    chip_us = 1e6 / light.rate_hz
    mean = np.full(mine_us.size, light.events_on if side else light.events_off)
    if light.refractory:
        at = np.searchsorted(edge_us, mine_us - 1e-3) - 1
        since = np.where(at >= 0, mine_us - edge_us[np.maximum(at, 0)], np.inf)
        mean = np.where(since < light.refractory * chip_us, 0.5 * mean, mean)
    if light.burst:
        mean = mean * rng.gamma(1 / light.burst, light.burst, mean.size)
    n = rng.poisson(mean)
    delay = (light.latency_on if side else light.latency_off) + rng.normal(0, light.edge_jitter, mine_us.size)
    each = np.repeat(delay, n) + rng.normal(0, light.event_jitter, int(n.sum()))
    if not side and light.tail_off:
        each += rng.exponential(light.tail_off, each.size)
    return np.repeat(mine_us, n) + each * chip_us, np.full(each.size, int(side))


def _stray(light: Light, rng: np.random.Generator) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Return times and polarities of stray events and of those of a lamp."""
    n = rng.poisson(light.stray_hz * light.length_s)
    t_us, p = rng.uniform(0, light.length_s * 1e6, n), rng.integers(0, 2, n)
    if not light.lamp_hz:
        return t_us, p
    cycles = int(light.length_s * light.lamp_hz)
    made = rng.poisson(light.lamp_events, (2, cycles))
    phase = rng.uniform()
    for side in (0, 1):
        each = np.repeat(np.arange(cycles), made[side]) + rng.normal(0.25 + 0.5 * side + phase, 0.09, made[side].sum())
        t_us, p = np.concatenate([t_us, each / light.lamp_hz * 1e6]), np.concatenate([p, np.full(each.size, side)])
    return t_us, p
