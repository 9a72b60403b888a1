"""Read a text as well as it can be read: with the levels and the timing known, beside which `read_text` is judged.

The rates of each context are estimated along the truth of another, long recording of the same light; the chips of the
recording are those of the transmitter. What is left to be found is the text. Both ways to weigh a bin are tried, and
the rates that follow from the light's settings if its events come by chance of their own; the best of the three counts.
"""

from __future__ import annotations

from dataclasses import replace
from math import erf

import numpy as np
import numpy.typing as npt

from bicode_lab.soft_receiver import UartLine
from bicode_lab.soft_receiver.levels import PHASES
from bicode_lab.soft_receiver.nodes import build_nodes
from bicode_lab.soft_receiver.text.amounts import OFF, ON, Amounts, Counts, count_events, weigh
from bicode_lab.soft_receiver.text.edge_rates import (
    FLOOR,
    Kernels,
    dispersion_of,
    edge_contexts,
    kernel_rates,
    rate_scores,
)
from bicode_lab.soft_receiver.text.learn import MEMORY
from bicode_lab.soft_receiver.viterbi import likeliest_path
from bicode_studies.real_light.synthetic_lights import Light, Sent, send

Floats = npt.NDArray[np.float64]

LONG_LETTERS = 1000
LEAD_CHIPS = 0.9  # from the begin of a kernel to the earlier of the two latencies
FEWEST = 1e-4  # expected events of a bin, over those of an edge


def known_share(sent: Sent, light: Light, rng: np.random.Generator, letters: int = LONG_LETTERS) -> float:
    """Read a recording with known levels and timing.

    Parameters
    ----------
    sent : Sent
        What `send` made of the light.
    light : Light
    rng : Generator
        For the other recording, along which the levels are estimated.
    letters : int
        Letters of the other recording, at least.

    Returns
    -------
    float
        Share of the letters that are right, 0 .. 1.
    """
    line = UartLine(rate_hz=light.rate_hz)
    letters_per_s = light.rate_hz * (1 - light.idle) / line.frame_chips
    long = replace(light, length_s=max(letters / letters_per_s, light.length_s), missing=0.0)
    other = send(long, rng)
    learn, read = _known_chips(other, light), _known_chips(sent, light)
    context = _contexts(other, learn[1], len(learn[0]), line)
    shares = [_share_right(read, sent, _poisson_rates(light), np.ones(2), read[0].astype(np.float32), line)]
    for weighing in ("events", "marks"):
        both = weigh(np.concatenate([learn[0], read[0]]), "events" if weighing == "events" else "marks")
        amounts = both[: len(learn[0])]
        rates = _rates_along(amounts, context)
        shares.append(
            _share_right(read, sent, rates, dispersion_of(amounts, rates[context]), both[len(learn[0]) :], line)
        )
    return max(shares)


def letters_seen(sent: Sent, light: Light, frame_chips: int) -> npt.NDArray[np.bool_]:
    """Tell which letters no missing stretch touches.

    Parameters
    ----------
    sent : Sent
    light : Light
    frame_chips : int
        Chips of a letter.

    Returns
    -------
    ndarray of bool, shape (letters,)
    """
    seen = np.ones(sent.start_us.size, np.bool_)
    length_us = (frame_chips + 2) * 1e6 / light.rate_hz
    for begin, end in sent.missing_us:
        seen &= (sent.start_us + length_us < begin) | (sent.start_us > end)
    return seen


