"""Name a light: which kind it is, with its rate, from some 50 ms of its events.

Each kind says what its edges may do at the ticks of a clock (`codes`). The probability of the events is summed over all
that a light of the kind may have sent, and over nothing else. The kind that makes the events most probable is the
answer (the evidence of Bayes' rule). All kinds have equal odds beforehand, but for a code that is not known here: one
light in a hundred is taken to have such. So no threshold decides between kinds: a square wave is also a possible Bicode
packet or serial line, but only one of very many, and loses to the kind that cannot be anything else.

Two things cannot be told from any events. A dimmer with a duty of one half is a light of constant frequency. And the
latencies of ON and OFF events differ by an unknown amount, which looks like a duty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bicode_lab.events import Events, slice_time
from bicode_lab.lights.evidence import PERIODIC_HZ, Score, clock_scores
from bicode_lab.lights.fit import Clock
from bicode_lab.lights.moving import comes_by_chance, moving_gain
from bicode_lab.lights.sample import FASTEST_HZ, onsets, take_sample

Kind = Literal[
    "none", "noise", "moving_edge", "mains", "pwm", "constant_frequency", "interval", "bicode", "uart", "unknown"
]
PERIODIC = ("mains", "pwm", "constant_frequency")
CLOCKED = (*PERIODIC, "interval", "bicode", "uart")
LOOK_US = 50_000
SURE = math.log(99.0)  # odds of 99 to 1 against every other kind
LEAST_EVENTS = 8
Z_99 = 2.576
LATENCY_US = 30.0  # standard deviation of the difference between the latencies of ON and OFF
MAINS_HZ = (100.0, 120.0)
MAINS_SPREAD_HZ = 0.5
SQUARE_WIDTH_US, SQUARE_SPREAD = 100.0, 1.2  # how edges of a switched light spread: median, and e-folds around it
RIPPLE_WIDTH, RIPPLE_SPREAD = 0.1, 0.6  # the same for a ripple, in cycles
SAME_RATE = 0.02
BROAD = 0.15  # cycles: two thirds of the events of an edge come within a third of a cycle
SHORTEST_WORD = 8  # chips


@dataclass(frozen=True, kw_only=True)
class LightName:
    """What a light is.

    Parameters
    ----------
    kind : str
        "none" (too few events), "noise", "moving_edge", "mains", "pwm", "constant_frequency", "interval", "bicode",
        "uart" or "unknown".
    margin : float
        Natural logarithm of the odds against the next kind.
    rate_hz : float or None
        Cycles per second; bits per second of Bicode, baud of UART, base periods per second of the interval code [Hz].
    duty, duty_error : float or None
        Share of the time that the light is on, and its standard error; of lights of one frequency.
    likely : str
        The likeliest kind; that of `kind` unless it is "unknown".
    n_events : int
        Events that were looked at.
    """

    kind: Kind
    margin: float
    rate_hz: float | None = None
    duty: float | None = None
    duty_error: float | None = None
    likely: Kind = "unknown"
    n_events: int = 0


def name_light(events: Events) -> LightName:
    """Name the light of a region.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region, in the order of time; the first 50 ms are looked at.

    Returns
    -------
    LightName

    Examples
    --------
    >>> from bicode_lab.events import no_events
    >>> name_light(no_events()).kind
    'none'
    """
    if events.size:
        first = int(events["t"][0])
        events = slice_time(events, first, first + LOOK_US)
    if events.size < LEAST_EVENTS:
        return LightName(kind="none", margin=0.0, likely="none", n_events=events.size)
    whole = _name(events)
    begins = onsets(events)
    if begins.size < LEAST_EVENTS:
        return whole
    begun = replace(_name(begins), n_events=events.size)
    if begun.kind in PERIODIC and whole.likely in PERIODIC:
        return whole  # all events of an edge tell duty and ripple
    surer = begun.margin > whole.margin or whole.kind not in CLOCKED
    return begun if begun.kind in CLOCKED and surer else whole


def name_region(events: Events, most_looks: int = 8) -> LightName:
    """Name the light of a region from several stretches of 50 ms, spread over its events.

    Stretches that say nothing are left out, and margins of the others add up.

    Parameters
    ----------
    events : ndarray of EVENT_DTYPE, shape (n,)
        Events of one region, in the order of time.
    most_looks : int
        Number of stretches at most.

    Returns
    -------
    LightName
        The likeliest kind of all; its rate and duty are those of the stretch that was surest.
    """
    if not events.size:
        return name_light(events)
    first, last = int(events["t"][0]), int(events["t"][-1])
    looks = max(1, min(most_looks, (last - first) // LOOK_US))
    begins = np.linspace(first, max(first, last - LOOK_US), looks).astype(np.int64).tolist()
    names = [name_light(slice_time(events, begin, begin + LOOK_US)) for begin in begins]
    told = [name for name in names if name.likely not in ("none", "noise", "unknown")] or names
    total: dict[str, float] = {}
    for name in told:
        total[name.likely] = total.get(name.likely, 0.0) + name.margin
    best = max(total, key=lambda kind: total[kind])
    margin = 2 * total[best] - sum(total.values())
    surest = max((name for name in told if name.likely == best), key=lambda name: name.margin)
    sure = margin >= SURE or best in ("none", "noise")
    return replace(surest, kind=surest.likely if sure else "unknown", margin=margin)


def _name(events: Events) -> LightName:
    """Name the light from some of its events."""
    scores = [Score(0.0, "noise"), *clock_scores(take_sample(events))]
    moving = moving_gain(events)
    if moving > 0:
        scores.append(Score(moving, "moving_edge"))
    first_one, *others = sorted(scores, key=lambda score: -score.evidence)
    rivals = [score.evidence for score in others if not _is_same(score, first_one)]
    margin = first_one.evidence - max(rivals, default=first_one.evidence)
    return _named(first_one, margin, events)


def _is_same(one: Score, other: Score) -> bool:
    """Return whether two scores give the same kind and rate."""
    if one.family != other.family or one.clock is None or other.clock is None:
        return one.family == other.family
    return abs(one.clock.period_us / other.clock.period_us - 1) < SAME_RATE


def _named(score: Score, margin: float, events: Events) -> LightName:
    """Make the name of the family with the most evidence."""
    sure, n_events = margin >= SURE, events.size
    if score.clock is None:
        sure = sure and (score.family != "noise" or comes_by_chance(events))
        kind: Kind = "noise" if score.family == "noise" else "moving_edge"
        return LightName(kind=kind if sure else "unknown", margin=margin, likely=kind, n_events=n_events)
    rate_hz = 1e6 / score.clock.period_us
    if score.family == "periodic":
        return _periodic(score.clock, margin, n_events)
    if score.family == "bicode":
        rate_hz /= 2
    likely: Kind = score.family  # type: ignore[assignment]
    return LightName(
        kind=likely if sure else "unknown", margin=margin, rate_hz=rate_hz, likely=likely, n_events=n_events
    )


def _periodic(clock: Clock, margin: float, n_events: int) -> LightName:
    """Tell mains, dimmers and lights of constant frequency from each other."""
    period_us = clock.period_us
    rate_hz = 1e6 / period_us
    ticks = clock.on.edge.size
    width = math.sqrt((clock.on.width**2 + clock.off.width**2) / 2)
    duty = ((clock.off.phase_us - clock.on.phase_us) / period_us) % 1.0
    # The latencies differ by as much as the events of an edge are spread: slow pixels are late, too.
    error = math.hypot(LATENCY_US / period_us, clock.on.width, clock.off.width)
    kind: Kind = "constant_frequency" if abs(duty - 0.5) <= Z_99 * error else "pwm"
    mains = max(_mains_odds(rate_hz, width, ticks, mains_hz) for mains_hz in MAINS_HZ)
    if mains > 0:
        kind = "mains"
    if abs(rate_hz / 110 - 1) < 0.2:
        margin = min(margin, abs(mains))
    if kind != "mains" and width > BROAD and rate_hz < FASTEST_HZ / SHORTEST_WORD:
        margin = 0.0  # what looks like one broad edge may be a word of a faster code
    return LightName(
        kind=kind if margin >= SURE else "unknown", margin=margin, rate_hz=rate_hz, duty=duty, duty_error=error,
        likely=kind, n_events=n_events,
    )  # fmt: skip


def _mains_odds(rate_hz: float, width: float, ticks: int, mains_hz: float) -> float:
    """Return the log-odds of a lamp on the mains against a light that is switched at any rate."""
    spread_hz = math.hypot(MAINS_SPREAD_HZ, rate_hz * width / max(ticks, 1) ** 1.5 * math.sqrt(6))
    here = -0.5 * ((rate_hz - mains_hz) / spread_hz) ** 2 - math.log(spread_hz * math.sqrt(2 * math.pi))
    anywhere = -math.log(rate_hz * math.log(PERIODIC_HZ[1] / PERIODIC_HZ[0]))
    width_us = width * 1e6 / rate_hz
    ripple = -0.5 * (math.log(width / RIPPLE_WIDTH) / RIPPLE_SPREAD) ** 2 - math.log(RIPPLE_SPREAD)
    square = -0.5 * (math.log(width_us / SQUARE_WIDTH_US) / SQUARE_SPREAD) ** 2 - math.log(SQUARE_SPREAD)
    return here - anywhere + ripple - square