def _known_chips(sent: Sent, light: Light) -> tuple[Counts, npt.NDArray[np.int64]]:
    """Return the counts of the chips by the transmitter's clock, and the chip at which each letter begins."""
    chip_us, frame = 1e6 / light.rate_hz, 11
    pauses = np.diff(sent.start_us) / chip_us / (1 + light.clock_ppm * 1e-6) - frame
    first = 3 + np.concatenate([[0], np.cumsum(frame + np.round(pauses).astype(np.int64))]).astype(np.int64)
    ends_us = sent.start_us + frame * chip_us * (1 + light.clock_ppm * 1e-6)
    knots_us = np.stack([sent.start_us, np.maximum(ends_us - 1e-3, sent.start_us)], axis=1).ravel()
    knots = np.stack([first, first + frame], axis=1).ravel().astype(np.float64)
    t_us = sent.events["t"] + 0.5
    before, after = np.minimum(t_us - knots_us[0], 0) / chip_us, np.maximum(t_us - knots_us[-1], 0) / chip_us
    chips = np.interp(t_us, knots_us, knots) + before + after
    chips += LEAD_CHIPS - min(light.latency_on, light.latency_off)
    return count_events(chips, sent.events["p"] > 0, 0, int(first[-1]) + frame + 4), first


def _contexts(sent: Sent, first: npt.NDArray[np.int64], n_chips: int, line: UartLine) -> npt.NDArray[np.int32]:
    """Return the context of each chip of what was sent."""
    levels = np.ones(n_chips, np.int32)
    for begin, letter in zip(first, sent.text, strict=True):
        levels[begin : begin + line.frame_chips] = line.encode(ord(letter))
    ahead = np.concatenate([np.ones(MEMORY, np.int32), levels])
    shifted = [ahead[MEMORY - back : MEMORY - back + n_chips] << back for back in range(MEMORY)]
    return np.asarray(np.sum(shifted, axis=0), np.int32)


def _rates_along(amounts: Amounts, context: npt.NDArray[np.int32]) -> Floats:
    """Estimate the rates of each context along the truth."""
    visits = np.bincount(context, minlength=1 << MEMORY)
    sums = np.zeros((1 << MEMORY, PHASES, 2))
    for c in np.flatnonzero(visits):
        sums[c] = amounts[context == c].sum(axis=0, dtype=np.float64)
    mean = np.maximum(amounts.mean(axis=(0, 1), dtype=np.float64), FLOOR)
    guess = np.broadcast_to(0.03 * mean, sums.shape)
    return np.asarray((sums + guess) / (visits[:, None, None] + 1), np.float64)


def _poisson_rates(light: Light) -> Floats:
    """Compute the rates of a light whose events come by chance of their own."""
    borders = np.arange((MEMORY - 1) * PHASES + 1) / PHASES
    width = float(np.hypot(light.edge_jitter, light.event_jitter))
    edge = np.empty((2, MEMORY - 1, PHASES))
    sides = ((ON, light.events_on, light.latency_on), (OFF, light.events_off, light.latency_off))
    for side, events, latency in sides:
        middle = LEAD_CHIPS + latency - min(light.latency_on, light.latency_off)
        held = np.array([0.5 * (1 + erf((border - middle) / width / np.sqrt(2))) for border in borders])
        edge[side] = (events * np.diff(held)).reshape(MEMORY - 1, PHASES)
    stray = light.stray_hz / 2 / light.rate_hz / PHASES
    background = np.full(2, stray + FEWEST * light.events / PHASES)
    return kernel_rates(Kernels(edge, background), edge_contexts(MEMORY))


def _share_right(
    known: tuple[Counts, npt.NDArray[np.int64]],
    sent: Sent,
    rates: Floats,
    dispersion: Floats,
    amounts: Amounts,
    line: UartLine,
) -> float:
    """Find the likeliest text, and return the share of letters that stand in their places."""
    nodes = build_nodes(line, MEMORY, True)
    path = likeliest_path(rate_scores(amounts, np.maximum(rates, FLOOR), dispersion), nodes)
    at = known[1][:, None] + np.arange(line.frame_chips)
    truth = np.array([line.encode(ord(letter)) for letter in sent.text]).reshape(at.shape)
    right = ((nodes.context[path][at] & 1) == truth).all(axis=1)
    seen = letters_seen(sent, Light(rate_hz=line.rate_hz), line.frame_chips)
    return float(right[seen].mean()) if seen.any() else 0.0
